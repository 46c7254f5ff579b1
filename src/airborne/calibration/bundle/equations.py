"""Residuals, their Jacobian, the normal equations, and the Schur complement that eliminates points and targets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import SuperLU, splu
from scipy.spatial.transform import Rotation

from airborne.calibration.bundle.layout import Layout
from airborne.calibration.bundle.lenses import N_PARAMETERS, cross_matrices, project, project_with_jacobian
from airborne.calibration.bundle.problem import Problem, State
from airborne.types import Array, Ints

_GAUGE_TOLERANCE = 1e-9  # of the camera's own curvature: below it, a direction counts as unobserved
_RIDGE = 1e-13  # of a diagonal: regularises unobserved parameters


@dataclass(frozen=True, slots=True, eq=False)
class Jacobian:
    """Derivatives of the residuals' predictions, unweighted; `Layout` has their columns.

    That of a lag is 1, by itself.
    """

    by_camera: Array  # (n, 2, p) of the pixels by the camera
    by_other: Array  # (n, 2, q) by the target or point, and by the lag
    by_ends: Array  # (k, 6) of the lengths by their ends


@dataclass(frozen=True, slots=True, eq=False)
class NormalEquations:
    """The normal equations in blocks: cameras, others, and their coupling."""

    cameras: Array  # (c, c)
    coupling: Array  # (c, o)
    others: csc_array  # (o, o)
    diagonal: Ints  # (o,) places of the others' diagonal among their values
    camera_rhs: Array  # (c,), minus the gradient
    other_rhs: Array  # (o,)

    def reduce(self, damping: float) -> tuple[Array, Array, SuperLU | None, Array]:
        """Eliminate the others by their Schur complement.

        Return the reduced camera matrix and right-hand side, the others' factors, and `others^-1 coupling^T`.
        """
        cameras = self.cameras + damping * np.diag(np.diag(self.cameras))
        if not len(self.other_rhs):
            return cameras, self.camera_rhs, None, np.zeros((0, len(cameras)))
        others = self.others.copy()
        others.data[self.diagonal] += others.data[self.diagonal] * (damping + _RIDGE) + 1e-30
        factors = splu(
            others,
            permc_spec="NATURAL",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        back = factors.solve(np.ascontiguousarray(self.coupling.T))
        return cameras - self.coupling @ back, self.camera_rhs - back.T @ self.other_rhs, factors, back


def world_points(problem: Problem, state: State) -> Array:
    """Return every observed point's world position at its time of exposure: (n, 3) [m]."""
    world, arm, displacement = _points_at_moments(problem, state)
    return world + np.cross(displacement[:, :3], arm) + displacement[:, 3:]


def _points_at_moments(problem: Problem, state: State) -> tuple[Array, Array, Array]:
    """Return points (n, 3) at their moments, their arms from their targets' origins, and the displacement (n, 6) since.

    The displacement is a small rotation and a shift; arm and displacement are 0 for points on no target.
    """
    local, moment = state.points[problem.point], problem.moment
    arm, displacement, world = np.zeros(local.shape), np.zeros((len(local), 6)), local.copy()
    on_target = moment >= 0
    arm[on_target] = np.einsum("nij,nj->ni", state.target_R[moment[on_target]], local[on_target])
    world[on_target] = arm[on_target] + state.target_t[moment[on_target]]
    is_late = problem.lag >= 0
    lag, path = state.lags[problem.lag[is_late], None], state.target_paths[moment[is_late]]
    displacement[is_late] = lag * path[:, 0] + lag**2 * path[:, 1]
    return world, arm, displacement


def residual_px(problem: Problem, state: State) -> Array:
    """Return measured minus projected pixels (n, 2) [px]; NaN behind the camera."""
    i = problem.camera
    return problem.px - project(
        state.R[i],
        state.centre[i],
        state.intrinsics[i],
        is_fisheye=problem.is_fisheye[i],
        world=world_points(problem, state),
    )


def length_residual_m(problem: Problem, state: State) -> Array:
    """Return measured minus estimated lengths (k,) [m]."""
    ends = state.points[problem.length_ends]
    return problem.length_m - np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1)


def jacobian_of(problem: Problem, state: State) -> Jacobian:
    """Return the derivatives of the projections and lengths by the free parameters."""
    i, layout = problem.camera, problem.layout
    world, arm, displacement = _points_at_moments(problem, state)
    world = world + np.cross(displacement[:, :3], arm) + displacement[:, 3:]
    _, by_camera, by_world = project_with_jacobian(
        state.R[i], state.centre[i], state.intrinsics[i], is_fisheye=problem.is_fisheye[i], world=world
    )
    ratio = np.where(problem.is_square, state.intrinsics[:, 1] / state.intrinsics[:, 0], 0.0)
    by_camera[:, :, 6] += by_camera[:, :, 7] * ratio[i, None]
    by_other = np.zeros((len(i), 2, 7))
    by_other[:, :, :3] = by_world
    on_target = np.flatnonzero(problem.moment >= 0)
    if len(on_target):
        by_arm = by_world[on_target] + by_world[on_target] @ cross_matrices(displacement[on_target, :3])
        by_other[on_target, :, :3] = -by_arm @ cross_matrices(arm[on_target])
        by_other[on_target, :, 3:6] = by_world[on_target]
    late = np.flatnonzero(problem.lag >= 0)
    if len(late):
        path = state.target_paths[problem.moment[late]]
        rate = path[:, 0] + 2 * state.lags[problem.lag[late], None] * path[:, 1]
        by_other[late, :, 6] = np.einsum("nij,nj->ni", by_world[late], np.cross(rate[:, :3], arm[late]) + rate[:, 3:])
    ends = state.points[problem.length_ends]
    along = (ends[:, 1] - ends[:, 0]) / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1)[:, None]
    return Jacobian(
        by_camera=by_camera[:, :, layout.parameters],
        by_other=by_other[:, :, layout.other_parameters],
        by_ends=np.concatenate([-along, along], axis=1),
    )


def normal_equations(layout: Layout, jacobian: Jacobian, row_weights: Array, residuals: Array) -> NormalEquations:
    """Return the normal equations of rows with weights (rows,) and residuals (rows,), 0 for missing ones.

    Two rows an observation, then one a length, one a lag.
    """
    n, k = 2 * len(layout.order), len(layout.ends)
    weights, r = np.split(row_weights, [n, n + k]), np.split(row_weights * residuals, [n, n + k])
    by_other = np.swapaxes(jacobian.by_other, 1, 2)
    weighted = jacobian.by_other * weights[0].reshape(-1, 2, 1)
    ends = jacobian.by_ends
    others = [
        layout.sum_groups(by_other @ weighted),
        ends[:, :, None] * (weights[1][:, None] * ends)[:, None],
        weights[2],
    ]
    coupling = layout.sum_groups(np.swapaxes(jacobian.by_camera, 1, 2) @ weighted)
    pixels = r[0].reshape(-1, 2, 1)
    return NormalEquations(
        cameras=camera_equations(layout, jacobian, row_weights),
        coupling=layout.couple(coupling),
        others=layout.others.matrix(others),
        diagonal=layout.others.diagonal,
        camera_rhs=layout.sum_cameras((jacobian.by_camera * pixels).sum(axis=1)),
        other_rhs=layout.sum_others((jacobian.by_other * pixels).sum(axis=1), ends * r[1][:, None], r[2]),
    )


def camera_equations(layout: Layout, jacobian: Jacobian, row_weights: Array) -> Array:
    """Return the cameras' block of the normal equations: (camera columns, camera columns)."""
    n, total = layout.n_camera_columns, np.zeros((layout.n_camera_columns + 1,) * 2)
    by_camera, weights = jacobian.by_camera[layout.order], row_weights[: 2 * len(layout.order)].reshape(-1, 2, 1)
    weighted = weights[layout.order] * by_camera
    for columns, first, end in zip(layout.cameras, layout.camera_starts, layout.camera_starts[1:], strict=False):
        J, weighted_J = (part[first:end].reshape(2 * (end - first), len(columns)) for part in (by_camera, weighted))
        total[np.ix_(columns, columns)] += J.T @ weighted_J  # the last row and column: -1, of what is fixed
    return total[:n, :n]


def gauge_directions(problem: Problem, state: State, normal: NormalEquations, reduced: Array) -> Array:
    """Return the gauge freedoms (camera columns, k): motions and scalings of the whole rig that change no residual.

    Of the seven infinitesimal similarities of the world, those that move no fixed parameter and that lie in the null
    space of the reduced camera matrix (camera columns squared); the columns are orthonormal.
    """
    n = len(state.R)
    generators = np.zeros((n, N_PARAMETERS, 7))
    arm = state.centre - state.centre.mean(axis=0)
    generators[:, 3:6, :3] = np.eye(3)
    generators[:, :3, 3:6] = -state.R
    generators[:, 3:6, 3:6] = -cross_matrices(arm)
    generators[:, 3:6, 6] = arm
    is_fixed = problem.camera_columns < 0
    fixed = generators[is_fixed]
    fixed = fixed[np.abs(fixed).max(axis=1) > 1e-9]
    if len(fixed):
        _, size, directions = np.linalg.svd(fixed, full_matrices=True)
        rank = int((size > 1e-9 * size[0]).sum())
        generators = generators @ directions[rank:].T
    directions_of_cameras = np.zeros((problem.n_camera_columns, generators.shape[2]))
    directions_of_cameras[problem.camera_columns[~is_fixed]] = generators[~is_fixed]
    directions_of_cameras = directions_of_cameras[:, np.linalg.norm(directions_of_cameras, axis=0) > 1e-12]
    if directions_of_cameras.shape[1] == 0:
        return directions_of_cameras
    scale = np.sqrt(np.maximum(np.diag(normal.cameras), 1e-30))
    scaled, _ = np.linalg.qr(scale[:, None] * directions_of_cameras)
    eigenvalues, eigenvectors = np.linalg.eigh(scaled.T @ (reduced / scale[:, None] / scale) @ scaled)
    null_space = (scaled @ eigenvectors)[:, eigenvalues < _GAUGE_TOLERANCE] / scale[:, None]
    return np.linalg.qr(null_space)[0] if null_space.shape[1] else null_space


def rotation_vectors_from(start: Array, now: Array) -> Array:
    """Return the rotation vectors (n, 3) [rad] from start to now (n, 3, 3), about the camera's own axes."""
    return Rotation.from_matrix(now @ np.swapaxes(start, 1, 2)).as_rotvec()
