"""The epipolar curve goes through the picture of every point that may have been clicked; its band says how nearly."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.cameras import camera_looking_at
from airborne.cameras.epipolar import epipolar_curve

SIZE = (1280, 720)
LENSES = {"pinhole": (0, 0, 0, 0, 0), "bent": (-0.25, 0.08, 0.001, -0.001, 0)}


@pytest.fixture(params=LENSES)
def pair(request):
    cameras = [
        camera_looking_at("a", [4, -3, 1.6], [0, 0, 1.2], focal_px=1100, size=SIZE),
        camera_looking_at("b", [-4, -3, 1.2], [0, 0, 1.2], focal_px=1000, size=SIZE),
    ]
    return [replace(each, distortion=np.array(LENSES[request.param], float)) for each in cameras]


def distance_px(curve, px):
    """How far a point lies from a polyline [px]."""
    a, b = curve[:-1], curve[1:]
    along = np.clip(np.sum((px - a) * (b - a), axis=1) / np.sum((b - a) ** 2, axis=1), 0, 1)
    return float(np.min(np.linalg.norm(a + along[:, None] * (b - a) - px, axis=1)))


def test_the_curve_goes_through_the_point(pair):
    a, b = pair
    for point in np.random.default_rng(1).uniform([-1, -1, 0.4], [1, 1, 2], (30, 3)):
        curve, sd = epipolar_curve(a, a.px_from_world(point), b)
        assert distance_px(curve, b.px_from_world(point)) < 0.1
        assert len(sd) == len(curve)


def test_the_band_holds_clicks_as_often_as_its_deviation_says(pair):
    a, b = pair
    point, rng = np.array([0.2, -0.1, 1.3]), np.random.default_rng(2)
    true_px, n = a.px_from_world(point), 2000
    curve, sd = epipolar_curve(a, true_px, b, sd_px=1.5)
    near = np.argmin(np.linalg.norm(curve - b.px_from_world(point), axis=1))
    distances = []
    for click in true_px + 1.5 * rng.standard_normal((n // 20, 2)):
        distances.append(distance_px(epipolar_curve(a, click, b)[0], b.px_from_world(point)))
    assert np.sqrt(np.mean(np.square(distances))) == pytest.approx(sd[near], rel=3 / np.sqrt(2 * n / 20))


def test_a_ray_that_passes_the_picture_by_gives_nothing(pair):
    a, _ = pair
    away = camera_looking_at("away", [-4, -3, 1.2], [-8, -6, 1.2], focal_px=1000, size=SIZE)
    curve, sd = epipolar_curve(a, a.px_from_world(np.array([3.0, -2.4, 1.6])), away)
    assert len(curve) == len(sd) == 0
