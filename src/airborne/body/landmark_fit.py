"""Landmarks to targets by damped Gauss-Newton steps over the root and the joint angles, within the joints' limits."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airborne.body.chain import point_jacobian
from airborne.body.model import BodyModel, PosedBody
from airborne.geometry.descent import MarquardtRule, descend
from airborne.geometry.rotations import matrix_from_angles
from airborne.types import Array

_ANGLE_SD_RAD = 1.0  # prior sd of an angle about neutral
_FINE_GAIN, COARSE_GAIN = 1e-6, 1e-4  # shares of the cost; a smaller gain ends the iteration
_MOST_STEPS = 100  # at most
_DAMPING = MarquardtRule(first=1e-4, down=5, up=4, least=1e-9, most=4e8)


@dataclass(frozen=True, eq=False)
class LandmarkProblem:
    """A fit of a body's landmarks to targets."""

    model: BodyModel
    targets: Array  # (landmarks, 3) world [m]; NaN where unknown
    root_weights: Array  # (landmarks,) square roots
    sd_m: float  # of a landmark of weight 1 [m]
    neutral: Array | None = None  # (joints, 3) [rad]; None: straight, as far as the limits allow

    @cached_property
    def segments(self) -> NDArray[np.int64]:
        """The segment that carries each landmark: (landmarks,)."""
        return np.array([self.model.index_of(landmark.segment) for landmark in self.model.landmarks])

    @cached_property
    def local(self) -> Array:
        """The landmarks in their segments' frames: (landmarks, 3) [m]."""
        return np.array([landmark.position_m for landmark in self.model.landmarks])

    @cached_property
    def is_given(self) -> NDArray[np.bool_]:
        """Whether each landmark has a target: (landmarks,)."""
        return np.asarray(np.isfinite(self.targets).all(axis=1))

    @cached_property
    def limits(self) -> Array:
        """The joints' least and greatest angles: (joints, 3, 2) [rad]."""
        return self.model.limits_rad

    @cached_property
    def prior(self) -> Array:
        """The prior mean of the angles: (joints, 3) [rad]."""
        neutral = np.zeros(self.limits.shape[:2]) if self.neutral is None else self.neutral
        return np.clip(neutral, self.limits[..., 0], self.limits[..., 1])


@dataclass(frozen=True, slots=True, eq=False)
class PoseState:
    """A pose as arrays."""

    R: Array  # (3, 3) world from root
    t: Array  # (3,) [m]
    angles: Array  # (joints, 3) [rad]; for a batch (..., joints, 3)


def minimise(
    problem: LandmarkProblem, state: PoseState, free: NDArray[np.bool_], least_gain: float = _FINE_GAIN
) -> tuple[PoseState, float]:
    """Minimise the cost over the free variables (6 + 3 joints,); return the state and its cost."""

    def evaluate(state: PoseState) -> _Iterate:
        return _Iterate(problem, state, free)

    best = descend(evaluate(state), evaluate, _DAMPING, most_steps=_MOST_STEPS, least_gain=least_gain).best
    return best.state, best.equations[0]


@dataclass(frozen=True, eq=False)
class _Iterate:
    """A state in the descent."""

    problem: LandmarkProblem
    state: PoseState
    free: NDArray[np.bool_]  # (6 + 3 joints,)

    @cached_property
    def equations(self) -> tuple[float, Array, Array]:
        """The cost, its gradient and its Hessian here."""
        return _equations(self.problem, self.state)

    def cost(self, reference: _Iterate) -> float:
        """Return the cost."""
        return self.equations[0]

    def step(self, damping: float) -> tuple[PoseState, float]:
        """Return the state after a damped step; no decrease is predicted, as it may stop at the limits."""
        _, gradient, hessian = self.equations
        low, high = np.concatenate([np.full((6, 2), [-np.inf, np.inf]), self.problem.limits.reshape(-1, 2)]).T
        now = np.concatenate([np.zeros(6), self.state.angles.ravel()])
        down, up = np.where(self.free, low - now, 0.0), np.where(self.free, high - now, 0.0)
        step = _step(gradient, hessian, damping, low=down, high=up)
        R = Rotation.from_rotvec(step[3:6]).as_matrix() @ self.state.R
        angles = np.clip(now + step, low, high)[6:].reshape(-1, 3)
        return PoseState(R, self.state.t + step[:3], angles), np.inf


def _step(gradient: Array, hessian: Array, damping: float, *, low: Array, high: Array) -> Array:
    """Return the damped Gauss-Newton step (variables,) within bounds; what reaches a bound stays there (active set)."""
    step, moving = np.zeros(len(gradient)), (low < 0) & (high > 0)
    moving |= (low < 0) & (high >= 0) & (gradient > 0) | (low <= 0) & (high > 0) & (gradient < 0)
    damped = hessian + np.diag(damping * np.diag(hessian) + 1e-9)
    while moving.any():
        at_bound = ~moving
        slope = gradient[moving] + damped[np.ix_(moving, at_bound)] @ step[at_bound]
        unbounded = np.zeros(len(step))
        unbounded[moving] = np.linalg.solve(damped[np.ix_(moving, moving)], -slope)
        is_out = moving & ((unbounded < low) | (unbounded > high))
        step[moving] = np.clip(unbounded, low, high)[moving]
        if not is_out.any():
            break
        moving &= ~is_out
    return step


def _equations(problem: LandmarkProblem, state: PoseState) -> tuple[float, Array, Array]:
    """Return half the squared residuals, their gradient and Gauss-Newton Hessian."""
    has_target, scale = problem.is_given, (problem.root_weights / problem.sd_m)[problem.is_given]
    posed = PosedBody(problem.model, *_forward_kinematics(problem.model, state))
    points = posed.landmarks[has_target]
    jacobian = point_jacobian(posed, problem.segments[has_target], points)
    n_joints = len(state.angles)
    by_joint = jacobian[..., 6:].reshape(*jacobian.shape[:2], n_joints, 3)
    by_angle = np.einsum("...ki,kij->...kj", by_joint, _rotation_jacobian(state.angles))
    jacobian = np.concatenate([jacobian[..., :6], by_angle.reshape(*jacobian.shape[:2], -1)], axis=-1)
    J = (scale[:, None, None] * jacobian).reshape(-1, 6 + 3 * n_joints)
    r = (scale[:, None] * (points - problem.targets[has_target])).ravel()
    deviation = (state.angles - problem.prior).ravel() / _ANGLE_SD_RAD
    gradient, hessian = J.T @ r, J.T @ J
    gradient[6:] += deviation / _ANGLE_SD_RAD
    hessian[range(6, len(hessian)), range(6, len(hessian))] += _ANGLE_SD_RAD**-2
    return float(r @ r + deviation @ deviation) / 2, gradient, hessian


def _rotation_jacobian(angles: Array) -> Array:
    """Differentiate a joint's rotation vector, segment's own axes, by its x, y, z angles (..., 3): (..., 3, 3)."""
    cos, sin = np.cos(angles), np.sin(angles)
    zero, one = np.zeros(angles.shape[:-1]), np.ones(angles.shape[:-1])
    (_, cy, cz), (_, sy, sz) = np.moveaxis(cos, -1, 0), np.moveaxis(sin, -1, 0)
    rows = [[cz * cy, sz, zero], [-sz * cy, cz, zero], [sy, zero, one]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _forward_kinematics(model: BodyModel, state: PoseState) -> tuple[Array, Array]:
    """Return world from segment, rotations (..., segments, 3, 3) and translations (..., segments, 3) [m]."""
    rotations = matrix_from_angles(state.angles)  # (..., joints, 3, 3)
    R, t = (
        [np.broadcast_to(state.R, (*rotations.shape[:-3], 3, 3))],
        [np.broadcast_to(state.t, (*rotations.shape[:-3], 3))],
    )
    for index, (segment, parent) in enumerate(zip(model.segments[1:], model.parents[1:], strict=True)):
        t.append(t[parent] + R[parent] @ segment.joint_m)
        R.append(R[parent] @ rotations[..., index, :, :])
    return np.stack(R, axis=-3), np.stack(t, axis=-2)


def landmark_positions(problem: LandmarkProblem, state: PoseState) -> Array:
    """Return the landmarks' positions: (..., landmarks, 3) world [m]."""
    R, t = _forward_kinematics(problem.model, state)
    return np.einsum("...nij,nj->...ni", R[..., problem.segments, :, :], problem.local) + t[..., problem.segments, :]


def landmark_distances(problem: LandmarkProblem, state: PoseState) -> Array:
    """Return the landmarks' distances from their targets: (..., landmarks) [m]; NaN without a target."""
    return np.linalg.norm(landmark_positions(problem, state) - problem.targets, axis=-1)
