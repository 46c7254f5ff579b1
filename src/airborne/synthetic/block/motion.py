"""A person's movement on the floor and in the air: poses over time, with continuous acceleration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import BPoly, PchipInterpolator, PPoly

from airborne.constants import FREE_FALL_M_S2
from airborne.synthetic.block.legs import axis_rotation, roll_foot
from airborne.synthetic.block.posture import Feet, Person, Poses, solve_stance
from airborne.types import Array

Knot = tuple[float, Any, Any, Any]  # time [s], value, its first and second derivatives

_STEP_S, _STEPS = 0.002, 6  # of the finite differences of the legs before take-off and after landing


def quintic(knots: Sequence[Knot]) -> PPoly:
    """Join knots by quintics with continuous value, rate and acceleration; values are scalars or arrays of a shape."""
    values = [np.stack([np.broadcast_to(np.asarray(v, float), np.shape(k[1])) for v in k[1:]]) for k in knots]
    return PPoly.from_bernstein_basis(BPoly.from_derivatives([k[0] for k in knots], np.stack(values)))


def minimum_jerk(time_s: Sequence[float], values: Sequence[object]) -> PPoly:
    """Join values at rest by quintics of minimum jerk."""
    return quintic([(t, value, 0.0, 0.0) for t, value in zip(time_s, values, strict=True)])


def monotone_curve(time_s: Sequence[float], values: Sequence[object]) -> PPoly:
    """Join values by quintics with the slopes of monotone cubics (PCHIP), at rest at both ends."""
    stacked = np.stack([np.asarray(value, float) for value in values])
    rates = PchipInterpolator(time_s, stacked)(time_s, 1)
    rates[[0, -1]] = 0
    return quintic([(t, value, rate, 0.0) for t, value, rate in zip(time_s, stacked, rates, strict=True)])


def evaluate_clamped(curve: PPoly, time_s: Array) -> Array:
    """Return a curve's values (n, ...) at times (n,) [s]; constant before and after its knots."""
    return curve(np.clip(time_s, curve.x[0], curve.x[-1]))


class FootPath(NamedTuple):
    """One foot's path over the floor; see `roll_foot`."""

    placement: PPoly  # (3,) x, y [m] and yaw [rad]
    lift: PPoly  # [m]
    pitch: PPoly  # [rad]


class StancePhase(NamedTuple):
    """A phase on the floor; the path of the centre of mass does not depend on the feet."""

    centre_xy: PPoly  # (2,) x, y of the centre of mass [m]
    centre_z: PPoly  # z of the centre of mass [m]
    feet: tuple[FootPath, ...]  # left, right


class UpperBody(NamedTuple):
    """The motion of root, trunk, head and arms; the legs follow."""

    yaw: PPoly  # of the root about z [rad]
    pitch: PPoly  # of the root, then forward about its own x [rad]
    trunk: PPoly  # (17, 3) joint angles; summed with the arms'
    arms: PPoly  # (17, 3)


class FlightPhase(NamedTuple):
    """A phase in the air: a parabola of the centre of mass, from take-off at time 0."""

    centre: Array  # (3,) of mass at take-off, world [m]
    velocity: Array  # (3,) [m/s]
    duration_s: float
    legs: PPoly  # (6, 3) angles of hip, knee, ankle, left first [rad]

    def centre_at(self, time_s: Array) -> Array:
        """Return the centre of mass at the times (n,) [s] after take-off: (n, 3) world [m]."""
        t = np.asarray(time_s, float)[:, None]
        return self.centre + self.velocity * t + FREE_FALL_M_S2 * t**2 / 2


@dataclass(frozen=True, slots=True, eq=False)
class Movement:
    """A person's movement; a jumper takes off at time 0."""

    person: Person
    upper_body: UpperBody
    before: StancePhase
    flight: FlightPhase | None = None
    after: StancePhase | None = None

    def __call__(self, time_s: Array) -> Poses:
        """Return the poses at the times (n,) [s]; static before its first and after its last knot."""
        time_s = np.asarray(time_s, float)
        flight, after = self.flight, self.after
        if flight is None or after is None:
            return stance_poses(self.person, self.upper_body, self.before, time_s)
        is_up = (time_s > 0) & (time_s < flight.duration_s)
        phases = [
            (time_s <= 0, lambda t: stance_poses(self.person, self.upper_body, self.before, t)),
            (is_up, self._flight_poses),
            (time_s >= flight.duration_s, lambda t: stance_poses(self.person, self.upper_body, after, t)),
        ]
        n, joints = len(time_s), len(self.person.model.segments) - 1
        poses = Poses(np.empty((n, 3, 3)), np.empty((n, 3)), np.empty((n, joints, 3)))
        for selected, poses_at in phases:
            if selected.any():
                for whole, part in zip(poses, poses_at(time_s[selected]), strict=True):
                    whole[selected] = part
        return poses

    def _flight_poses(self, time_s: Array) -> Poses:
        assert self.flight is not None
        R, angles = upper_body_at(self.upper_body, time_s)
        angles[:, self.person.joints.ravel()] = self.flight.legs(time_s)
        own = self.person.centre_of_mass(Poses(R, np.zeros((len(time_s), 3)), angles))
        return Poses(R, self.flight.centre_at(time_s) - own, angles)


def translate(movement: Movement, shift: Array) -> Movement:
    """Return the same movement shifted over the floor by `shift` (2,) [m]."""

    def shift_curve(curve: PPoly) -> PPoly:
        c = curve.c.copy()
        c[-1, :, :2] += shift
        return PPoly(c, curve.x)

    def shift_stance(stance: StancePhase) -> StancePhase:
        feet = tuple(foot._replace(placement=shift_curve(foot.placement)) for foot in stance.feet)
        return stance._replace(centre_xy=shift_curve(stance.centre_xy), feet=feet)

    flight, after = movement.flight, movement.after
    return replace(
        movement,
        before=shift_stance(movement.before),
        flight=None if flight is None else flight._replace(centre=flight.centre + np.append(shift, 0.0)),
        after=None if after is None else shift_stance(after),
    )


def upper_body_at(upper_body: UpperBody, time_s: Array) -> tuple[Array, Array]:
    """Return the root's R (n, 3, 3) and the joint angles (n, 17, 3), legs straight, at the times (n,) [s]."""
    yaw, pitch = evaluate_clamped(upper_body.yaw, time_s), evaluate_clamped(upper_body.pitch, time_s)
    return axis_rotation(2, yaw) @ axis_rotation(0, pitch), evaluate_clamped(
        upper_body.trunk, time_s
    ) + evaluate_clamped(upper_body.arms, time_s)


def stance_poses(person: Person, upper_body: UpperBody, stance: StancePhase, time_s: Array) -> Poses:
    """Return the poses of a stance phase at the times (n,) [s]."""
    R, angles = upper_body_at(upper_body, time_s)
    feet = [
        roll_foot(
            person.leg,
            evaluate_clamped(foot.placement, time_s),
            evaluate_clamped(foot.pitch, time_s),
            evaluate_clamped(foot.lift, time_s),
        )
        for foot in stance.feet
    ]
    both = Feet(np.stack([ankle for ankle, _ in feet]), np.stack([R_foot for _, R_foot in feet]))
    return solve_stance(
        person,
        R,
        angles,
        feet=both,
        centre=np.column_stack([evaluate_clamped(stance.centre_xy, time_s), evaluate_clamped(stance.centre_z, time_s)]),
    )


def leg_derivatives(
    person: Person, upper_body: UpperBody, stance: StancePhase, time_s: float, *, toward: int
) -> tuple[Array, ...]:
    """Return the legs' angles, rates and accelerations, (6, 3) each, at the start or end of a stance phase.

    `toward` is -1 for differences back from its end, +1 for differences ahead from its start.
    """
    steps = toward * np.arange(float(_STEPS))
    angles = stance_poses(person, upper_body, stance, time_s + _STEP_S * steps).joint_angles[:, person.joints.ravel()]
    coefficients = np.linalg.solve(np.vander(steps.astype(float), increasing=True), angles.reshape(_STEPS, -1))
    shape = angles.shape[1:]
    value, rate, double = (coefficients[k].reshape(shape) / _STEP_S**k for k in range(3))
    return value, rate, 2 * double
