"""Block and attack jumps: from a plan to a movement of stance, take-off, flight and landing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.interpolate import PPoly

from airborne.body import BodyModel
from airborne.constants import FREE_FALL_M_S2, GRAVITY_M_S2
from airborne.synthetic.block.motion import (
    FlightPhase,
    Movement,
    StancePhase,
    UpperBody,
    leg_derivatives,
    monotone_curve,
    quintic,
)
from airborne.synthetic.block.plan import (
    CENTRE_AHEAD_LOW_M,
    CENTRE_AHEAD_M,
    CENTRE_AHEAD_TAKEOFF_M,
    TAKEOFF_PITCH,
    TOUCH_PITCH,
    JumpPlan,
    centre_heights,
)
from airborne.synthetic.block.posture import Person, measure_person
from airborne.synthetic.block.steps import Step, approach_steps, body_yaw, feet_midpoints, foot_path, foot_placements
from airborne.types import Array

_BOTTOM_ACCELERATIONS_M_S2 = np.arange(4.0, 22.0, 3.0)  # upward, of the centre of mass at its lowest point
_HEELS_LEFT = (-0.09, np.radians(13.0), 2.5, 30.0)  # heels on their way up [s, rad, rad/s, rad/s^2]
_HEELS_DOWN_S = 0.1  # after touch-down
_FOLLOW_S, _PREPARE_S = 0.045, 0.04  # legs come to rest after take-off, and prepare for touch-down
_POINTED_RAD = np.radians(47.0)  # feet go no further
_REACHED_S, _FOLDING_S, _FOLDED_S = 0.14, 0.24, 0.1  # arms reach up after take-off, come down before touch-down
_PLANTED = 0.4  # share of the crouch when the last step of the approach lands
_RECOVERY_S = 0.5  # from the lowest point after landing to standing


class KeyTimes(NamedTuple):
    """The key times of a jump, take-off at 0 [s]."""

    crouch: float  # the crouch begins
    bottom: float
    touch: float
    low: float  # lowest after landing
    end: float


def build_jump(model: BodyModel, plan: JumpPlan) -> Movement:
    """Build a jump of a `human18`; its poses hold NaN where the legs cannot reach as planned.

    The durations of push-off and landing minimise the peak acceleration of the centre of mass.
    """
    person = measure_person(model)
    levels = centre_heights(person, plan)
    velocity = np.append(plan.drift_m_s, np.sqrt(2 * GRAVITY_M_S2 * plan.rise_m))
    touch_m_s = np.sqrt(velocity[2] ** 2 + 2 * GRAVITY_M_S2 * (levels.takeoff - levels.touch))
    duration = float((velocity[2] + touch_m_s) / GRAVITY_M_S2)
    landing = velocity + FREE_FALL_M_S2 * duration
    push_s, pushing = _least_peak_acceleration(levels.takeoff - levels.bottom, velocity[2])
    yield_s, yielding = _least_peak_acceleration(levels.touch - levels.low, -landing[2])
    low_s = duration + yield_s
    crouch_s = -push_s - plan.crouch_s

    feet = foot_placements(plan.position, plan.yaw, plan.width_m)
    first = feet - [plan.approach_m, 0.0, 0.0]
    steps = approach_steps(plan.approach, first, feet, crouch_s + _PLANTED * plan.crouch_s)
    times = KeyTimes(crouch_s, -push_s, duration, low_s, low_s + _RECOVERY_S)

    takeoff = np.append(plan.position + CENTRE_AHEAD_TAKEOFF_M * plan.forward, levels.takeoff)
    touch = takeoff + velocity * duration + FREE_FALL_M_S2 * duration**2 / 2
    landed = touch[:2] - plan.touch_offset_m
    heels_up = [(-push_s, 0.0, 0.0, 0.0), _HEELS_LEFT, (0.0, *TAKEOFF_PITCH)]
    heels_down = [(duration, *TOUCH_PITCH), (duration + _HEELS_DOWN_S, 0.0, 0.0, 0.0)]
    upper_body = _upper_body(person, plan, times, steps)
    before = StancePhase(
        _path_to_takeoff(plan, times, feet_midpoints(first, steps), takeoff[:2]),
        quintic(
            [
                (times.crouch, levels.ready, 0.0, 0.0),
                (times.bottom, levels.bottom, 0.0, pushing),
                (0.0, levels.takeoff, velocity[2], -GRAVITY_M_S2),
            ]
        ),
        tuple(foot_path(side, first[side], steps, heels_up) for side in (0, 1)),
    )
    placements = foot_placements(landed, plan.yaw, plan.width_m)
    after = StancePhase(
        quintic(
            [
                (duration, touch[:2], plan.drift_m_s, 0.0),
                (times.low, landed + CENTRE_AHEAD_LOW_M * plan.forward, 0.0, 0.0),
            ]
        ),
        quintic(
            [
                (duration, levels.touch, landing[2], -GRAVITY_M_S2),
                (times.low, levels.low, 0.0, yielding),
                (times.end, levels.end, 0.0, 0.0),
            ]
        ),
        tuple(foot_path(side, placements[side], [], heels_down) for side in (0, 1)),
    )
    legs = _legs_in_flight(person, plan, upper_body, before=before, after=after, duration=duration)
    return Movement(person, upper_body, before, FlightPhase(takeoff, velocity, duration, legs), after)


def _least_peak_acceleration(distance_m: float, speed_m_s: float) -> tuple[float, float]:
    """Find the quintic from rest at the bottom to take-off or touch-down whose peak acceleration is least.

    Returns its duration [s] and the upward acceleration at the bottom [m/s^2]; it never goes below the bottom.
    """
    s = np.linspace(0, 1, 41)
    ends = np.array([[0, 0, 0, 1, 1, 1], [0, 0, 0, 3, 4, 5], [0, 0, 0, 6, 12, 20]]).T  # of s^k and its derivatives at 1
    best = (np.inf, 0.0, 0.0)
    for time_s in np.linspace(1.2, 2.6, 29) * distance_m / speed_m_s:
        for bottom in _BOTTOM_ACCELERATIONS_M_S2:
            start = np.array([0.0, 0.0, bottom * time_s**2 / 2])
            end = np.array([distance_m, speed_m_s * time_s, -GRAVITY_M_S2 * time_s**2])
            remaining = end - start[2] * np.array([1, 2, 2])
            rise = np.concatenate([start, np.linalg.solve(ends[3:].T, remaining)])
            if np.polynomial.polynomial.polyval(s, rise).min() >= 0:
                double = np.polynomial.polynomial.polyval(s, np.arange(2, 6) * np.arange(1, 5) * rise[2:]) / time_s**2
                best = min(best, (float(np.abs(double).max()), float(time_s), float(bottom)))
    return best[1:]


def _path_to_takeoff(plan: JumpPlan, times: KeyTimes, midpoints: list[tuple[float, Array]], takeoff: Array) -> PPoly:
    """Return the horizontal path (2,) of the centre of mass to take-off: along with the feet, then with the drift."""
    near = CENTRE_AHEAD_M * plan.forward
    bottom = plan.position + CENTRE_AHEAD_LOW_M * plan.forward + 0.4 * times.bottom * plan.drift_m_s
    key_times = [(t, middle + near) for t, middle in midpoints if t < times.bottom - 0.5 * plan.crouch_s]
    key_times += [(times.bottom, bottom), (0.0, takeoff)]
    path = monotone_curve([t for t, _ in key_times], [point for _, point in key_times])
    rates = [*path([t for t, _ in key_times[:-1]], 1), plan.drift_m_s]
    return quintic([(t, point, rate, 0.0) for (t, point), rate in zip(key_times, rates, strict=True)])


def _upper_body(person: Person, plan: JumpPlan, times: KeyTimes, steps: list[Step]) -> UpperBody:
    postures, apex = plan.key_postures, times.touch / 2
    key_times = {
        "ready": times.crouch,
        "bottom": times.bottom,
        "takeoff": 0.0,
        "peak": apex,
        "touch": times.touch,
        "low": times.low,
        "end": times.end,
    }
    pitch = monotone_curve(list(key_times.values()), [np.radians(postures[name].pitch) for name in key_times])
    angles = {name: posture.angles(person) for name, posture in postures.items()}
    is_arm = np.array([s.name.startswith(("upper_arm", "forearm", "hand")) for s in person.model.segments[1:]])
    arm_times = [
        (times.crouch, "ready"),
        (times.bottom, "bottom"),
        (0.0, "takeoff"),
        (_REACHED_S, "peak"),
        (times.touch - _FOLDING_S, "peak"),
        (times.touch - _FOLDED_S, "fold"),
        (times.touch, "touch"),
        (times.low, "low"),
        (times.end, "end"),
    ]
    return UpperBody(
        yaw=body_yaw(plan.yaw, steps),
        pitch=pitch,
        trunk=monotone_curve(list(key_times.values()), [angles[name] * ~is_arm[:, None] for name in key_times]),
        arms=monotone_curve([t for t, _ in arm_times], [angles[name] * is_arm[:, None] for _, name in arm_times]),
    )


def _legs_in_flight(
    person: Person, plan: JumpPlan, upper_body: UpperBody, *, before: StancePhase, after: StancePhase, duration: float
) -> PPoly:
    """Return the angles (6, 3) of hip, knee and ankle, left first, continuous with the stance before and after."""
    first, rate, double = leg_derivatives(person, upper_body, before, 0.0, toward=-1)
    last, last_rate, last_double = leg_derivatives(person, upper_body, after, duration, toward=1)
    follow = first + rate * _FOLLOW_S / 2 + double * _FOLLOW_S**2 / 12  # the smoothest way to rest
    ankles = np.arange(2, 6, 3)
    follow[ankles, 0] = np.minimum(follow[ankles, 0], _POINTED_RAD)
    prepare = last - last_rate * _PREPARE_S / 2 + last_double * _PREPARE_S**2 / 12
    peak = (follow + prepare) / 2
    peak[:, 0] = np.radians(np.tile([-plan.hip_peak, plan.knee_peak, plan.ankle_peak], 2))
    return quintic(
        [
            (0.0, first, rate, double),
            (_FOLLOW_S, follow, 0.0, 0.0),
            (duration / 2, peak, 0.0, 0.0),
            (duration - _PREPARE_S, prepare, 0.0, 0.0),
            (duration, last, last_rate, last_double),
        ]
    )
