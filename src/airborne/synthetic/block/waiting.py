"""Players who do not jump: they stand ready, sway, and take a step or two."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airborne.body import BodyModel
from airborne.synthetic.block.motion import Movement, StancePhase, UpperBody, minimum_jerk, monotone_curve
from airborne.synthetic.block.plan import CENTRE_AHEAD_M, READY, KeyPosture, centre_height
from airborne.synthetic.block.posture import measure_person
from airborne.synthetic.block.steps import approach_steps, feet_midpoints, foot_path, foot_placements
from airborne.types import Array

_TOES_OUT_RAD, _TOES_PER_WIDTH, _NARROW_M = 0.2, 1.2, 0.35  # wide stances rotate the toes outward: [rad], [rad/m]
_SWAY_S, _SWAY_M = 0.45, 0.02  # between turning points; sd of the centre of mass there


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WaitPlan:
    """How a player waits; time 0 is the scene's."""

    position: Array  # (2,) x, y of the feet's midpoint after any steps [m]
    yaw: float  # about z: 0 faces -y, pi faces +y [rad]
    knee: float = 40.0  # [degrees]
    width_m: float = 0.4
    approach_m: float = 0.0  # of a shuffle along x that ends at `arrival_s`
    arrival_s: float = 0.5
    duration_s: float = 3.0
    posture: KeyPosture = READY


def wait(rng: np.random.Generator, model: BodyModel, plan: WaitPlan) -> Movement:
    """Build a player who waits, from time 0 on."""
    person = measure_person(model)
    forward = np.array([np.sin(plan.yaw), -np.cos(plan.yaw)])
    toes_out = _TOES_OUT_RAD + _TOES_PER_WIDTH * (plan.width_m - _NARROW_M)
    placements = foot_placements(plan.position, plan.yaw, plan.width_m, toes_out)
    first = placements - [plan.approach_m, 0.0, 0.0]
    steps = approach_steps("shuffle", first, placements, plan.arrival_s)
    over = plan.position + CENTRE_AHEAD_M * forward
    level = centre_height(person, plan.posture, placements, over=over, yaw=plan.yaw, knee=np.radians(plan.knee))
    knots = (
        [(t, middle + CENTRE_AHEAD_M * forward) for t, middle in feet_midpoints(first, steps)]
        if steps
        else [(0.0, over)]
    )
    times = np.arange(knots[-1][0] + _SWAY_S, max(knots[-1][0], plan.duration_s) + 3 * _SWAY_S, _SWAY_S)
    knots += [(float(t), over + rng.normal(0, _SWAY_M, 2)) for t in times]
    heights = [level - abs(rng.normal(0, _SWAY_M)) for _ in times]
    upper_body = UpperBody(
        yaw=minimum_jerk([0.0, 1.0], [plan.yaw, plan.yaw]),
        pitch=minimum_jerk([0.0, 1.0], [np.radians(plan.posture.pitch)] * 2),
        trunk=minimum_jerk([0.0, 1.0], [plan.posture.angles(person)] * 2),
        arms=minimum_jerk([0.0, 1.0], [np.zeros((len(model.segments) - 1, 3))] * 2),
    )
    stand = StancePhase(
        monotone_curve([t for t, _ in knots], [point for _, point in knots]),
        monotone_curve(list(times), heights),
        tuple(foot_path(side, first[side], steps) for side in (0, 1)),
    )
    return Movement(person, upper_body, stand)
