"""Free flight of a body that moves its joints: constant angular momentum, a parabola for the centre of mass.

In the root's frame, about the centre of mass: I(q) w + h(q, q') = R^T L, and R' = R [w]x. L is constant in the
world, I is the inertia of the body in its pose, and h the momentum of the joints' motion with the root fixed.
Source: Yeadon, Atha & Hales 1990, J. Biomech. 23, 85-89 (angle-driven simulation of aerial movement).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import BarycentricInterpolator, BPoly, PPoly
from scipy.spatial.transform import Rotation

from airborne.body import BodyModel
from airborne.constants import FREE_FALL_M_S2
from airborne.errors import BodyError
from airborne.synthetic.flight.rigid import MassProperties, SampledFlight
from airborne.types import Array

Rate = Callable[[float, Array], Array]  # time and state to the state's rate
# between two breaks; chosen of 24 to 64: with every joint going through its range, a mass distribution is interpolated
# to 1e-14 of itself
_N_NODES = 64


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Takeoff:
    """The state of an articulated body at time 0."""

    centre: Array  # (3,) centre of mass, world [m]
    velocity: Array  # (3,) of the centre of mass, world [m/s]
    R: Array  # (3, 3) world from root
    angular_momentum: Array  # (3,) about the centre of mass, world [kg m^2/s]


class MassDistribution(NamedTuple):
    """The mass of n posed bodies and its motion, in the root's frame, with the root fixed."""

    centre: Array  # (n, 3) centre of mass [m]
    inertia: Array  # (n, 3, 3) about the centre of mass [kg m^2]
    momentum: Array  # (n, 3) angular, of the joints' motion about the centre of mass [kg m^2/s]


def joint_motion(time_s: Array, joint_angles: Array) -> PPoly:
    """Return the motion of joints that rest at the angles (n, joints, 3) [rad] at the times (n,), increasing [s].

    From rest to rest each angle goes by the quintic of least jerk, so that its acceleration is continuous.
    """
    angles = np.asarray(joint_angles, float)
    at_rest = np.stack([angles, np.zeros_like(angles), np.zeros_like(angles)], axis=1)
    return PPoly.from_bernstein_basis(BPoly.from_derivatives(np.asarray(time_s, float), at_rest))


def sum_motions(motions: Sequence[PPoly]) -> PPoly:
    """Return the sum of joint motions; each is constant outside its own times. At most quintics."""
    times = np.unique(np.concatenate([motion.x for motion in motions]))
    derivatives = [sum(_derivative(motion, times, order) for motion in motions) for order in range(3)]
    return PPoly.from_bernstein_basis(BPoly.from_derivatives(times, np.stack(derivatives, axis=1)))


def scale_time(motion: PPoly, factor: float) -> PPoly:
    """Return the joints' motion with times multiplied by `factor`."""
    powers = np.arange(len(motion.c))[::-1].reshape(-1, *[1] * (motion.c.ndim - 1))
    return PPoly(motion.c / float(factor) ** powers, motion.x * factor)


def mass_at_angles(model: BodyModel, joint_angles: Array) -> MassProperties:
    """Add up a body's segments, its joints at the angles (joints, 3) [rad]; BodyError where an inertia is missing."""
    angles = np.asarray(joint_angles, float)[None]
    shape = _Segments.of(model).mass_distribution(angles, np.zeros_like(angles))
    return MassProperties(float(_Segments.of(model).mass_kg.sum()), shape.centre[0], shape.inertia[0])


def fly_articulated(
    model: BodyModel, takeoff: Takeoff, joints: PPoly, time_s: Array, *, tolerance: float = 1e-12
) -> SampledFlight:
    """Fly a body without air or torque, and sample it at the times (n,) [s], in any order, before or after take-off.

    `joints` gives the joint angles (joints, 3) [rad] at a time, twice differentiable within its breaks; outside them
    the joints rest at its ends. `tolerance` is that of the integration. Raises BodyError for a segment without inertia.
    """
    time_s = np.asarray(time_s, float)
    segments = _Segments.of(model)

    def turning_between(begin: float, end: float) -> Rate:
        mass = segments.tabulate(joints, begin, end)

        def turning(t: float, q: Array) -> Array:
            now = mass(t)
            return _quaternion_rate(q, _angular_velocity(_matrix(q), takeoff, now[:9].reshape(3, 3), now[9:]))

        return turning

    start = Rotation.from_matrix(takeoff.R).as_quat()
    quaternions = np.tile(start, (len(time_s), 1))
    for selected in (time_s > 0, time_s < 0):
        times, back = np.unique(time_s[selected], return_inverse=True)
        if len(times):
            order = slice(None, None, 1 if times[-1] > 0 else -1)
            flown = _integrate(turning_between, start, joints.x, times[order], tolerance=tolerance)
            quaternions[selected] = flown[order][back]
    R = Rotation.from_quat(quaternions).as_matrix()
    angles, rates = _state(joints, time_s)
    t = time_s[:, None]
    centre = takeoff.centre + takeoff.velocity * t + FREE_FALL_M_S2 * t**2 / 2
    shape = segments.mass_distribution(angles, rates)
    w = _angular_velocity(R, takeoff, shape.inertia, shape.momentum)
    spin = np.einsum("nij,nj->ni", shape.inertia, w) + shape.momentum
    return SampledFlight(
        time_s=time_s,
        position=centre - np.einsum("nij,nj->ni", R, shape.centre),
        R=R,
        centre=centre,
        angular_velocity=w,
        joint_angles=angles,
        angular_momentum=np.einsum("nij,nj->ni", R, spin),
    )


def with_fixed_joints(model: BodyModel, flight: SampledFlight, joint_angles: Array) -> SampledFlight:
    """Return the flight with the same root and the joints fixed at the angles (joints, 3) [rad] (paper B, "Method").

    Such a body has another centre of mass than the one that flew, and its angular momentum is not constant: NaN.
    """
    mass = mass_at_angles(model, joint_angles)
    return replace(
        flight,
        joint_angles=np.broadcast_to(joint_angles, flight.joint_angles.shape),
        centre=flight.position + flight.R @ mass.centre,
        angular_momentum=np.full_like(flight.centre, np.nan),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Segments:
    """A body's masses as arrays: s segments, j = s - 1 joints."""

    model: BodyModel
    mass_kg: Array  # (s,)
    centre_m: Array  # (s, 3) segments' frames
    tensor_kg_m2: Array  # (s, 3, 3) segments' axes
    is_carried: Array  # (s, j) 1 where a joint carries a segment, else 0

    @classmethod
    def of(cls, model: BodyModel) -> _Segments:
        """Collect a body's inertias; raises BodyError where one is missing."""
        inertias = []
        for segment in model.segments:
            if segment.inertia is None:
                raise BodyError(
                    f"segment '{segment.name}' has no inertia, so its flight cannot be found; "
                    "give it [segment.inertia], or use the preset human18"
                )
            inertias.append(segment.inertia)
        is_carried = np.zeros((len(model.segments), len(model.segments) - 1))
        for k, parent in enumerate(model.parents[1:], start=1):
            is_carried[k] = is_carried[parent]
            is_carried[k, k - 1] = 1
        return cls(
            model,
            np.array([inertia.mass_kg for inertia in inertias]),
            np.array([inertia.centre_m for inertia in inertias]),
            np.array([inertia.tensor_kg_m2 for inertia in inertias]),
            is_carried,
        )

    def mass_distribution(self, angles: Array, rates: Array) -> MassDistribution:
        """Sum up n bodies with joint angles and rates (n, j, 3) [rad, rad/s]."""
        parents = self.model.parents[1:]
        R, t = self.model.pose_segments(np.eye(3), np.zeros(3), angles)
        turning = np.einsum("nkij,nkj->nki", R[:, parents], _rates_in_parent(angles, rates))
        w = self.is_carried @ turning  # (n, s, 3)
        v = self.is_carried @ _cross(w[:, parents], t[:, 1:] - t[:, parents])  # of the segments' origins
        arm = np.einsum("nsij,sj->nsi", R, self.centre_m)
        share = self.mass_kg / self.mass_kg.sum()
        position, velocity = t + arm, v + _cross(w, arm)
        centre = share @ position
        d, d_rate = position - centre[:, None], velocity - (share @ velocity)[:, None]
        own = R @ self.tensor_kg_m2 @ np.swapaxes(R, -1, -2)  # (n, s, 3, 3)
        steiner = np.einsum("nsk,nsk->ns", d, d)[..., None, None] * np.eye(3) - d[..., :, None] * d[..., None, :]
        inertia = np.sum(own + self.mass_kg[:, None, None] * steiner, axis=1)
        momentum = np.einsum("nsij,nsj->ni", own, w) + self.mass_kg @ _cross(d, d_rate)
        return MassDistribution(centre, inertia, momentum)

    def tabulate(self, joints: PPoly, begin: float, end: float) -> BarycentricInterpolator:
        """Interpolate inertia and momentum (12,) between two neighbouring breaks, where the motion is smooth [s]."""
        nodes = (begin + end + (end - begin) * np.cos(np.linspace(np.pi, 0, _N_NODES))) / 2  # of Chebyshev
        shape = self.mass_distribution(*_state(joints, nodes))
        weights = (-1.0) ** np.arange(_N_NODES)
        weights[[0, -1]] /= 2
        values = np.column_stack([shape.inertia.reshape(_N_NODES, 9), shape.momentum])
        return BarycentricInterpolator(nodes, values, wi=weights)


def _angular_velocity(R: Array, takeoff: Takeoff, inertia: Array, momentum: Array) -> Array:
    """Return the root's angular velocity (..., 3) in its own frame [rad/s], from R (..., 3, 3) world from root.

    inertia (..., 3, 3), momentum (..., 3): as `MassDistribution` has them.
    """
    own = takeoff.angular_momentum @ R - momentum
    return np.asarray(np.linalg.solve(inertia, own[..., None])[..., 0], float)


def _integrate(
    turning_between: Callable[[float, float], Rate], start: Array, breaks: Array, times: Array, *, tolerance: float
) -> Array:
    """Integrate quaternions from time 0 to the times (n,), which all lie on one side of it, nearest first: (n, 4).

    Integrated from break to break: a long step would miss a short movement.
    """
    quaternions = np.empty((len(times), 4))
    for begin, end, selected in _intervals(breaks, times):
        at = times[selected]
        to_end = [] if len(at) and at[-1] == end else [end]
        at = np.append(at, to_end)
        turning = turning_between(begin, end)
        solved = solve_ivp(turning, (begin, end), start, "DOP853", at, rtol=tolerance, atol=tolerance).y.T
        start = solved[-1] / np.linalg.norm(solved[-1])
        quaternions[selected] = solved[: len(solved) - len(to_end)]
    return quaternions


def _intervals(breaks: Array, times: Array) -> Iterator[tuple[float, float, NDArray[np.bool_]]]:
    """Cut the interval from 0 to the last of the times at the breaks: begin, end, and which times lie in it."""
    far, sign = times[-1], np.sign(times[-1])
    ends = np.sort(sign * np.append(breaks[(sign * breaks > 0) & (sign * breaks < sign * far)], far))
    begin = 0.0
    for end in ends:
        yield sign * begin, sign * end, (sign * times > begin) & (sign * times <= end)
        begin = end


def _state(joints: PPoly, time_s: Array) -> tuple[Array, Array]:
    """Return joint angles and rates (n, j, 3) [rad, rad/s] at the times (n,) [s]."""
    return _derivative(joints, time_s, 0), _derivative(joints, time_s, 1)


def _derivative(joints: PPoly, time_s: Array, order: int) -> Array:
    """Return a derivative (n, j, 3) of the joints' angles; outside the breaks they are constant."""
    values = joints(np.clip(time_s, joints.x[0], joints.x[-1]), order)
    is_inside = (time_s >= joints.x[0]) & (time_s <= joints.x[-1])
    return values if order == 0 else np.where(is_inside[:, None, None], values, 0.0)


def _rates_in_parent(angles: Array, rates: Array) -> Array:
    """Return the angular velocities (..., 3) of segments against their parents, in the parents' axes [rad/s].

    x' e_x + y' Rx e_y + z' Rx Ry e_z, for the angles and rates (..., 3) of R = Rx Ry Rz.
    """
    (cx, cy, _), (sx, sy, _) = (np.moveaxis(f(angles), -1, 0) for f in (np.cos, np.sin))
    x, y, z = np.moveaxis(rates, -1, 0)
    return np.stack([x + sy * z, cx * y - sx * cy * z, sx * y + cx * cy * z], axis=-1)


def _cross(a: Array, b: Array) -> Array:
    """Return a x b (..., 3); quicker than NumPy's for few vectors."""
    return a[..., [1, 2, 0]] * b[..., [2, 0, 1]] - a[..., [2, 0, 1]] * b[..., [1, 2, 0]]


def _matrix(q: Array) -> Array:
    """Return the rotation (3, 3) of a quaternion x, y, z, w (4,) of about unit length."""
    x, y, z, w = q / np.sqrt(q @ q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _quaternion_rate(q: Array, w: Array) -> Array:
    """Return q' = q (w, 0) / 2 for an angular velocity (3,) in the rotating frame."""
    x, y, z, s = q
    a, b, c = w
    return 0.5 * np.array([s * a + y * c - z * b, s * b + z * a - x * c, s * c + x * b - y * a, -x * a - y * b - z * c])
