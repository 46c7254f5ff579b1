"""A body is tracked from each of its keys in both directions, and a run goes on from any rows that it has."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airborne.body.chain import delta_between
from airborne.tracking import Status
from airborne.tracking.backward import turn_time
from airborne.tracking.both_directions import track_between_keys
from airborne.tracking.evidence import PoseEvidence
from airborne.tracking.methods import Settings, tracker_of
from airborne.tracking.predictors import correct_past, linear, turn_past
from airborne.tracking.tracker import track_frames
from tests.support.scenes import CROSS, Scene, errors, thrown

STEP, KEYS, LAST = 2, [8, 16], 20
FRAMES = range(0, LAST, STEP)


class Reader:
    """The frames of a scene, which counts those that were read."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    def forward(self, start, stop):
        return (self.scene.frames(i) for i in range(start, LAST if stop is None else stop, STEP))

    def backward(self, start, stop):
        return reversed(list(self.forward(start, stop)))


class Searches:
    """A tracker that notes which frames it searches."""

    def __init__(self, tracker) -> None:
        self.tracker, self.frames = tracker, []
        self.init, self.learn, self.turn, self.weigh = tracker.init, tracker.learn, tracker.turn, tracker.weigh

    def search(self, state, frames):
        self.frames.append(abs(frames.index))  # counted backward in the backward pass
        return self.tracker.search(state, frames)


def key(scene: Scene, frame: int, off_m: float = 0.02) -> PoseEvidence:
    """The true pose, set by hand a little beside the body."""
    pose = scene.motion(Fraction(frame, 50)).move(np.array([off_m, 0, 0]), np.array([0.0, 0.05, 0.0]))
    return PoseEvidence(model=CROSS, pose=pose, pose_sds=np.repeat([0.03, 0.1], 3))


@pytest.fixture(scope="module")
def scene():
    return Scene()


def track(scene, keys, done=None):
    tracker = Searches(tracker_of(Settings(), CROSS, scene.start(), keys))
    written = []
    run = track_between_keys(tracker, CROSS, Reader(scene), FRAMES, keys=list(keys), write=written.append, done=done)
    return [estimate for _, estimate in run], written, tracker.frames


@pytest.fixture(scope="module")
def whole(scene):
    return track(scene, {frame: key(scene, frame) for frame in KEYS})


def bits(estimates):
    return [
        (
            each.index,
            each.time_s,
            each.status,
            each.pose.world_from_root.as_matrix().tobytes(),
            each.covariance.tobytes(),
        )
        for each in estimates
    ]


def test_every_frame_is_found_once_and_in_order(scene, whole):
    estimates, written, searched = whole
    assert [each.index for each in estimates] == list(FRAMES) == [each.index for each in written]
    assert sorted(searched) == sorted([*FRAMES, 2, 4, 6, 10, 12, 14])  # between keys in both directions
    assert all(errors(scene, each)[0] < 3 for each in estimates)


@pytest.mark.parametrize("n", [1, 3, 5, 9])
def test_a_run_stopped_anywhere_goes_on_to_identical_bits(scene, whole, n):
    done = {each.index: each for each in whole[0][:n]}
    estimates, written, _ = track(scene, {frame: key(scene, frame) for frame in KEYS}, done)
    assert bits(estimates) == bits(whole[0])
    assert [each.index for each in written] == list(FRAMES[n:])


def test_of_a_changed_key_only_the_frames_between_its_neighbours_are_searched(scene, whole):
    done = {each.index: each for each in whole[0] if not 0 < each.index < 16}
    keys = {8: key(scene, 8, off_m=-0.02), 16: key(scene, 16)}
    estimates, written, searched = track(scene, keys, done)
    assert set(searched) == {each.index for each in written} == {2, 4, 6, 8, 10, 12, 14}
    kept = [each for each in estimates if each.index in done]
    assert bits(kept) == bits(done.values())


def test_without_keys_it_is_the_plain_loop(scene):
    tracker = tracker_of(Settings(), CROSS, scene.start())
    plain = track_frames(tracker, (scene.frames(i) for i in FRAMES[:4]), lambda estimate: None)
    both = track_between_keys(tracker, CROSS, Reader(scene), FRAMES, keys=[], write=lambda estimate: None)
    assert bits(e for _, e in plain) == bits(e for (_, e), _ in zip(both, range(4), strict=False))


def test_a_body_that_was_lost_is_found_again_at_a_key(scene):
    """From a start that is wrong by half a turn and a metre nothing is found, up to the key."""
    wrong = scene.start().move(np.array([1.0, 0.5, 0.0]), np.array([0.0, 2.0, 0.0]))
    tracker = tracker_of(Settings(), CROSS, wrong, {8: key(scene, 8)})
    run = track_frames(tracker, (scene.frames(i) for i in FRAMES), lambda estimate: None)
    found = {each.index: each for _, each in run}
    assert found[6].pose is None or errors(scene, found[6])[0] > 100
    assert all(errors(scene, found[index])[0] < 5 for index in FRAMES if index >= 8)


def test_time_turned_twice_is_as_it_was(scene):
    frames = scene.frames(2)
    late = replace(frames, views=tuple(replace(view, delay_s=0.004) for view in frames.views))
    turned = turn_time(late)
    assert (turned.index, turned.time_s, turned.views[0].delay_s) == (-2, -late.time_s, -0.004)
    again = turn_time(turned)
    assert (again.index, again.time_s) == (2, late.time_s)
    assert again.views[0].delay_s == 0.004


def test_a_turned_past_predicts_what_lay_before():
    past = tuple((Fraction(k, 50), thrown(Fraction(k, 50))) for k in (0, 1))
    before = linear(turn_past(past), Fraction(0))
    np.testing.assert_allclose(delta_between(before, past[0][1]), 0, atol=1e-9)


def test_a_corrected_past_keeps_the_motion():
    past = tuple((Fraction(k, 50), thrown(Fraction(k, 50))) for k in (0, 1))
    now = Fraction(2, 50)
    elsewhere = linear(past, now).move(np.array([0.3, 0, 0]), Rotation.identity().as_rotvec())
    corrected = correct_past(past, now, elsewhere)
    np.testing.assert_allclose(delta_between(linear(corrected, now), elsewhere), 0, atol=1e-9)


def test_the_key_frame_itself_is_tracked(whole):
    assert all(each.status is Status.TRACKED for each in whole[0] if each.index in KEYS)
