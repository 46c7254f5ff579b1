"""Points are where most cameras see them; a detection of something else is left out."""

import numpy as np
import pytest

from airborne.cameras.consensus import OUTLIER_SHARE, triangulate_consensus
from tests.support.people_seen import four_cameras, walking
from tests.support.tolerances import ROUNDTRIP

RIG = four_cameras()
LIMIT_PX = OUTLIER_SHARE * 768
POINTS = walking(frames=3)
PX = np.stack([camera.px_from_world(POINTS) for camera in RIG], axis=-2)
ALIKE = np.ones(PX.shape[:-1])


def test_exact_detections_give_the_points_with_every_camera():
    agreed = triangulate_consensus(RIG, PX, ALIKE)
    np.testing.assert_allclose(agreed.points, POINTS, atol=ROUNDTRIP)
    assert agreed.is_used.all()
    assert agreed.distance_px.max() < 1e-6


@pytest.mark.parametrize("camera", range(4))
def test_one_wild_detection_is_left_out_and_its_distance_returned(camera):
    px = PX.copy()
    px[1, 5, camera] += [3 * LIMIT_PX, 4 * LIMIT_PX]
    agreed = triangulate_consensus(RIG, px, ALIKE)
    np.testing.assert_allclose(agreed.points, POINTS, atol=ROUNDTRIP)
    assert np.argwhere(~agreed.is_used).tolist() == [[1, 5, camera]]
    assert agreed.distance_px[1, 5, camera] == pytest.approx(5 * LIMIT_PX, abs=1e-6)


def test_two_wild_detections_of_four_are_left_out():
    px = PX.copy()
    px[0, 0, 0] += [100, 0]
    px[0, 0, 3] += [0, -150]
    agreed = triangulate_consensus(RIG, px, ALIKE)
    np.testing.assert_allclose(agreed.points[0, 0], POINTS[0, 0], atol=ROUNDTRIP)
    assert agreed.is_used[0, 0].tolist() == [False, True, True, False]


def test_errors_within_the_limit_leave_every_camera_in():
    px = PX + np.random.default_rng(0).uniform(-0.3, 0.3, PX.shape) * LIMIT_PX
    assert triangulate_consensus(RIG, px, ALIKE).is_used.all()


def test_two_cameras_that_disagree_give_no_point():
    px = PX.copy()
    px[..., 2:, :] = np.nan
    px[0, 0, 0] += [0, 80]
    agreed = triangulate_consensus(RIG, px, ALIKE)
    assert np.isnan(agreed.points[0, 0]).all()
    assert not agreed.is_used[0, 0].any()
    np.testing.assert_allclose(agreed.points[1:], POINTS[1:], atol=ROUNDTRIP)


def test_one_camera_gives_no_point_and_no_weight_is_not_seen():
    px, weights = PX.copy(), ALIKE.copy()
    px[0, 0, 1:] = np.nan
    weights[0, 1, 1:] = 0
    agreed = triangulate_consensus(RIG, px, weights)
    assert np.isnan(agreed.points[0, :2]).all()
    assert np.isfinite(agreed.points[0, 2:]).all()


def test_a_heavier_camera_is_met_more_closely():
    px = PX.copy()
    px[..., 0, :] += [2.0, 1.0]
    weights = ALIKE.copy()
    weights[..., 0] = 50
    heavy, alike = triangulate_consensus(RIG, px, weights), triangulate_consensus(RIG, px, ALIKE)
    assert (heavy.distance_px[..., 0] < alike.distance_px[..., 0]).all()
