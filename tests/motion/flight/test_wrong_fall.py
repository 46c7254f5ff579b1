"""A flight whose gravity is not 9.81 m/s²: lengths or the frame rate are wrong, and it is said."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airborne.constants import GRAVITY_M_S2
from airborne.motion.flight.fall import find_wrong_fall

SD_M = 0.004  # of each place of the centre of mass


def flight(duration_s, *, scale=1.0, rate=60.0, stands_s=0.0, seed=0):
    """A body that stands, then flies and turns: times, its centre of mass, its rotation, variances of its heights."""
    t = np.arange(0, stands_s + duration_s, 1 / rate)
    flown = np.maximum(t - stands_s, 0)
    path = np.array([1.0, 0, 0]) * flown[:, None] + [0, 0, 1.0]
    path[:, 2] += GRAVITY_M_S2 / 2 * flown * (duration_s - flown)
    noise = SD_M * np.random.default_rng(seed).standard_normal(path.shape)
    return (
        t,
        scale * path + noise,
        Rotation.from_rotvec(flown[:, None] * [5.0, 0, 1]).as_matrix(),
        np.full(len(t), SD_M**2),
    )


@pytest.mark.parametrize("duration_s", [0.5, 0.9, 1.3])
@pytest.mark.parametrize("stands_s", [0.0, 0.6])
def test_a_fall_in_the_right_world_says_nothing(duration_s, stands_s):
    for seed in range(20):
        assert find_wrong_fall(*flight(duration_s, stands_s=stands_s, seed=seed)) is None


@pytest.mark.parametrize(
    ("scale", "lengths", "rate"),
    [
        (1.15, "too large, by 15 % or more", "too high, by 7 % or more"),
        (0.9, "too small, by 10 % or", "too low, by 5 %"),
    ],
)
@pytest.mark.parametrize("stands_s", [0.0, 0.6])
def test_a_world_of_wrong_size_is_said(scale, lengths, rate, stands_s):
    found = find_wrong_fall(*flight(1.2, scale=scale, stands_s=stands_s))
    assert found is not None and lengths in found.sentence and rate in found.sentence
    finding = found.to_dict()
    assert abs(finding["value"] - (scale - 1) * GRAVITY_M_S2) < 3 * finding["sd"] < 1


def test_who_stands_or_jumps_for_too_short_says_nothing():
    t, path, R, variance = flight(0.3, scale=1.3, stands_s=0.5)
    assert find_wrong_fall(t, path, R, variance) is None
    still = np.tile([0.0, 0, 1], (60, 1))
    assert find_wrong_fall(np.arange(60) / 60, still, np.tile(np.eye(3), (60, 1, 1)), np.full(60, SD_M**2)) is None
