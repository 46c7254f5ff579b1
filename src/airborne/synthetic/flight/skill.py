"""The half-twisting forward somersault of paper B as a skill: take-off, joints and duration that have its ranges."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.interpolate import PPoly
from scipy.optimize import least_squares
from scipy.spatial.transform import RigidTransform

from airborne.body import BodyModel, Pose
from airborne.constants import FREE_FALL_M_S2, GRAVITY_M_S2
from airborne.errors import BodyError
from airborne.geometry.rotations import angles_from_matrix, unwrap
from airborne.synthetic.flight.articulated import (
    Takeoff,
    fly_articulated,
    joint_motion,
    mass_at_angles,
    scale_time,
    sum_motions,
    with_fixed_joints,
)
from airborne.synthetic.flight.rigid import SampledFlight
from airborne.types import Array

N_POSES = 11  # of the paper's sequence
_CLEARANCE_M = 0.05  # of the lowest landmark above the floor at take-off
_SWING = (0.08, 0.33)  # start and end of the arm swing, as shares of the flight
_POINTED_RAD = np.radians(35.0)  # the feet, throughout
_ELBOWS_RAD = np.radians(145.0)  # largest flexion
_PIKE = (0.08, 0.34, 0.56, 0.88)  # shares of the flight: begin and end of flexion, of extension
_PIKE_DEG = {  # about x
    "torso": 14.0,
    "chest": 8.0,
    "head": 6.0,
    "thigh_left": -40.0,
    "thigh_right": -40.0,
    "shank_left": 30.0,
    "shank_right": 30.0,
}
_LARGEST_RESIDUAL = 1e-3  # of the ranges, as a share of each
_COARSE_TOLERANCE = 1e-8  # tolerance of the integration during the search


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseRanges:
    """The range of each component of the root's pose over a movement (paper B, table 1)."""

    vertical_m: float
    forward_m: float
    lateral_m: float
    somersault_rad: float
    tilt_rad: float
    twist_rad: float


PAPER_RANGES = PoseRanges(
    vertical_m=0.79,
    forward_m=1.0,
    lateral_m=0.01,
    somersault_rad=2 * np.pi,
    tilt_rad=float(np.radians(8)),
    twist_rad=np.pi,
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Skill:
    """A flight of a person, with the motion of the arms and other joints that produces it."""

    model: BodyModel
    takeoff: Takeoff
    joints: PPoly  # joint angles (joints, 3) [rad] over time [s]
    duration_s: float
    is_rigid: bool = False  # rendered in the shape at take-off, with the root of the true flight

    def __call__(self, time_s: Array) -> SampledFlight:
        """Return the motion at the times (n,) [s]."""
        flight = fly_articulated(self.model, self.takeoff, self.joints, time_s)
        return with_fixed_joints(self.model, flight, self.joints(self.joints.x[0])) if self.is_rigid else flight

    @property
    def poses_s(self) -> Array:
        """The times of the paper's poses, evenly from take-off to landing: (11,) [s]."""
        return np.linspace(0, self.duration_s, N_POSES)


@lru_cache(maxsize=8)
def half_twist(model: BodyModel, *, has_pike: bool = False) -> Skill:
    """Find a forward somersault with half a twist for a body like `human18`, with the ranges of paper B's.

    The upper arms, at right angles to the trunk, swing once in the frontal plane, left up and right down by the same
    angle: that tilts the body, and the tilt makes it twist. The momentum, the swing and the flexion of the elbows
    give somersault, tilt and twist; duration and speed, which the paper does not print, give the distances. With a
    pike, hips, knees, trunk and neck flex and extend too; the elbows stay as without, and the tilt is free.
    Raises BodyError where no swing does it. Source: paper B, table 1; Yeadon, Atha & Hales 1990.
    """
    swing = _solve_swing(model, np.array([7.3, 0.53, 1.36]), has_pike=False)
    if has_pike:
        swing = _solve_swing(model, swing, has_pike=True)
    skill = _unit_skill(model, swing, has_pike=has_pike)
    return _launch(skill, skill(skill.poses_s))


def _solve_swing(model: BodyModel, start: Array, *, has_pike: bool) -> Array:
    """Find a swing (see `_unit_skill`) from one near it; with a pike, with the same elbows and any tilt."""
    n = 2 if has_pike else 3  # number of unknowns and of conditions

    def errors(x: Array) -> Array:
        skill = _unit_skill(model, np.append(x, start[n:]), has_pike=has_pike)
        flight = fly_articulated(model, skill.takeoff, skill.joints, skill.poses_s, tolerance=_COARSE_TOLERANCE)
        angles = unwrap(angles_from_matrix(flight.R), flight.time_s)
        reached = np.array([angles[-1, 0], angles[-1, 2], np.ptp(angles[:, 1])])
        return (reached / (PAPER_RANGES.somersault_rad, PAPER_RANGES.twist_rad, PAPER_RANGES.tilt_rad) - 1)[:n]

    bounds = np.array([[2.0, 20.0], [0.0, np.pi / 2], [0.0, _ELBOWS_RAD]])[:n].T
    solution = least_squares(errors, start[:n], bounds=tuple(bounds), diff_step=1e-4, xtol=1e-10)
    if np.abs(solution.fun).max() > _LARGEST_RESIDUAL:
        raise BodyError(
            f"no swing of the arms gives body '{model.name}' half a twist in one somersault; it needs arms and masses "
            "like those of human18"
        )
    return np.append(solution.x, start[n:])


def _unit_skill(model: BodyModel, swing: Array, *, has_pike: bool) -> Skill:
    """Return a flight of one second at zero take-off velocity; twice the momentum rotates alike in half the time.

    swing (3,): momentum as angular velocity of the upright body [rad/s], and [rad] how far the arms go up or down and
    the elbows are flexed.
    """
    static = _joint_angles(model, {"foot_left": _POINTED_RAD, "foot_right": _POINTED_RAD}, 0)
    static += _joint_angles(model, {"forearm_left": -swing[2], "forearm_right": -swing[2]}, 0)
    arms = [
        static + _joint_angles(model, {"upper_arm_left": -np.pi / 2 - angle, "upper_arm_right": np.pi / 2 - angle}, 1)
        for angle in (0.0, swing[1])
    ]
    joints = joint_motion(np.array(_SWING), np.array(arms))
    if has_pike:
        pike = _joint_angles(model, {name: np.radians(angle) for name, angle in _PIKE_DEG.items()}, 0)
        joints = sum_motions([joints, joint_motion(np.array(_PIKE), np.array([0 * pike, pike, pike, 0 * pike]))])
    upright = mass_at_angles(model, np.zeros_like(static)).inertia[0, 0]
    takeoff = Takeoff(
        centre=np.zeros(3),
        velocity=np.zeros(3),
        R=np.eye(3),
        angular_momentum=np.array([swing[0] * upright, 0.0, 0.0]),
    )
    return Skill(model=model, takeoff=takeoff, joints=joints, duration_s=1.0)


def _launch(skill: Skill, flight: SampledFlight) -> Skill:
    """Give a flight of one second its duration, in whole milliseconds, velocity and position.

    The flight is that of the paper's poses. Take-off and landing have the root at one height; the middle is x = y = 0.
    """
    time, g = flight.time_s, GRAVITY_M_S2
    about = flight.position - flight.centre  # of the root about the centre of mass, whatever the duration

    def path(x: Array) -> Array:
        """Return the root's path for distances along x and -y [m] and a duration [s]; take-off is at `about[0]`."""
        rise = g * x[2] ** 2 / 2 * (time - time**2) - time * (about[-1, 2] - about[0, 2])
        return about + np.column_stack([x[0] * time, -x[1] * time, rise])

    def errors(x: Array) -> Array:
        return np.ptp(path(x), axis=0) - (PAPER_RANGES.lateral_m, PAPER_RANGES.forward_m, PAPER_RANGES.vertical_m)

    bounds = ([-0.1, 0.5, 0.3], [0.1, 1.5, 1.5])
    lateral, forward, duration = least_squares(errors, [0.0, 1.0, 0.85], bounds=bounds).x
    duration = round(float(duration), 3)
    root = path(np.array([lateral, forward, duration]))
    first = Pose(world_from_root=RigidTransform.identity(), joint_angles=skill.joints(skill.joints.x[0]))
    lowest = skill.model.with_pose(first).landmarks[:, 2].min()
    middle = (root.min(axis=0) + root.max(axis=0)) / 2
    takeoff = Takeoff(
        centre=np.array([-middle[0], -middle[1], _CLEARANCE_M - lowest - about[0, 2]]),
        velocity=np.array([lateral, -forward, about[0, 2] - about[-1, 2]]) / duration - FREE_FALL_M_S2 * duration / 2,
        R=np.eye(3),
        angular_momentum=skill.takeoff.angular_momentum / duration,
    )
    return replace(skill, takeoff=takeoff, duration_s=duration, joints=scale_time(skill.joints, duration))


def _joint_angles(model: BodyModel, angles_rad: dict[str, float], axis: int) -> Array:
    """Return joint angles (joints, 3) [rad]: those of the named segments about one axis, the others zero."""
    angles = np.zeros((len(model.segments) - 1, 3))
    for name, angle in angles_rad.items():
        angles[model.index_of(name) - 1, axis] = angle
    return angles
