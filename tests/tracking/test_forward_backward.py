"""A body is tracked forward and backward without any key: what one direction loses, the other has."""

from dataclasses import dataclass, field, replace
from fractions import Fraction

import numpy as np
import pytest

from airborne.body.chain import delta_between
from airborne.tracking import both_directions
from airborne.tracking.backward import turn_estimate, turn_time
from airborne.tracking.both_directions import track_forward_backward
from airborne.tracking.estimate import Doubt, Estimate, Status, lost_estimate
from airborne.tracking.methods import Settings, tracker_of
from airborne.tracking.tracker import step
from airborne.video import Frames
from tests.support.people import HUMAN
from tests.support.scenes import CROSS, Scene, errors
from tests.tracking.test_passes import TRUTH, with_arm

N = 12
LOST = range(4, 8)  # frames in which the forward pass has the arm elsewhere


@dataclass(frozen=True)
class LosesAnArm:
    """A tracker that loses an arm for some frames, which going back it does not; the images know where it is."""

    gone: tuple[int, ...] = ()  # frames without the body
    doubts: bool = True  # it is uncertain as it loses the arm

    def init(self):
        return 1  # the direction

    def turn(self, state, forward):
        return -state

    def learn(self, state, frames, estimate):
        return state

    def search(self, state, frames):
        if abs(frames.index) in self.gone:
            return lost_estimate(frames.index, frames.time_s)
        pose = with_arm(1.0) if state > 0 and frames.index in LOST else TRUTH
        is_uncertain = self.doubts and state > 0 and frames.index == LOST.start
        return Estimate(
            index=frames.index,
            time_s=frames.time_s,
            status=Status.UNCERTAIN if is_uncertain else Status.TRACKED,
            score=1.0,
            pose=pose,
            covariance=1e-6 * np.eye(HUMAN.n_dofs),
            n_views=3,
        )

    def weigh(self, state, frames, poses):
        return np.array([float(np.abs(delta_between(TRUTH, pose)).max() > 0.1) for pose in poses])


def nothing(index: int) -> Frames:
    return Frames(index, Fraction(index, 50), ())


def found_by(tracker, n: int = N) -> list[Estimate]:
    run = track_forward_backward(tracker, HUMAN, map(nothing, range(n)), write=lambda estimate: None)
    return [estimate for _, estimate in run]


def test_an_arm_that_is_lost_is_where_the_backward_pass_has_it_and_as_uncertain_as_they_are_apart():
    estimates = found_by(LosesAnArm())
    assert [each.index for each in estimates] == list(range(N))
    for each in estimates:
        np.testing.assert_allclose(delta_between(TRUTH, each.pose), 0, atol=1e-9)
        assert (np.trace(each.covariance) > 0.5) == (each.index in LOST)


def test_where_nothing_is_in_doubt_the_body_is_tracked_forward_alone():
    pose = found_by(LosesAnArm(doubts=False))[LOST.start].pose
    np.testing.assert_allclose(delta_between(with_arm(1.0), pose), 0, atol=1e-9)


@dataclass(frozen=True)
class TurnsRound(LosesAnArm):
    """A tracker that turns the body round on the way forward, which going back it does not undo."""

    from_frame: int = 6
    in_doubt: tuple[int, ...] = ()  # further frames that are uncertain on the way forward

    def search(self, state, frames):
        found = super().search(state, frames)
        if state > 0 and frames.index in self.in_doubt:
            found = replace(found, status=Status.UNCERTAIN)
        is_round = state < 0 or frames.index >= self.from_frame
        elsewhere = TRUTH.move(np.zeros(3), np.array([0.0, 0.0, np.pi]))
        return replace(found, pose=elsewhere if is_round else TRUTH)


def test_where_the_way_back_does_not_end_at_the_known_start_no_frame_is_tracked():
    estimates = found_by(TurnsRound())
    assert [each.status for each in estimates] == [Status.TRACKED, *[Status.UNCERTAIN] * (N - 1)]
    assert {each.doubts for each in estimates[1:]} == {(Doubt.DIRECTIONS,)}
    assert {each.status for each in found_by(LosesAnArm())[1:]} == {Status.TRACKED}


def test_after_a_stretch_that_is_lost_nothing_is_tracked_until_nothing_is_in_doubt(monkeypatch):
    monkeypatch.setattr(both_directions, "_MOST_BYTES", 0)
    monkeypatch.setattr(both_directions, "_FEWEST_HELD", 7)  # stretches are frames 1 to 7, 8 to 14 and 15 to 21
    estimates = found_by(TurnsRound(in_doubt=(10,)), 22)
    assert [each.status for each in estimates[1:15]] == [Status.UNCERTAIN] * 14
    assert [each.status for each in estimates[15:]] == [Status.TRACKED] * 7


@pytest.mark.parametrize("gone", [(N - 1,), (N - 2, N - 1), (0,), tuple(range(N)), (5, 6)])
def test_what_no_direction_sees_stays_lost_and_the_rest_is_found(gone):
    estimates = found_by(LosesAnArm(gone))
    assert [each.index for each in estimates if each.pose is None] == list(gone)
    assert all(np.abs(delta_between(TRUTH, each.pose)).max() < 1e-9 for each in estimates if each.pose is not None)


def test_frames_that_are_counted_backward_are_tracked_as_others():
    frames = map(nothing, range(-3, 5))
    run = track_forward_backward(LosesAnArm(), HUMAN, frames, write=lambda estimate: None)
    assert [estimate.index for _, estimate in run] == list(range(-3, 5))


@pytest.mark.parametrize("n", [0, 1, 2, 3])
def test_the_shortest_recordings_end_where_they_end(n):
    assert [each.index for each in found_by(LosesAnArm(), n)] == list(range(n))


@pytest.fixture(scope="module")
def scene():
    return Scene()


def track(scene, done=None, source=None):
    written, tracker = [], tracker_of(Settings(), CROSS, scene.start())
    frames = (scene.frames(i) for i in range(0, 2 * N, 2)) if source is None else source
    run = track_forward_backward(tracker, CROSS, frames, write=written.append, done=done)
    return [estimate for _, estimate in run], written


def bits(estimates):
    return [(each.index, each.pose.world_from_root.as_matrix().tobytes()) for each in estimates]


def test_a_thrown_cross_is_found_in_every_frame_which_is_read_once(scene, monkeypatch):
    monkeypatch.setattr(both_directions, "_MOST_BYTES", 0)
    monkeypatch.setattr(both_directions, "_FEWEST_HELD", 5)
    read: list[int] = []

    def source():
        for i in range(0, 2 * N, 2):
            read.append(i)
            yield scene.frames(i)

    estimates, written = track(scene, source=source())
    assert read == [each.index for each in estimates] == [each.index for each in written] == list(range(0, 2 * N, 2))
    assert all(errors(scene, each)[0] < 3 for each in estimates)


def test_a_run_goes_on_from_any_rows_to_the_same_result(scene):
    whole, _ = track(scene)
    for kept in (slice(0, 1), slice(0, 7), slice(3, None, 2)):
        again, written = track(scene, {each.index: each for each in whole[kept]})
        assert bits(again) == bits(whole)
        assert len(written) == len(whole) - len(whole[kept])


def test_what_one_direction_is_sure_of_the_other_takes_where_it_expects_it_and_looks_for_elsewhere(scene):
    tracker = tracker_of(Settings(), CROSS, scene.start())
    state, forward = tracker.init(), {}
    for i in range(0, 12, 2):
        state, forward[i] = step(tracker, state, scene.frames(i))
    sure = {-i: turn_estimate(each) for i, each in forward.items()}
    last = turn_time(scene.frames(10))
    assert tracker.search(tracker.turn(state, sure), last) is sure[-10]
    aside = sure[-10].pose.move(np.array([0.0, 0.0, 0.1]), np.zeros(3))
    for known in (replace(sure[-10], status=Status.UNCERTAIN), replace(sure[-10], pose=aside)):
        found = tracker.search(tracker.turn(state, sure | {-10: known}), last)
        assert errors(scene, turn_estimate(found))[0] < 3
        assert found.status is Status.TRACKED and found.pose is not known.pose


@dataclass(frozen=True)
class Learns(LosesAnArm):
    """A tracker in doubt in every frame, which keeps what it learns from."""

    learned: list[int] = field(default_factory=list)

    def search(self, state, frames):
        return replace(super().search(state, frames), status=Status.UNCERTAIN)

    def learn(self, state, frames, estimate):
        self.learned.append(frames.index)
        return state


def test_from_joined_estimates_is_learned_only_what_a_later_stretch_may_need(monkeypatch):
    monkeypatch.setattr(both_directions, "_MOST_BYTES", 0)
    monkeypatch.setattr(both_directions, "_FEWEST_HELD", 4)
    tracker = Learns()
    assert [each.index for each in found_by(tracker, 8)] == list(range(8))
    both_ways = [*range(1, 5), *range(-3, 0)], [*range(5, 8), *range(-6, -4)]  # back from the last frame, found forward
    assert tracker.learned == [0, *both_ways[0], *range(1, 5), *both_ways[1]]
