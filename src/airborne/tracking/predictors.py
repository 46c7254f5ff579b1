"""Motion models: extrapolation of past poses over any time steps.

Every predictor extrapolates the root; joints go on rotating at their last rate, or with `constant` not at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from airborne.body import Pose
from airborne.body.chain import delta_between, move_pose
from airborne.constants import FREE_FALL_M_S2

_ROTATION = slice(3, 6)  # the root's rotation vector in a delta

PoseHistory = Sequence[tuple[Fraction, Pose]]  # oldest first; not empty


def constant(past: PoseHistory, time_s: Fraction) -> Pose:
    """Predict no motion (paper B, synthetic sequences)."""
    return past[-1][1]


def linear(past: PoseHistory, time_s: Fraction) -> Pose:
    """Extrapolate the last two poses at constant velocity and angular velocity (paper B, video sequences)."""
    if len(past) < 2:
        return constant(past, time_s)
    (before, earlier), (now, last) = past[-2:]
    share = float((time_s - now) / (now - before))
    return move_pose(last, share * delta_between(earlier, last))


def quadratic(past: PoseHistory, time_s: Fraction) -> Pose:
    """Extrapolate the last three poses: constant velocity, constant angular acceleration."""
    if len(past) < 3:
        return linear(past, time_s)
    (first, oldest), (before, earlier), (now, last) = past[-3:]
    ahead, step, step_before = float(time_s - now), float(now - before), float(before - first)
    rate = delta_between(earlier, last) / step
    rate_before = delta_between(oldest, earlier) / step_before
    change = (rate - rate_before)[_ROTATION] / (0.5 * (step + step_before))
    rate[_ROTATION] += change * 0.5 * (ahead + step)
    return move_pose(last, rate * ahead)


def ballistic(past: PoseHistory, time_s: Fraction) -> Pose:
    """Extrapolate like `quadratic`, with gravity acting on the position."""
    if len(past) < 2:
        return constant(past, time_s)
    now, before = past[-1][0], past[-2][0]
    ahead, step = float(time_s - now), float(now - before)
    return quadratic(past, time_s).move(0.5 * FREE_FALL_M_S2 * ahead * (ahead + step), np.zeros(3))


def correct_past(past: PoseHistory, time_s: Fraction, pose: Pose) -> PoseHistory:
    """Move past poses along with the last prediction to where the body turns out to be: what is kept is the motion."""
    predicted = linear(past, time_s)
    return tuple((then, move_pose(pose, delta_between(predicted, earlier))) for then, earlier in past)


def turn_past(past: PoseHistory) -> PoseHistory:
    """Return the past of a body that is tracked back in time from the last pose, with times counted backward.

    What lies before in that direction is the future: the motion goes on as it came.
    """
    now, pose = past[-1]
    ahead = ((then - 2 * now, move_pose(pose, -delta_between(pose, earlier))) for then, earlier in past[:-1])
    return (*ahead, (-now, pose))
