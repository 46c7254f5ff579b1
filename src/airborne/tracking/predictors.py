"""Where the body will be: extrapolation of past poses over any time steps.

Every predictor extrapolates the root; joints turn on at their last rate, or with `stay` not at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from airborne.body import Pose
from airborne.body.chain import motion_between, moved_pose

GRAVITY = np.array([0.0, 0.0, -9.81])  # [m/s2], world z up

_TURN = slice(3, 6)  # the root's turn in a motion

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
    return moved_pose(last, share * motion_between(earlier, last))


def quadratic(past: Past, time_s: Fraction) -> Pose:
    """Extrapolate the last three poses: velocity constant, turning rate changing at a constant rate."""
    if len(past) < 3:
        return linear(past, time_s)
    (first, oldest), (before, earlier), (now, last) = past[-3:]
    ahead, step, step_before = float(time_s - now), float(now - before), float(before - first)
    rate = motion_between(earlier, last) / step
    rate_before = motion_between(oldest, earlier) / step_before
    change = (rate - rate_before)[_TURN] / (0.5 * (step + step_before))
    rate[_TURN] += change * 0.5 * (ahead + step)
    return moved_pose(last, rate * ahead)


def ballistic(past: Past, time_s: Fraction) -> Pose:
    """Extrapolate like `quadratic`, with gravity acting on the position."""
    if len(past) < 2:
        return stay(past, time_s)
    now, before = past[-1][0], past[-2][0]
    ahead, step = float(time_s - now), float(now - before)
    return quadratic(past, time_s).moved(0.5 * GRAVITY * ahead * (ahead + step), np.zeros(3))
