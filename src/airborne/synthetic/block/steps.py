"""Footwork along the net: shuffle and crossover steps, and feet at rest."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from scipy.interpolate import PPoly

from airborne.synthetic.block.motion import FootPath, Knot, minimum_jerk, quintic
from airborne.types import Array

Approach = Literal["static", "shuffle", "crossover"]

STEP_S = 0.2  # a foot's time off the floor
_LIFT_M = 0.07  # of a foot in a step
_HEEL_RISE_S, _HEEL_RISE_RAD = 0.1, np.radians(22.0)  # the heel rises before a step
_LONG_S = 100.0  # beyond any recording
_LONGEST_SHUFFLE_M = 0.38  # of one pair of steps
_TURN_RAD = np.radians(45.0)  # yaw of body and feet during a crossover
_CROSS_M = 0.12  # by which the crossing foot passes in front of the other
_STEP_OVERLAP = 0.9  # the second foot leaves after this share of the first one's step


class Step(NamedTuple):
    """One foot's step: it lands after STEP_S."""

    side: int  # 0 left, 1 right
    start_s: float
    placement: Array  # (3,) x, y [m] and yaw [rad] at landing
    body_yaw: float = 0.0  # of the body, relative to facing the net [rad]


def foot_placements(middle: Array, yaw: float, width_m: float, toes_out_rad: float = 0.12) -> Array:
    """Return the placements (2, 3) of feet, left first, side by side about `middle` (2,) [m]."""
    left = np.array([np.cos(yaw), np.sin(yaw)])
    placements = [np.append(middle + sign * width_m / 2 * left, yaw + sign * toes_out_rad) for sign in (1, -1)]
    return np.array(placements)


def approach_steps(approach: Approach, first: Array, last: Array, end_s: float) -> list[Step]:
    """Return the steps from placements `first` (2, 3) to `last` (2, 3), done at `end_s` [s].

    A shuffle draws the second foot after the first; a crossover turns into the direction of travel, passes one foot in
    front of the other and turns back.
    """
    travel = last[:, :2].mean(axis=0) - first[:, :2].mean(axis=0)
    length = float(np.linalg.norm(travel))
    if approach == "static" or length < 1e-9:
        return []
    lead = int(np.argmax((first[:, :2] - first[:, :2].mean(axis=0)) @ travel))
    if approach == "shuffle":
        return _shuffle(first, last, lead, end_s=end_s, pairs=max(1, int(np.ceil(length / _LONGEST_SHUFFLE_M))))
    return _crossover(first, last, lead, end_s)


def _shuffle(first: Array, last: Array, lead: int, *, end_s: float, pairs: int) -> list[Step]:
    pause = _STEP_OVERLAP * STEP_S
    start = end_s - ((2 * pairs - 1) * pause + STEP_S)
    steps = []
    for k in range(2 * pairs):
        side = lead if k % 2 == 0 else 1 - lead
        share = (k // 2 + 1) / pairs
        steps.append(Step(side, start + k * pause, first[side] + share * (last[side] - first[side])))
    return steps


def _crossover(first: Array, last: Array, lead: int, end_s: float) -> list[Step]:
    pause = _STEP_OVERLAP * STEP_S
    start = end_s - (3 * pause + STEP_S)
    trail = 1 - lead
    yaw = _TURN_RAD if lead == 0 else -_TURN_RAD
    front = np.array([np.sin(first[:, 2].mean()), -np.cos(first[:, 2].mean())]) * _CROSS_M
    open_step = first[lead] + 0.35 * (last[lead] - first[lead])
    cross_step = first[trail] + 0.75 * (last[trail] - first[trail])
    return [
        Step(lead, start, open_step + np.array([0, 0, yaw]), yaw),
        Step(trail, start + pause, cross_step + np.append(front, yaw), yaw),
        Step(lead, start + 2 * pause, last[lead]),
        Step(trail, start + 3 * pause, last[trail]),
    ]


def foot_path(side: int, first: Array, steps: list[Step], pitch: Sequence[Knot] = ()) -> FootPath:
    """Return one foot's path from its placement (3,) over its steps; heels rise to step off, then follow `pitch`."""
    times, placements, lifts, heels = [-_LONG_S], [first], [(-_LONG_S, 0.0)], [(-_LONG_S, 0.0)]
    for step in (each for each in steps if each.side == side):
        start, end = step.start_s, step.start_s + STEP_S
        times += [start, end]
        placements += [placements[-1], step.placement]
        lifts += [(start, 0.0), ((start + end) / 2, _LIFT_M), (end, 0.0)]
        heels += [
            (start - _HEEL_RISE_S, 0.0),
            (start + _HEEL_RISE_S / 2, _HEEL_RISE_RAD),
            (end - _HEEL_RISE_S / 4, 0.0),
        ]
    still = [(_LONG_S, placements[-1])] if len(times) == 1 else []
    pitched = [*((t, angle, 0.0, 0.0) for t, angle in heels), *(pitch or [(_LONG_S, 0.0, 0.0, 0.0)])]
    return FootPath(
        minimum_jerk([*times, *(t for t, _ in still)], [*placements, *(placement for _, placement in still)]),
        minimum_jerk(*zip(*lifts, (_LONG_S, 0.0), strict=True)),
        quintic(pitched),
    )


def feet_midpoints(first: Array, steps: list[Step]) -> list[tuple[float, Array]]:
    """Return the midpoint of the feet (2,) [m] before the first step and as each step lands."""
    placements = np.array(first)
    midpoints = [(steps[0].start_s if steps else -_LONG_S, placements[:, :2].mean(axis=0))]
    for step in steps:
        placements[step.side] = step.placement
        midpoints.append((step.start_s + STEP_S, placements[:, :2].mean(axis=0)))
    return midpoints


def body_yaw(yaw: float, steps: list[Step]) -> PPoly:
    """Return the body's yaw [rad] over the steps; `yaw` faces the net."""
    if not steps:
        return minimum_jerk([0.0, 1.0], [yaw, yaw])
    times = [steps[0].start_s, *(step.start_s + STEP_S for step in steps)]
    return minimum_jerk(times, [yaw, *(yaw + step.body_yaw for step in steps)])
