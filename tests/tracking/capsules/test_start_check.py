"""Starts of players that the first images contradict are told from right ones, and from those set a little off."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.tracking.capsules.start_check import MOST_MISS_M, start_misses_m

SCALE_20, RAISED = np.array([1, 1, 1.2]), np.array([0, 0, 0.15])
ONE, NOWHERE = np.ones(3), np.zeros(3)


@pytest.mark.parametrize(
    ("scale", "shift_m", "is_right"),
    [(ONE, NOWHERE, True), (SCALE_20, NOWHERE, False), (ONE, RAISED, False), (ONE, np.array([0.2, 0, 0]), False)],
    ids=["right", "legs 20 % too long", "15 cm too high", "20 cm beside"],
)
def test_a_wrong_start_is_told_from_a_right_one(hall, scale, shift_m, is_right):
    starts = [
        replace(start, joints_m={name: scale * point + shift_m for name, point in start.joints_m.items()})
        for start in hall.starts(0.02)
    ]
    [miss_m] = start_misses_m(starts, hall.frames(0))
    assert (miss_m < MOST_MISS_M) == is_right
