"""Epipolar geometry of two cameras against their true places."""

import numpy as np
import pytest

from airborne.calibration.initial.two_views import fit_epipolar_geometry, relative_pose
from airborne.cameras import camera_looking_at
from tests.support.tolerances import SOLVED

A = camera_looking_at("a", (-4, -6, 2), (0, 0, 1), focal_px=1200, size=(1280, 720))
B = camera_looking_at("b", (5, -5, 3), (0.2, 0, 1.2), focal_px=900, size=(1280, 720))


def pair(rng, n=100):
    points = rng.uniform((-2, -2, 0), (2, 2, 2.5), (n, 3))
    return points, A.px_from_world(points), B.px_from_world(points)


def test_the_place_of_the_second_camera_is_found_but_for_the_scale():
    points, px_a, px_b = pair(np.random.default_rng(0))
    found = fit_epipolar_geometry(px_a, px_b, limit_px=1.0)
    place = relative_pose(found.F, A.K, B.K, px_a=px_a, px_b=px_b)
    b_from_a = B.camera_from_world * A.camera_from_world.inv()
    length = np.linalg.norm(b_from_a.translation)
    assert found.is_inlier.all()
    assert place.front_share == 1.0
    assert np.abs(place.R - b_from_a.rotation.as_matrix()).max() < SOLVED
    assert np.abs(place.t * length - b_from_a.translation).max() < SOLVED * length
    assert np.abs(place.points * length - A.camera_from_world.apply(points)).max() < 10 * SOLVED


def test_the_parallax_is_the_angle_between_the_rays():
    points, px_a, px_b = pair(np.random.default_rng(1))
    place = relative_pose(fit_epipolar_geometry(px_a, px_b, limit_px=1.0).F, A.K, B.K, px_a=px_a, px_b=px_b)
    rays = [camera.centre - points for camera in (A, B)]
    cosine = np.sum(rays[0] * rays[1], axis=1) / np.prod([np.linalg.norm(ray, axis=1) for ray in rays], axis=0)
    assert place.parallax_rad == pytest.approx(np.median(np.arccos(cosine)), abs=1e-4)


def test_outliers_are_told_from_what_agrees():
    rng = np.random.default_rng(2)
    _, px_a, px_b = pair(rng, 200)
    is_stray = rng.random(200) < 0.3
    px_b[is_stray] = rng.uniform((0, 0), (1280, 720), (is_stray.sum(), 2))
    found = fit_epipolar_geometry(px_a, px_b, limit_px=2.0)
    assert found.is_inlier[~is_stray].all()
    assert found.is_inlier[is_stray].mean() < 0.1


def test_too_few_points_give_nothing():
    _, px_a, px_b = pair(np.random.default_rng(3), 7)
    assert fit_epipolar_geometry(px_a, px_b, limit_px=1.0) is None
