"""Players who do not jump: they stand ready, sway, and take a step or two."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel
from airborne.synthetic.block.motion import Course, Manner, Stand, flowing, resting
from airborne.synthetic.block.plan import AHEAD_M, READY, Hold, height_where
from airborne.synthetic.block.posture import person_of
from airborne.synthetic.block.steps import approach_steps, foot_of, middles, stance

Array = NDArray[np.floating]

_TOES_OUT_RAD, _TOES_PER_WIDTH, _NARROW_M = 0.2, 1.2, 0.35  # wide stances turn the toes out: [rad], [rad/m]
_SWAY_S, _SWAY_M = 0.45, 0.02  # between turning points; sd of the centre of mass there


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WaitPlan:
    """How a player waits; time 0 is the scene's."""

    place: Array  # (2,) x, y of the feet's middle after any steps [m]
    yaw: float  # turn about z: 0 faces -y, pi faces +y [rad]
    knee: float = 40.0  # [degrees]
    width_m: float = 0.4
    way_m: float = 0.0  # of a shuffle along x that ends at `arrival_s`
    arrival_s: float = 0.5
    lasts_s: float = 3.0
    hold: Hold = READY


def wait(rng: np.random.Generator, model: BodyModel, plan: WaitPlan) -> Course:
    """Build a player who waits, from time 0 on."""
    person = person_of(model)
    forward = np.array([np.sin(plan.yaw), -np.cos(plan.yaw)])
    toes_out = _TOES_OUT_RAD + _TOES_PER_WIDTH * (plan.width_m - _NARROW_M)
    places = stance(plan.place, plan.yaw, plan.width_m, toes_out)
    first = places - [plan.way_m, 0.0, 0.0]
    steps = approach_steps("shuffle", first, places, plan.arrival_s)
    over = plan.place + AHEAD_M * forward
    level = height_where(person, plan.hold, places, over=over, yaw=plan.yaw, knee=np.radians(plan.knee))
    knots = [(t, middle + AHEAD_M * forward) for t, middle in middles(first, steps)] if steps else [(0.0, over)]
    times = np.arange(knots[-1][0] + _SWAY_S, max(knots[-1][0], plan.lasts_s) + 3 * _SWAY_S, _SWAY_S)
    knots += [(float(t), over + rng.normal(0, _SWAY_M, 2)) for t in times]
    heights = [level - abs(rng.normal(0, _SWAY_M)) for _ in times]
    manner = Manner(
        yaw=resting([0.0, 1.0], [plan.yaw, plan.yaw]),
        pitch=resting([0.0, 1.0], [np.radians(plan.hold.pitch)] * 2),
        trunk=resting([0.0, 1.0], [plan.hold.angles(person)] * 2),
        arms=resting([0.0, 1.0], [np.zeros((len(model.segments) - 1, 3))] * 2),
    )
    stand = Stand(
        flowing([t for t, _ in knots], [place for _, place in knots]),
        flowing(list(times), heights),
        tuple(foot_of(side, first[side], steps) for side in (0, 1)),
    )
    return Course(person, manner, stand)
