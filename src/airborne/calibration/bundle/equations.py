"""Residuals, their Jacobian, the normal equations, and the Schur complement that eliminates points and targets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array, diags_array
from scipy.sparse.linalg import SuperLU, splu
from scipy.spatial.transform import Rotation

from airborne.calibration.bundle.lenses import N_PARAMETERS, cross_matrices, project, project_with_jacobian
from airborne.calibration.bundle.problem import Problem, State
from airborne.types import Array, Ints

_GAUGE_TOLERANCE = 1e-9  # of the camera's own curvature: below it, a direction counts as unobserved
_RIDGE = 1e-13  # of a diagonal: regularises unobserved parameters


@dataclass(frozen=True, slots=True, eq=False)
class Jacobian:
    """Derivatives of the residuals' predictions, unweighted: two rows an observation, then one a length, one a lag."""

    by_camera: csr_array  # (rows, camera columns)
    by_other: csr_array  # (rows, other columns)


@dataclass(frozen=True, slots=True, eq=False)
class NormalEquations:
    """The normal equations in blocks: cameras, others, and their coupling."""

    cameras: Array  # (c, c)
    coupling: Array  # (c, o)
    others: csc_array  # (o, o)
    camera_rhs: Array  # (c,), minus the gradient
    other_rhs: Array  # (o,)

    def reduce(self, damping: float) -> tuple[Array, Array, SuperLU | None, Array]:
        """Eliminate the others by their Schur complement.

        Return the reduced camera matrix and right-hand side, the others' factors, and `others^-1 coupling^T`.
        """
        cameras = self.cameras + damping * np.diag(np.diag(self.cameras))
        if not len(self.other_rhs):
            return cameras, self.camera_rhs, None, np.zeros((0, len(cameras)))
        diagonal = self.others.diagonal()
        factors = splu(
            csc_array(self.others + diags_array(diagonal * (damping + _RIDGE) + 1e-30)),
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
    """Return the derivatives of the projections, lengths and lags by the free parameters."""
    i, n, k = problem.camera, len(problem.px), len(problem.length_m)
    n_rows = 2 * n + k + len(problem.lag_sd_s)
    world, arm, displacement = _points_at_moments(problem, state)
    world = world + np.cross(displacement[:, :3], arm) + displacement[:, 3:]
    _, by_camera, by_world = project_with_jacobian(
        state.R[i], state.centre[i], state.intrinsics[i], is_fisheye=problem.is_fisheye[i], world=world
    )
    by_camera[:, :, 7] *= _focal_ratio(problem, state)[i, None]
    entries = [_entries(by_camera, np.broadcast_to(problem.camera_columns[i][:, None], by_camera.shape), np.arange(n))]
    cameras = _matrix(entries, n_rows, problem.n_camera_columns)
    others = []
    on_target = np.flatnonzero(problem.moment >= 0)
    if len(on_target):
        by_arm = by_world[on_target] + by_world[on_target] @ cross_matrices(displacement[on_target, :3])
        by_target = np.concatenate([-by_arm @ cross_matrices(arm[on_target]), by_world[on_target]], axis=2)
        columns = problem.target_columns[problem.moment[on_target]]
        others.append(_entries(by_target, np.broadcast_to(columns[:, None], by_target.shape), on_target))
    in_world = np.flatnonzero((problem.moment < 0) & (problem.point_columns[problem.point] >= 0).any(axis=1))
    if len(in_world):
        columns = problem.point_columns[problem.point[in_world]]
        others.append(_entries(by_world[in_world], np.broadcast_to(columns[:, None], (len(in_world), 2, 3)), in_world))
    late = np.flatnonzero(problem.lag >= 0)
    if len(late):
        path = state.target_paths[problem.moment[late]]
        rate = path[:, 0] + 2 * state.lags[problem.lag[late], None] * path[:, 1]
        by_lag = by_world[late] @ (np.cross(rate[:, :3], arm[late]) + rate[:, 3:])[:, :, None]
        columns = problem.lag_columns[problem.lag[late]]
        others.append(_entries(by_lag, np.broadcast_to(columns[:, None, None], by_lag.shape), late))
        lags = np.arange(len(problem.lag_sd_s))
        others.append((np.ones(len(lags)), 2 * n + k + lags, problem.lag_columns))
    if k:
        ends = state.points[problem.length_ends]
        along = (ends[:, 1] - ends[:, 0]) / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1)[:, None]
        rows = np.repeat(2 * n + np.arange(k)[:, None], 3, axis=1)
        for values, end in ((-along, 0), (along, 1)):
            others.append((values, rows, problem.point_columns[problem.length_ends[:, end]]))
    return Jacobian(cameras, _matrix(others, n_rows, problem.n_other_columns))


def normal_equations(jacobian: Jacobian, row_weights: Array, residuals: Array) -> NormalEquations:
    """Return the normal equations of rows with weights (rows,) and residuals (rows,), 0 for missing ones."""
    weighted = _scale_rows(jacobian.by_camera, row_weights)
    weighted_others = _scale_rows(jacobian.by_other, row_weights)
    return NormalEquations(
        cameras=(jacobian.by_camera.T @ weighted).toarray(),
        coupling=(weighted.T @ jacobian.by_other).toarray(),
        others=csc_array(jacobian.by_other.T @ weighted_others),
        camera_rhs=weighted.T @ residuals,
        other_rhs=weighted_others.T @ residuals,
    )


def _scale_rows(rows: csr_array, weights: Array) -> csr_array:
    """Return every row times its weight."""
    data = rows.data * np.repeat(weights, np.diff(rows.indptr))
    return csr_array((data, rows.indices, rows.indptr), shape=rows.shape)


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


def _focal_ratio(problem: Problem, state: State) -> Array:
    """Return fy / fx where they share a column, else 1: (cameras,)."""
    columns = problem.camera_columns
    is_square = (columns[:, 6] >= 0) & (columns[:, 6] == columns[:, 7])
    return np.where(is_square, state.intrinsics[:, 1] / state.intrinsics[:, 0], 1.0)


def _entries(values: Array, columns: Ints, observation: Ints) -> tuple[Array, Ints, Ints]:
    rows = 2 * observation[:, None, None] + np.arange(2)[None, :, None]
    return values, np.broadcast_to(rows, values.shape), columns


def _matrix(entries: list[tuple[Array, Ints, Ints]], n_rows: int, n_columns: int) -> csr_array:
    values, rows, columns = (
        np.concatenate([np.zeros(0), *(np.ravel(entry[part]) for entry in entries)]) for part in range(3)
    )
    keep = columns >= 0
    shape = (n_rows, n_columns)
    return csr_array(coo_array((values[keep], (rows[keep].astype(int), columns[keep].astype(int))), shape=shape))
