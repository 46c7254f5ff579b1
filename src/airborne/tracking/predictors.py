"""Where the body will be: extrapolation of past poses, in position and in rotation, over any time steps."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from scipy.spatial.transform import Rotation

from airborne.body import Pose

GRAVITY = np.array([0.0, 0.0, -9.81])  # [m/s2], world z up

Past = Sequence[tuple[Fraction, Pose]]  # oldest first; not empty


def stay(past: Past, time_s: Fraction) -> Pose:
    """Predict no motion (paper B, synthetic sequences)."""
    return past[-1][1]


def linear(past: Past, time_s: Fraction) -> Pose:
    """Extrapolate the last two poses at constant velocity and turning rate (paper B, video sequences)."""
    if len(past) < 2:
        return stay(past, time_s)
    (before, earlier), (now, last) = past[-2:]
    share = float((time_s - now) / (now - before))
    velocity, turn = _difference(earlier, last)
    return last.moved(share * velocity, share * turn)


def quadratic(past: Past, time_s: Fraction) -> Pose:
    """Extrapolate the last three poses: velocity constant, turning rate changing at a constant rate."""
    if len(past) < 3:
        return linear(past, time_s)
    (first, oldest), (before, earlier), (now, last) = past[-3:]
    ahead, step, step_before = float(time_s - now), float(now - before), float(before - first)
    velocity, turn = _difference(earlier, last)
    rate = turn / step
    change = (rate - _difference(oldest, earlier)[1] / step_before) / (0.5 * (step + step_before))
    mean_rate = rate + change * 0.5 * (ahead + step)
    return last.moved(velocity * ahead / step, mean_rate * ahead)


def ballistic(past: Past, time_s: Fraction) -> Pose:
    """Extrapolate like `quadratic`, with gravity acting on the position."""
    if len(past) < 2:
        return stay(past, time_s)
    now, before = past[-1][0], past[-2][0]
    ahead, step = float(time_s - now), float(now - before)
    return quadratic(past, time_s).moved(0.5 * GRAVITY * ahead * (ahead + step), np.zeros(3))


def _difference(earlier: Pose, later: Pose) -> tuple[np.ndarray, np.ndarray]:
    a, b = earlier.world_from_root, later.world_from_root
    turn = b.rotation * a.rotation.inv()
    return b.translation - a.translation, Rotation.as_rotvec(turn)
