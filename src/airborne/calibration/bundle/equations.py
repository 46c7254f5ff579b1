"""Residuals, their normal equations, and the unknowns eliminated that only one source knows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array, diags_array
from scipy.sparse.linalg import SuperLU, splu
from scipy.spatial.transform import Rotation

from airborne.calibration.bundle.lenses import N_PARAMETERS, cross_matrices, project, project_with_jacobian
from airborne.calibration.bundle.problem import Problem, State
from airborne.types import Array, Ints

_GAUGE_TOLERANCE = 1e-9  # of what a camera's own pixels resist: less is rounding
_RIDGE = 1e-13  # of a diagonal: keeps what no observation tells from dividing by zero


@dataclass(frozen=True, slots=True, eq=False)
class Jacobian:
    """Derivatives, two rows an observation, then one a length, then one a lag; not weighted."""

    by_camera: csr_array  # (rows, camera columns)
    by_other: csr_array  # (rows, other columns)


@dataclass(frozen=True, slots=True, eq=False)
class NormalEquations:
    """The normal equations: cameras, others, and what couples them."""

    cameras: Array  # (c, c)
    coupling: Array  # (c, o)
    others: csc_array  # (o, o)
    camera_rhs: Array  # (c,), minus the gradient
    other_rhs: Array  # (o,)

    def reduce(self, damping: float) -> tuple[Array, Array, SuperLU | None, Array]:
        """Eliminate the others: the cameras' matrix and side, the others' factors, and `others^-1 coupling^T`."""
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


def world_points(task: Problem, state: State) -> Array:
    """Return where in the world every observed point is, when it is looked at: (n, 3) [m]."""
    world, arm, motion = _points_at_moments(task, state)
    return world + np.cross(motion[:, :3], arm) + motion[:, 3:]


def _points_at_moments(task: Problem, state: State) -> tuple[Array, Array, Array]:
    """Return points (n, 3) at their moments, their arms from their targets' origins, and the motion (n, 6) since.

    The motion is a small turn and a shift; arms and motions are 0 for points that are on no target.
    """
    local, moment = state.points[task.point], task.moment
    arm, motion, world = np.zeros(local.shape), np.zeros((len(local), 6)), local.copy()
    on = moment >= 0
    arm[on] = np.einsum("nij,nj->ni", state.target_R[moment[on]], local[on])
    world[on] = arm[on] + state.target_t[moment[on]]
    late = task.lag >= 0
    lag, path = state.lags[task.lag[late], None], state.target_paths[moment[late]]
    motion[late] = lag * path[:, 0] + lag**2 * path[:, 1]
    return world, arm, motion


def residual_px(task: Problem, state: State) -> Array:
    """Return measured minus projected pixels (n, 2) [px]; NaN behind the camera."""
    i = task.camera
    return task.px - project(
        state.R[i], state.centre[i], state.intrinsics[i], task.is_fisheye[i], world_points(task, state)
    )


def length_residual_m(task: Problem, state: State) -> Array:
    """Return known minus found lengths (k,) [m]."""
    ends = state.points[task.length_ends]
    return task.length_m - np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1)


def jacobian_of(task: Problem, state: State) -> Jacobian:
    """Return the derivatives of the projections and lengths to the free numbers."""
    i, n, k = task.camera, len(task.px), len(task.length_m)
    n_rows = 2 * n + k + len(task.lag_sd_s)
    world, arm, motion = _points_at_moments(task, state)
    world = world + np.cross(motion[:, :3], arm) + motion[:, 3:]
    _, by_camera, by_world = project_with_jacobian(
        state.R[i], state.centre[i], state.intrinsics[i], task.is_fisheye[i], world
    )
    by_camera[:, :, 7] *= _focal_ratio(task, state)[i, None]
    entries = [_entries(by_camera, np.broadcast_to(task.camera_columns[i][:, None], by_camera.shape), np.arange(n))]
    cameras = _matrix(entries, n_rows, task.n_camera_columns)
    others = []
    on = np.flatnonzero(task.moment >= 0)
    if len(on):
        by_arm = by_world[on] + by_world[on] @ cross_matrices(motion[on, :3])
        by_target = np.concatenate([-by_arm @ cross_matrices(arm[on]), by_world[on]], axis=2)
        columns = task.target_columns[task.moment[on]]
        others.append(_entries(by_target, np.broadcast_to(columns[:, None], by_target.shape), on))
    off = np.flatnonzero((task.moment < 0) & (task.point_columns[task.point] >= 0).any(axis=1))
    if len(off):
        columns = task.point_columns[task.point[off]]
        others.append(_entries(by_world[off], np.broadcast_to(columns[:, None], (len(off), 2, 3)), off))
    late = np.flatnonzero(task.lag >= 0)
    if len(late):
        path = state.target_paths[task.moment[late]]
        rate = path[:, 0] + 2 * state.lags[task.lag[late], None] * path[:, 1]
        by_lag = by_world[late] @ (np.cross(rate[:, :3], arm[late]) + rate[:, 3:])[:, :, None]
        columns = task.lag_columns[task.lag[late]]
        others.append(_entries(by_lag, np.broadcast_to(columns[:, None, None], by_lag.shape), late))
        lags = np.arange(len(task.lag_sd_s))
        others.append((np.ones(len(lags)), 2 * n + k + lags, task.lag_columns))
    if k:
        ends = state.points[task.length_ends]
        along = (ends[:, 1] - ends[:, 0]) / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1)[:, None]
        rows = np.repeat(2 * n + np.arange(k)[:, None], 3, axis=1)
        for values, end in ((-along, 0), (along, 1)):
            others.append((values, rows, task.point_columns[task.length_ends[:, end]]))
    return Jacobian(cameras, _matrix(others, n_rows, task.n_other_columns))


def normal_equations(slopes: Jacobian, row_weights: Array, residuals: Array) -> NormalEquations:
    """Return the normal equations of rows with weights (rows,) and residuals (rows,), 0 where nothing is known."""
    weighted = _scale_rows(slopes.by_camera, row_weights)
    weighted_others = _scale_rows(slopes.by_other, row_weights)
    return NormalEquations(
        cameras=(slopes.by_camera.T @ weighted).toarray(),
        coupling=(weighted.T @ slopes.by_other).toarray(),
        others=csc_array(slopes.by_other.T @ weighted_others),
        camera_rhs=weighted.T @ residuals,
        other_rhs=weighted_others.T @ residuals,
    )


def _scale_rows(rows: csr_array, weights: Array) -> csr_array:
    """Return every row times its weight."""
    data = rows.data * np.repeat(weights, np.diff(rows.indptr))
    return csr_array((data, rows.indices, rows.indptr), shape=rows.shape)


def gauge_directions(task: Problem, state: State, normal: NormalEquations, reduced: Array) -> Array:
    """Return the directions (camera columns, k) in which the rig moves or grows as a whole and nothing is measured.

    Of the seven small similarities of the world those are kept that move no held number and that the reduced normal
    equations (camera columns squared) do not resist; the columns are orthonormal.
    """
    n = len(state.R)
    generators = np.zeros((n, N_PARAMETERS, 7))
    about = state.centre - state.centre.mean(axis=0)
    generators[:, 3:6, :3] = np.eye(3)
    generators[:, :3, 3:6] = -state.R
    generators[:, 3:6, 3:6] = -cross_matrices(about)
    generators[:, 3:6, 6] = about
    is_held = task.camera_columns < 0
    held = generators[is_held]
    held = held[np.abs(held).max(axis=1) > 1e-9]
    if len(held):
        _, size, directions = np.linalg.svd(held, full_matrices=True)
        rank = int((size > 1e-9 * size[0]).sum())
        generators = generators @ directions[rank:].T
    moved = np.zeros((task.n_camera_columns, generators.shape[2]))
    moved[task.camera_columns[~is_held]] = generators[~is_held]
    moved = moved[:, np.linalg.norm(moved, axis=0) > 1e-12]
    if moved.shape[1] == 0:
        return moved
    stiff = np.sqrt(np.maximum(np.diag(normal.cameras), 1e-30))
    scaled, _ = np.linalg.qr(stiff[:, None] * moved)
    resistance, turn = np.linalg.eigh(scaled.T @ (reduced / stiff[:, None] / stiff) @ scaled)
    loose = (scaled @ turn)[:, resistance < _GAUGE_TOLERANCE] / stiff[:, None]
    return np.linalg.qr(loose)[0] if loose.shape[1] else loose


def rotation_vectors_from(start: Array, now: Array) -> Array:
    """Return the rotation vectors (n, 3) [rad] by which matrices moved on, about the camera's own axes."""
    return Rotation.from_matrix(now @ np.swapaxes(start, 1, 2)).as_rotvec()


def _focal_ratio(task: Problem, state: State) -> Array:
    """Return fy / fx where they share a column, else 1: (cameras,)."""
    columns = task.camera_columns
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
