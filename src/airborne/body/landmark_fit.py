"""Landmarks to targets by damped Gauss-Newton steps over the root and the joints' rotations, within their limits."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airborne.body.chain import angles_near, point_jacobian
from airborne.body.model import BodyModel, PosedBody
from airborne.geometry.descent import MarquardtRule, descend
from airborne.geometry.joint_rotations import compose_rotation_vectors, rotation_vectors_between
from airborne.geometry.rotations import matrix_from_angles
from airborne.geometry.swing_twist import swing_twist_jacobian
from airborne.types import Array

_JOINT_SD_RAD = 1.0  # prior sd of a joint's rotation about neutral
_LIMIT_SD_RAD = np.radians(0.3)  # of how far a joint may go beyond its limits: points set by hand are often off
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
    neutral: Array | None = None  # (joints, 3) angles [rad]; None: straight, as far as the limits allow

    @cached_property
    def is_given(self) -> NDArray[np.bool_]:
        """Whether each landmark has a target: (landmarks,)."""
        return np.asarray(np.isfinite(self.targets).all(axis=1))

    @cached_property
    def given(self) -> tuple[NDArray[np.int64], Array, Array, Array]:
        """Of the landmarks with a target (n,): the segments, the places (n, 3) in them, the targets, and the scales."""
        rows = self.is_given
        return (
            self.model.landmark_segments[rows],
            self.model.landmarks_m[rows],
            self.targets[rows],
            (self.root_weights / self.sd_m)[rows],
        )

    @cached_property
    def prior(self) -> Array:
        """The pose that the joints' prior is about, as angles: (joints, 3) [rad]."""
        neutral = np.zeros((self.model.n_joints, 3)) if self.neutral is None else self.neutral
        return angles_near(self.model.limits.clamp(matrix_from_angles(neutral)), neutral)


@dataclass(frozen=True, slots=True, eq=False)
class PoseState:
    """A pose as arrays."""

    R: Array  # (3, 3) world from root
    t: Array  # (3,) [m]
    angles: Array  # (joints, 3) [rad]; for a batch (..., joints, 3)


def minimise(
    problem: LandmarkProblem,
    state: PoseState,
    free: NDArray[np.bool_],
    least_gain: float = _FINE_GAIN,
    *,
    most_steps: int = _MOST_STEPS,
) -> tuple[PoseState, float]:
    """Minimise the cost over the free variables (6 + 3 joints,); return the state and its cost."""

    def evaluate(state: PoseState) -> _Iterate:
        return _Iterate(problem, state, free)

    best = descend(evaluate(state), evaluate, _DAMPING, most_steps=most_steps, least_gain=least_gain).best
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
        """Return the state after a damped step; no decrease is predicted, as it may reach limits."""
        _, gradient, hessian = self.equations
        rows = np.flatnonzero(self.free)
        damped = hessian[rows[:, None], rows]
        damped.flat[:: len(rows) + 1] += damping * damped.diagonal() + 1e-9
        step = np.zeros(len(gradient))
        step[rows] = np.linalg.solve(damped, -gradient[rows])
        R = Rotation.from_rotvec(step[3:6]).as_matrix() @ self.state.R if self.free[:6].any() else self.state.R
        angles = compose_rotation_vectors(self.state.angles, step[6:].reshape(-1, 3))
        return PoseState(R, self.state.t + step[:3], angles), np.inf


def _equations(problem: LandmarkProblem, state: PoseState) -> tuple[float, Array, Array]:
    """Return half the squared residuals, their gradient and Gauss-Newton Hessian."""
    own, local, targets, scale = problem.given
    rotations = matrix_from_angles(state.angles)
    R, t = problem.model.pose_segments(state.R, state.t, state.angles[None])
    posed = PosedBody(problem.model, R[0], t[0])
    points = np.einsum("nij,nj->ni", posed.R[own], local) + posed.t[own]
    jacobian = point_jacobian(posed, own, points)
    n_joints = len(state.angles)
    J = (scale[:, None, None] * jacobian).reshape(-1, 6 + 3 * n_joints)
    r = (scale[:, None] * (points - targets)).ravel()
    deviation = rotation_vectors_between(problem.prior, state.angles).ravel() / _JOINT_SD_RAD
    gradient, hessian = J.T @ r, J.T @ J
    gradient[6:] += deviation / _JOINT_SD_RAD
    hessian.flat[6 * (len(hessian) + 1) :: len(hessian) + 1] += _JOINT_SD_RAD**-2
    cost = float(r @ r + deviation @ deviation) / 2
    limits = problem.model.limits
    excess = limits.excess(rotations) / _LIMIT_SD_RAD
    joints = np.flatnonzero((excess != 0).any(axis=-1))
    if not len(joints):
        return cost, gradient, hessian
    jacobians = swing_twist_jacobian(limits.relative(rotations)[joints]) / _LIMIT_SD_RAD
    size = np.linalg.norm(excess[joints], axis=1)
    rows = ((excess[joints] / size[:, None])[:, None] @ jacobians)[:, 0]
    own = 6 + 3 * joints[:, None] + np.arange(3)
    gradient[own] += size[:, None] * rows
    hessian[own[:, :, None], own[:, None]] += rows[:, :, None] * rows[:, None]
    cost += float(size @ size) / 2
    return cost, gradient, hessian


def landmark_positions(problem: LandmarkProblem, state: PoseState) -> Array:
    """Return the landmarks' positions: (..., landmarks, 3) world [m]."""
    shape = state.angles.shape[:-2]
    R, t = problem.model.pose_segments(state.R, state.t, state.angles.reshape(math.prod(shape), -1, 3))
    own, places_m = problem.model.landmark_segments, problem.model.landmarks_m
    points = np.einsum("hnij,nj->hni", R[:, own], places_m) + t[:, own]
    return points.reshape(*shape, *places_m.shape)


def landmark_distances(problem: LandmarkProblem, state: PoseState) -> Array:
    """Return the landmarks' distances from their targets: (..., landmarks) [m]; NaN without a target."""
    return np.linalg.norm(landmark_positions(problem, state) - problem.targets, axis=-1)
