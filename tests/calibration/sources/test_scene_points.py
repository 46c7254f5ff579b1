"""Cameras from known points of the scene, flat ones too, against their true places."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.calibration.bundle import FreeParameters, adjust
from airborne.calibration.sources import scene_points
from airborne.calibration.sources.court import court_points
from airborne.calibration.sources.scene_points import initial_rig_from_points, scene_source
from tests.support import wand_waving as waving

RIG = waving.hall((1500.0, 1300.0, 1400.0, 1600.0))
FLOOR = tuple(name for name, point in court_points().items() if point.position_m[2] == 0)
SOME = (
    *("attack_near_left_inner_rear", "attack_near_right_inner_rear", "attack_far_left_middle"),
    *("attack_far_right_middle", "centre_left_outer", "net_left_top", "net_right_top", "antenna_left_top"),
)


def off_m(found):
    return np.array([np.linalg.norm(camera.centre - RIG[camera.name].centre) for camera in found])


@pytest.mark.parametrize("names", [None, FLOOR, SOME], ids=["all", "floor only", "eight"])
def test_cameras_start_near_their_places_whatever_their_focal_length(names):
    points = waving.click_court(np.random.default_rng(0), RIG, names)
    start = initial_rig_from_points(points, waving.SIZES)
    assert start.names == RIG.names
    assert off_m(start).max() < 0.6  # court lines are known to a centimetre
    assert np.abs(waving.focal_errors(RIG, start)).max() < 0.06


def test_exact_points_give_exact_cameras():
    points = waving.click_court(np.random.default_rng(1), RIG, noise_px=0.0)
    known = court_points("men")
    px = np.stack([c.px_from_world(np.array([known[n].position_m for n in points.names])) for c in RIG], axis=1)
    points = replace(points, px=np.where(np.isnan(points.px), np.nan, px), sd_m=None)
    start = initial_rig_from_points(points, waving.SIZES)
    found = adjust(start, [scene_source(start.names, points, name="court")], FreeParameters()).rig
    assert off_m(found).max() < 1e-6


def test_slopes_of_a_step_are_differences():
    step, world = np.full(7, 0.04), np.random.default_rng(5).normal((0, 0, 1), 1, (20, 3))
    slopes = scene_points.step_jacobian(scene_points.step_camera(RIG["cam1"], step), step, world)
    ends = [
        [scene_points.step_camera(RIG["cam1"], step + sign * 1e-6 * one).px_from_world(world) for sign in (1, -1)]
        for one in np.eye(7)
    ]
    differences = np.stack([(after - before).ravel() / 2e-6 for after, before in ends], axis=-1)
    np.testing.assert_allclose(slopes, differences, atol=1e-5)


def test_a_known_lens_is_kept_and_four_points_are_enough():
    points = waving.click_court(np.random.default_rng(2), RIG, SOME[:4])
    start = initial_rig_from_points(points, waving.SIZES, {camera.name: camera for camera in RIG})
    assert all(np.array_equal(start[name].K, RIG[name].K) for name in start.names)
    assert off_m(start).max() < 0.3


def test_a_camera_with_too_few_points_is_left_out():
    points = waving.click_court(np.random.default_rng(3), RIG)
    px = points.px.copy()
    px[3:, 1] = np.nan
    assert "cam2" not in initial_rig_from_points(replace(points, px=px), waving.SIZES).names


def test_a_wrong_click_does_not_spoil_the_start():
    points = waving.click_court(np.random.default_rng(4), RIG)
    px = points.px.copy()
    px[np.flatnonzero(points.is_seen_by("cam1"))[:3], 0] += [150, -80]
    start = initial_rig_from_points(replace(points, px=px), waving.SIZES)
    assert off_m(start).max() < 0.6


def test_the_nets_own_uncertainty_lets_it_sag():
    rng = np.random.default_rng(5)
    points = waving.click_court(rng, RIG, noise_px=0.2)
    known, names = court_points("men"), list(points.names)
    true = np.array([known[name].position_m for name in names])
    true[[names.index("net_left_top"), names.index("net_right_top")], 2] -= 0.015
    px = waving.observe(rng, RIG, true, noise_px=0.2)
    free = scene_source(RIG.names, replace(points, px=px), name="court")
    held = scene_source(RIG.names, replace(points, px=px, sd_m=None), name="court")
    sagging = adjust(RIG, [free], FreeParameters())
    stiff = adjust(RIG, [held], FreeParameters())
    row = next(i for i, place in enumerate(free.points) if np.allclose(place, known["net_left_top"].position_m))
    assert sagging.sources[0].points[row, 2] - free.points[row, 2] == pytest.approx(-0.015, abs=0.005)
    assert sagging.rms_px() < 0.6 * stiff.rms_px()


def test_points_that_nobody_sees_are_no_evidence():
    points = waving.click_court(np.random.default_rng(6), RIG)
    px = points.px.copy()
    px[5:] = np.nan
    source = scene_source(RIG.names, replace(points, px=px, sd_m=None), name="court")
    assert len(source.points) == 5
    assert source.is_free is None
