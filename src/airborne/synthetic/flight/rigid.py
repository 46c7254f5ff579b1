"""Free flight of a rigid body: Euler's equations for the rotation, a parabola for the centre of mass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Box, Pose
from airborne.constants import FREE_FALL_M_S2
from airborne.errors import BodyError
from airborne.types import Array

_RELATIVE, _ABSOLUTE = 1e-11, 1e-12  # tolerances of the integration


@dataclass(frozen=True, slots=True, eq=False)
class MassProperties:
    """Mass, centre of mass and inertia of a rigid body, in the root's frame."""

    mass_kg: float
    centre: Array  # (3,) centre of mass [m]
    inertia: Array  # (3, 3) about the centre of mass [kg m^2]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Launch:
    """The state of a rigid body at time 0."""

    centre: Array  # (3,) centre of mass, world [m]
    velocity: Array  # (3,) of the centre of mass, world [m/s]
    R: Array  # (3, 3) world from root
    angular_velocity: Array  # (3,) in the root's frame [rad/s]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SampledFlight:
    """A sampled flight; `position` is the root's origin, which need not be the centre of mass."""

    time_s: Array  # (n,) [s]
    position: Array  # (n, 3) world [m]
    R: Array  # (n, 3, 3) world from root
    centre: Array  # (n, 3) centre of mass, world [m]
    angular_velocity: Array  # (n, 3) of the root, in its own frame [rad/s]
    joint_angles: Array  # (n, joints, 3) [rad]; no joints for a rigid body
    angular_momentum: Array  # (n, 3) about the centre of mass, world [kg m^2/s]; NaN where not known

    def pose(self, i: int) -> Pose:
        """Return the i-th sample as a pose."""
        root = RigidTransform.from_components(self.position[i], Rotation.from_matrix(self.R[i]))
        return Pose(world_from_root=root, joint_angles=self.joint_angles[i])


def mass_properties(model: BodyModel, density_kg_m3: float) -> MassProperties:
    """Add up a body's boxes, joints straight, at one density [kg/m^3]; where boxes overlap, the wood counts twice.

    Raises BodyError for a part that is not a box.
    """
    posed = model.with_pose(Pose(world_from_root=RigidTransform.identity()))
    masses, centres, inertias = [], [], []
    for segment, R, t in zip(model.segments, posed.R, posed.t, strict=True):
        for part in segment.parts:
            if not isinstance(part.shape, Box):
                raise BodyError(f"part '{part.name}' is not a box; a rigid body in free flight is made of boxes only")
            x2, y2, z2 = np.square(part.shape.size_m)
            mass = density_kg_m3 * float(np.prod(part.shape.size_m))
            rotation = R @ part.segment_from_part.rotation.as_matrix()
            masses.append(mass)
            centres.append(R @ part.segment_from_part.translation + t)
            inertias.append(rotation @ np.diag([y2 + z2, x2 + z2, x2 + y2]) @ rotation.T * mass / 12)
    total = sum(masses)
    centre = np.average(centres, axis=0, weights=masses)
    inertia = np.zeros((3, 3))
    for mass, position, own in zip(masses, centres, inertias, strict=True):
        d = position - centre
        inertia += own + mass * (d @ d * np.eye(3) - np.outer(d, d))
    return MassProperties(total, centre, inertia)


def fly(mass: MassProperties, launch: Launch, time_s: Array) -> SampledFlight:
    """Fly a body without air or torque, and sample it at the times (n,) [s], in any order, before or after launch.

    Euler: I w' = (I w) x w in the root's frame, and q' = q (w, 0) / 2.
    """
    time_s = np.asarray(time_s, float)
    start = np.concatenate([Rotation.from_matrix(launch.R).as_quat(), launch.angular_velocity])
    to_inverse = np.linalg.inv(mass.inertia)

    def rate(_: float, state: Array) -> Array:
        q, w = state[:4], state[4:]
        turning = 0.5 * np.append(q[3] * w + np.cross(q[:3], w), -q[:3] @ w)
        return np.append(turning, to_inverse @ np.cross(mass.inertia @ w, w))

    states = np.tile(start, (len(time_s), 1))
    for selected in (time_s > 0, time_s < 0):
        times, back = np.unique(time_s[selected], return_inverse=True)
        if len(times):
            far = times[np.argmax(np.abs(times))]
            order = slice(None, None, 1 if far > 0 else -1)
            solved = solve_ivp(rate, (0.0, far), start, "DOP853", times[order], rtol=_RELATIVE, atol=_ABSOLUTE)
            states[selected] = solved.y.T[order][back]
    R = Rotation.from_quat(states[:, :4]).as_matrix()
    t = time_s[:, None]
    centre = launch.centre + launch.velocity * t + FREE_FALL_M_S2 * t**2 / 2
    w = states[:, 4:]
    return SampledFlight(
        time_s=time_s,
        position=centre - R @ mass.centre,
        R=R,
        centre=centre,
        angular_velocity=w,
        joint_angles=np.zeros((len(time_s), 0, 3)),
        angular_momentum=np.einsum("nij,nj->ni", R @ mass.inertia, w),
    )
