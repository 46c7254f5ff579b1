"""A camera is moved, or calibrated wrongly: it is found, and left out until it agrees with the others again."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.tracking import Status
from airborne.tracking.capsules import Blocker
from airborne.tracking.capsules.fit import evidence_of, pixel_weight
from airborne.tracking.capsules.kernel_arguments import NOBODY
from airborne.tracking.capsules.registration import _disagreement, _evidence_by_shift, _leave_each_out
from airborne.tracking.capsules.surface_colours import learn_unoccluded
from airborne.tracking.capsules.track import CameraShift
from airborne.tracking.capsules.views import map_evidence, map_scale, player_regions
from tests.support.jumping_scenes import SIDE_BY_SIDE, Hall, errors_mm, hop, share_within
from tests.support.tolerances import ROUNDTRIP

N = 16
ALONE, PAIR = Hall({"anna": hop()}), Hall({"anna": hop(), "ben": hop(SIDE_BY_SIDE, late_s=0.1)})


def moved(view, right_px, down_px=0.0):
    """The image of a camera that shows everything so far to the right and down of where its calibration says."""
    return replace(view, camera=view.camera.resample(scale=(1, 1), offset=(right_px, down_px), size=view.camera.size))


def followed(hall, shifts, n=N):
    """Registrations and estimates of a run whose cameras are shifted by shifts(index) -> {camera: pixels}."""
    tracker = Blocker(hall.starts())
    state, registrations, estimates = tracker.init(), [], []
    for index in range(n):
        frames, by = hall.frames(index), shifts(index)
        views = tuple(moved(each, *by[i]) if i in by else each for i, each in enumerate(frames.views))
        state, found = tracker.step(state, replace(frames, views=views))
        registrations.append(state.registration)
        estimates.append(found)
    return registrations, list(zip(*estimates, strict=True))


@pytest.mark.parametrize("camera", [0, 1, 2])
def test_it_is_left_out_and_the_others_track_on(camera):
    registrations, players = followed(PAIR, lambda index: {camera: (14, -5)})
    assert {each.left_out for each in registrations} == {camera}
    np.testing.assert_allclose(registrations[-1].shift.right_down_px, (14, -5), atol=3)
    for estimates in players:
        assert np.median(errors_mm(PAIR, estimates)) < 30
        assert np.mean([each.status is Status.TRACKED for each in estimates]) > 0.6


def test_it_is_found_when_it_moves_and_taken_back_when_it_returns():
    registrations, _ = followed(PAIR, lambda index: {2: (14, 0)} if 8 <= index < 20 else {}, n=36)
    left_out = [each.left_out for each in registrations]
    assert set(left_out[:8]) == {None} and left_out[15:20] == [2] * 5
    assert left_out[-1] is None


def test_cameras_that_agree_are_not_accused():
    registrations, _ = followed(PAIR, lambda index: {0: (0.5, -0.5), 1: (-0.5, 0.5)})
    assert {each.shift for each in registrations} == {None}


def test_where_it_is_open_which_one_it_is_no_joint_is_tracked_and_intervals_hold():
    registrations, [estimates] = followed(ALONE, lambda index: {1: (7, 0)}, n=20)  # the one between the others
    assert all(each.is_open and 1 in each.suspects for each in registrations)
    assert all(Status.TRACKED not in each.joint_status for each in estimates)
    assert share_within(ALONE, estimates) > 0.9


def test_of_a_camera_that_may_not_show_the_players_they_may_be_as_far_off_as_is_sought():
    state, frames = Blocker(ALONE.starts()).init(), ALONE.frames(0)
    state, _ = Blocker(ALONE.starts()).step(state, frames)
    track = state.players["anna"]
    fits = _leave_each_out(track, [track], frames, None).left_out
    unseen, seen = (_disagreement(track, fits, CameraShift(1, shift, 2)) for shift in (None, (0.0, 0.0)))
    np.testing.assert_allclose(unseen - seen, np.tile(0.25 * np.eye(3), (len(unseen), 1, 1)), atol=ROUNDTRIP)


def test_of_two_cameras_none_is_accused():
    pair = replace(PAIR, is_without=lambda index, number: number == 1)
    registrations, _ = followed(pair, lambda index: {0: (14, 0)}, n=6)
    assert {each.looked_s for each in registrations} == {None}


@pytest.mark.parametrize("shift", [(0, 0), (9, -4)])
def test_evidence_by_shift_is_that_of_the_shifted_image(shift):
    state, frames = ALONE.motions["anna"](0.0), ALONE.frames(0)
    regions = player_regions(frames, state[:3])
    colours = learn_unoccluded(state, regions, len(regions), NOBODY)
    maps = map_evidence(regions[:1], [colours.table(0)], map_scale(regions, state[:3]))
    by_shift = pixel_weight(maps) * _evidence_by_shift(state, maps, NOBODY, 12)
    shifted = maps.cameras.copy()
    shifted[0, :2] += np.outer(shift, shifted[0, 2])
    at = by_shift[12 + shift[1], 12 + shift[0]]
    np.testing.assert_allclose(at, evidence_of(state, replace(maps, cameras=shifted), NOBODY), rtol=0.04)
