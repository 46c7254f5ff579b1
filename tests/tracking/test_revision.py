"""Estimates are held back by a lag, in which a tracker that knows more later may revise them."""

from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise

import pytest

from airborne.tracking import Estimate, Status
from airborne.tracking.revision import track_with_revision
from airborne.tracking.tracker import track_frames
from airborne.video import Frames

N, LAG = 24, 6


def estimate(index: int, score: float, *moved: int) -> Estimate:
    return Estimate(
        index=index,
        time_s=Fraction(index, 50),
        status=Status.TRACKED,
        score=score,
        pose=None,
        covariance=None,
        n_views=1,
        moved=moved,
    )


@dataclass
class Lost:
    """A tracker whose scores tell all that it has learned; at some frames it knows that earlier ones were wrong."""

    found_again: dict[int, int]  # frame: from which frame on it had been wrong

    @property
    def revises(self):
        return True

    def init(self):
        return 0.0

    def search(self, state, frames):
        moved = (3,) if frames.index in self.found_again else ()
        return estimate(frames.index, frames.index + state / 2, *moved)

    def learn(self, state, frames, estimate):
        return state / 2 + estimate.score

    def revise(self, records, state):
        first = self.found_again[records[-1].frames.index]
        return {
            each.frames.index: replace(each.estimate, score=each.estimate.score + 1000, moved=())
            for each in records[:-1]
            if each.frames.index >= first
        }


def frames(n=N):
    return (Frames(index=i, time_s=Fraction(i, 50), views=()) for i in range(n))


def tracked(found_again, done=None, **changes):
    """The scores in the order in which they are yielded, and the frames that are written."""
    written, yielded = [], []
    loop = track_with_revision(Lost(found_again), frames(), written.append, done, lag=LAG, **changes)
    for observed, each in loop:
        assert observed.index == each.index
        assert observed.index in [other.index for other in written] or observed.index in (done or {})
        yielded.append(each)
    return yielded, [each.index for each in written]


def test_nothing_changes_where_nothing_is_found_again():
    yielded, written = tracked({})
    plain = [each for _, each in track_frames(Lost({}), frames(), lambda each: None)]
    assert [each.score for each in yielded] == [each.score for each in plain]
    assert written == list(range(N))


def test_frames_before_are_revised_and_what_follows_has_learned_from_them():
    yielded, _ = tracked({10: 7})
    plain, _ = tracked({})
    is_changed = [a.score != b.score for a, b in zip(yielded, plain, strict=True)]
    assert [each.index for each in yielded if each.score > 900] == [7, 8, 9]
    assert is_changed == [False] * 7 + [True] * 3 + [False] + [True] * (N - 11)


def test_no_frame_further_back_than_the_lag_is_revised():
    yielded, _ = tracked({12: 0})
    assert [each.index for each in yielded if each.score > 900][:2] == [12 - LAG, 12 - LAG + 1]


def test_frames_that_one_revision_changed_are_written_before_the_first_of_them_is_yielded():
    written = []
    for observed, _ in track_with_revision(Lost({10: 7}), frames(), written.append, lag=LAG):
        if observed.index == 7:
            assert written[-1].index == 10


@pytest.mark.parametrize("found_again", [{}, {10: 7}, {9: 5, 11: 8, 20: 17}, {7: 0, 12: 8}])
def test_run_that_was_broken_off_goes_on_to_the_same_result(found_again):
    whole, written = tracked(found_again)
    together = set(range(N))  # a run ends between frames that leave alone or together
    for again, first in found_again.items():
        together -= set(range(max(first, again - LAG), again))
    for last in together:
        done = {each.index: each for each in whole[: last + 1]}
        resumed, rest = tracked(found_again, done)
        assert [each.score for each in resumed] == [each.score for each in whole]
        assert rest == written[last + 1 :]


def test_frames_are_yielded_in_the_order_of_time():
    yielded, written = tracked({9: 5, 11: 8, 20: 17})
    assert [each.index for each in yielded] == written == list(range(N))
    assert all(a.time_s < b.time_s for a, b in pairwise(yielded))
