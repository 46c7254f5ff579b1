"""A first pose set roughly by hand is mended."""

import numpy as np
import pytest

from airborne.tracking.model_based.refined import RefinedTracker
from tests.support.scenes import CROSS, TURNS, Scene, camera, clutter, errors, track


def grey(light):
    """The same light with hardly any colour, as a hall has."""
    return light.mean(axis=-1, keepdims=True) * np.array([1.1, 1.0, 0.9])


HALL = Scene(
    cameras=tuple(camera(f"cam{i}", turn, focal_px=720) for i, turn in enumerate(TURNS)),
    backgrounds=tuple(grey(clutter(seed)) for seed in range(4)),
)


def away(mm, degrees, seed):
    """The true first pose, moved so far and turned so far."""
    rng = np.random.default_rng(seed)
    shift, turn = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    return HALL.start().move(mm / 1000 * shift, np.radians(degrees) * turn)


@pytest.mark.parametrize("seed", range(6))
def test_start_that_is_off_by_fifty_millimetres_and_five_degrees_is_mended(seed):
    (estimate,) = track(HALL, range(1), RefinedTracker(CROSS, away(50, 5, seed)))
    assert estimate.status == "tracked"
    position_mm, rotation_deg = errors(HALL, estimate)
    assert position_mm < 3
    assert rotation_deg < 1


def test_start_that_is_far_off_is_not_tracked():
    (estimate,) = track(HALL, range(1), RefinedTracker(CROSS, away(400, 40, 0)))
    assert estimate.status != "tracked"
