import cv2
import numpy as np
import pytest
from scipy.optimize import least_squares

from airborne.geometry.triangulation import (
    px_from_points,
    triangulate,
    triangulate_linear,
)
from tests.support.cameras import scattered, three_cameras
from tests.support.tolerances import ROUNDTRIP, SOLVED

P = three_cameras().P


def noisy_px(points, sd_px, seed=1):
    px = px_from_points(P, points)
    return px + np.random.default_rng(seed).normal(0, sd_px, px.shape)


def reprojection_residual(P, points, px):
    return px - px_from_points(P, points)


@pytest.mark.parametrize("batch", [(), (1,), (3, 1, 2)])
def test_points_come_back_from_their_projections(batch):
    points = scattered(int(np.prod(batch, dtype=int))).reshape(*batch, 3)
    found = triangulate(P, px_from_points(P, points))
    assert found.shape == points.shape
    assert np.allclose(found, points, atol=ROUNDTRIP, rtol=0)


def test_every_point_may_have_its_own_cameras():
    points = scattered(5)
    own = np.stack([P * scale for scale in (1, 2, 3, 4, 5)])
    assert np.allclose(triangulate(own, px_from_points(own, points)), points, atol=ROUNDTRIP)


def test_two_of_three_views_are_enough_and_one_is_not():
    points = scattered(2)
    px = px_from_points(P, points)
    px[0, 0] = np.nan
    px[1, :2] = np.nan
    found = triangulate(P, px)
    assert np.allclose(found[0], points[0], atol=ROUNDTRIP)
    assert np.isnan(found[1]).all()
    assert np.isnan(triangulate(P[:1], px[:, 2:])).all()


def test_weights_are_inverse_variances():
    points, rng = scattered(1)[0], np.random.default_rng(2)
    sd_px = np.array([0.5, 2.0, 8.0])
    px = px_from_points(P, points) + rng.normal(0, 1, (4000, 3, 2)) * sd_px[:, None]
    alike, weighted = triangulate(P, px), triangulate(P, px, np.broadcast_to(sd_px**-2, (4000, 3)))
    assert np.sum((weighted - points) ** 2) < 0.7 * np.sum((alike - points) ** 2)
    np.testing.assert_allclose(triangulate(P, px[:9], np.full((9, 3), 7.0)), alike[:9], atol=ROUNDTRIP)


def test_best_weighted_point_is_where_the_weighted_squared_distances_are_least():
    points, weights = scattered(1)[0], np.array([1.0, 4.0, 0.2])
    px = noisy_px(points, 3.0)
    cost = lambda x: (np.sqrt(weights)[:, None] * (px - px_from_points(P, x))).ravel()  # noqa: E731
    best = least_squares(cost, points, xtol=1e-14, ftol=1e-14, gtol=1e-14).x
    np.testing.assert_allclose(triangulate(P, px, weights), best, atol=SOLVED**2)


def test_a_missing_view_does_not_count():
    px = noisy_px(scattered(4), 1.0)
    px[:, 1] = np.nan
    assert np.allclose(triangulate(P, px), triangulate(P[[0, 2]], px[:, [0, 2]]), atol=ROUNDTRIP)


def test_linear_solution_of_two_views_agrees_with_opencv():
    points = scattered(10)
    px = px_from_points(P[:2], points)
    oracle = cv2.triangulatePoints(P[0], P[1], px[:, 0].T, px[:, 1].T)
    assert np.allclose(triangulate_linear(P[:2], px), (oracle[:3] / oracle[3]).T, atol=ROUNDTRIP)


def test_no_other_point_reprojects_better():
    px = noisy_px(scattered(5), 3.0)
    found = triangulate(P, px)
    for point, seen in zip(found, px, strict=True):
        oracle = least_squares(lambda x, seen=seen: reprojection_residual(P, x, seen).ravel(), point + 0.01)
        assert np.allclose(point, oracle.x, atol=SOLVED)
    linear = np.sum(reprojection_residual(P, triangulate_linear(P, px), px) ** 2, axis=(-2, -1))
    assert np.all(np.sum(reprojection_residual(P, found, px) ** 2, axis=(-2, -1)) < linear)


def test_parallel_rays_give_no_point():
    px = px_from_points(P[:1], scattered(3))
    assert np.isnan(triangulate(np.concatenate([P[:1], P[:1]]), np.concatenate([px, px], axis=1))).all()


def test_a_point_behind_a_camera_that_sees_it_is_no_point():
    rays_apart = np.array([[-10_000.0, 287.0], [10_000.0, 287.0]])  # left looks out to the left, right to the right
    assert np.isfinite(triangulate_linear(P[:2], rays_apart)).all()
    assert np.isnan(triangulate(P[:2], rays_apart)).all()


def test_points_behind_the_camera_are_not_projected():
    assert np.isnan(px_from_points(P[:1], np.array([-8.0, -10.0, 1.5]))).all()
