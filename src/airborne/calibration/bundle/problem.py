"""All sources as one set of arrays, with a column of the equations for every free parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration.bundle.layout import Layout, columns_of_rows, number_parameters
from airborne.calibration.bundle.lenses import intrinsics_of
from airborne.calibration.bundle.source import FreeParameters, Source
from airborne.cameras.camera import Camera, Rig
from airborne.types import Array, Ints


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """The values of all parameters, free and fixed."""

    R: Array  # (cameras, 3, 3) camera from world
    centre: Array  # (cameras, 3) [m]
    intrinsics: Array  # (cameras, 12) fx, fy, cx, cy [px], lens terms
    target_R: Array  # (m, 3, 3) world from target
    target_t: Array  # (m, 3) [m]
    points: Array  # (p, 3) [m], in the world or in a target's axes
    lags: Array  # (l,) [s]
    target_paths: Array  # (m, 2, 6): rotation about the world's axes [rad] and shift [m], per s and per s^2


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """The observations of all sources, one after another, and the columns of the free parameters.

    A camera's columns count from 0; those of targets and points, which are eliminated, count from 0 again. -1: fixed.
    """

    is_fisheye: NDArray[np.bool_]  # (cameras,)
    camera: Ints  # (n,)
    moment: Ints  # (n,)
    point: Ints  # (n,)
    px: Array  # (n, 2)
    sd_px: Array  # (n,)
    source: Ints  # (n,)
    cluster: Ints  # (n,), numbered over all sources; -1: none
    is_used: NDArray[np.bool_]  # (n,) whether the observation constrains the unknowns
    layout: Layout
    camera_columns: Ints  # (cameras, 18)
    target_columns: Ints  # (m, 6): rotation about the world's axes [rad], shift [m]
    point_columns: Ints  # (p, 3)
    source_of_column: Ints  # of targets' and points' columns
    length_ends: Ints  # (k, 2) rows of points
    length_m: Array  # (k,)
    length_sd_m: Array  # (k,)
    length_source: Ints  # (k,)
    lag: Ints  # (n,) rows of lags, -1: none
    lag_sd_s: Array  # (l,)
    lag_source: Ints  # (l,)
    time_s: Array  # (m,) of each moment; NaN without lags [s]

    @property
    def n_camera_columns(self) -> int:
        """How many camera parameters are free."""
        return self.layout.n_camera_columns

    @property
    def is_square(self) -> NDArray[np.bool_]:
        """Which cameras' focal lengths share a column, so that their ratio stays: (cameras,)."""
        fx, fy = self.camera_columns[:, 6:8].T
        return (fx >= 0) & (fx == fy)

    @property
    def n_other_columns(self) -> int:
        """How many parameters of targets, points and lags are free."""
        return len(self.source_of_column)


def build_problem(rig: Rig, sources: Sequence[Source], free_parameters: Mapping[str, FreeParameters]) -> Problem:
    """Stack the sources and number the free parameters."""
    moments = np.cumsum([0, *(source.n_moments for source in sources)])
    points = np.cumsum([0, *(len(source.points) for source in sources)])
    moment = _concatenate([np.where(s.moments < 0, -1, s.moments + m) for s, m in zip(sources, moments, strict=False)])
    point = _concatenate([s.point + p for s, p in zip(sources, points, strict=False)])
    camera = _concatenate([s.camera for s in sources])
    lengths = [(i, s.lengths, points[i]) for i, s in enumerate(sources) if s.lengths is not None]
    ends = [np.stack([x.first, x.second], axis=1) + p for _, x, p in lengths]
    length_ends = np.concatenate([np.zeros((0, 2), int), *ends])
    free = np.concatenate([np.zeros((0, 3), bool), *(s.free_coordinates for s in sources)])
    free &= _is_determined(free, camera=camera, moment=moment, point=point, ends=length_ends)[:, None]
    is_fixed = np.concatenate([np.zeros(0, bool), *(s.targets_of_fixed_points for s in sources)])
    target_columns, point_columns, n_others = _other_columns(is_fixed, free, moment)
    lag, lag_sd_s, lag_source = _lags(sources)
    source_of_column = np.concatenate([np.zeros(n_others, int), lag_source])
    for i, _ in enumerate(sources):
        for columns, first in ((target_columns, moments), (point_columns, points)):
            own = columns[first[i] : first[i + 1]]
            source_of_column[own[own >= 0]] = i
    camera_columns, lag_columns = number_parameters(rig, free_parameters), n_others + np.arange(len(lag_sd_s))
    layout = Layout.of(
        camera,
        camera_columns=camera_columns,
        other=columns_of_rows(moment, point, lag, of_target=target_columns, of_point=point_columns, of_lag=lag_columns),
        ends=point_columns[length_ends].reshape(-1, 6),
        lags=lag_columns,
        n_others=len(source_of_column),
    )
    is_free_point = np.concatenate([np.zeros(0, bool), *(s.free_coordinates.any(axis=1) for s in sources)])
    is_undetermined = (is_free_point & (point_columns < 0).all(axis=1))[point]
    return Problem(
        is_fisheye=np.array([c.lens == "fisheye" for c in rig]),
        camera=camera,
        moment=moment,
        point=point,
        px=np.concatenate([np.zeros((0, 2)), *(s.px for s in sources)]),
        sd_px=np.concatenate([np.zeros(0), *(np.broadcast_to(s.sd_px, len(s.px)) for s in sources)]),
        source=np.repeat(np.arange(len(sources)), [len(s.px) for s in sources]),
        cluster=_clusters(sources),
        is_used=~is_undetermined,
        layout=layout,
        camera_columns=camera_columns,
        target_columns=target_columns,
        point_columns=point_columns,
        source_of_column=source_of_column,
        length_ends=length_ends,
        length_m=np.concatenate([np.zeros(0), *(x.length_m for _, x, _ in lengths)]),
        length_sd_m=np.concatenate([np.zeros(0), *(np.broadcast_to(x.sd_m, len(x.first)) for _, x, _ in lengths)]),
        lag=lag,
        lag_sd_s=lag_sd_s,
        lag_source=lag_source,
        time_s=np.concatenate([np.zeros(0), *(_times(s) for s in sources)]),
        length_source=np.repeat([i for i, _, _ in lengths], [len(x.first) for _, x, _ in lengths]).astype(int),
    )


def initial_state(rig: Rig, sources: Sequence[Source], problem: Problem) -> State:
    """Return the initial values as arrays."""
    targets = [s.world_from_target for s in sources if s.world_from_target is not None]
    state = State(
        R=np.stack([c.camera_from_world.rotation.as_matrix() for c in rig]),
        centre=np.stack([c.centre for c in rig]),
        intrinsics=np.stack([intrinsics_of(c) for c in rig]),
        target_R=np.concatenate([np.zeros((0, 3, 3)), *(t.rotation.as_matrix() for t in targets)]),
        target_t=np.concatenate([np.zeros((0, 3)), *(t.translation for t in targets)]),
        points=np.concatenate([np.zeros((0, 3)), *(s.points for s in sources)]).astype(float),
        lags=np.zeros(len(problem.lag_sd_s)),
        target_paths=np.zeros((len(problem.time_s), 2, 6)),
    )
    return with_target_paths(problem, state)


def with_target_paths(problem: Problem, state: State) -> State:
    """Return the state with each target's path about its moment: the parabola through the moments before and after.

    A straight line where only one neighbour is seen; at rest where none is, or without lags.
    """
    is_known = np.isfinite(problem.time_s) & np.isin(np.arange(len(problem.time_s)), problem.moment)
    paths = np.zeros((len(problem.time_s), 2, 6))
    for m in np.flatnonzero(is_known):
        neighbours = [
            i
            for i in (m - 1, m + 1)
            if 0 <= i < len(is_known) and is_known[i] and problem.time_s[i] != problem.time_s[m]
        ]
        if neighbours:
            rotation = Rotation.from_matrix(state.target_R[neighbours] @ state.target_R[m].T).as_rotvec()
            change = np.concatenate([rotation, state.target_t[neighbours] - state.target_t[m]], axis=1)
            time_s = problem.time_s[neighbours] - problem.time_s[m]
            powers = time_s[:, None] ** np.arange(1, len(neighbours) + 1)
            paths[m, : len(neighbours)] = np.linalg.solve(powers, change)
    return replace(state, target_paths=paths)


def apply_step(problem: Problem, state: State, step: Array, other_step: Array) -> State:
    """Return the state after a step in the cameras' columns and one in the others'."""
    change = _step_of(step, problem.camera_columns)
    target, point = _step_of(other_step, problem.target_columns), _step_of(other_step, problem.point_columns)
    return replace(
        state,
        R=Rotation.from_rotvec(change[:, :3]).as_matrix() @ state.R,
        centre=state.centre + change[:, 3:6],
        intrinsics=state.intrinsics + _keep_focal_ratio(state, change[:, 6:], problem.is_square),
        target_R=Rotation.from_rotvec(target[:, :3]).as_matrix() @ state.target_R if len(target) else state.target_R,
        target_t=state.target_t + target[:, 3:],
        points=state.points + point,
        lags=state.lags + _step_of(other_step, problem.layout.lags),
    )


def rig_from_state(rig: Rig, state: State) -> Rig:
    """Return the cameras with the state's parameters."""
    return Rig(tuple(_camera(camera, state, i) for i, camera in enumerate(rig)))


def sources_from_state(sources: Sequence[Source], state: State) -> tuple[Source, ...]:
    """Return the sources with the state's points and targets."""
    updated, m, p = [], 0, 0
    for source in sources:
        moments, points = slice(m, m + source.n_moments), slice(p, p + len(source.points))
        targets = None
        if source.n_moments:
            rotation = Rotation.from_matrix(state.target_R[moments])
            targets = RigidTransform.from_components(state.target_t[moments], rotation)
        updated.append(replace(source, points=state.points[points], world_from_target=targets))
        m, p = moments.stop, points.stop
    return tuple(updated)


def _camera(camera: Camera, state: State, i: int) -> Camera:
    fx, fy, cx, cy, *terms = state.intrinsics[i]
    R = state.R[i]
    return replace(
        camera,
        K=np.array([[fx, camera.K[0, 1], cx], [0, fy, cy], [0, 0, 1]]),
        camera_from_world=RigidTransform.from_components(-R @ state.centre[i], Rotation.from_matrix(R)),
        distortion=np.array(terms[: len(camera.distortion)]),
    )


def _concatenate(columns: Sequence[Ints]) -> Ints:
    return np.concatenate([np.zeros(0, int), *columns])


def _step_of(step: Array, columns: Ints) -> Array:
    """Return each parameter's step, 0 where it is fixed; the shape is that of columns."""
    return np.append(step, 0.0)[columns]


def _keep_focal_ratio(state: State, change: Array, is_square: NDArray[np.bool_]) -> Array:
    """Preserve the ratio of the focal lengths where they share a column; change (cameras, 12)."""
    ratio = state.intrinsics[:, 1] / state.intrinsics[:, 0]
    change = change.copy()
    change[:, 1] = np.where(is_square, change[:, 0] * ratio, change[:, 1])
    return change


def _is_determined(
    free: NDArray[np.bool_], *, camera: Ints, moment: Ints, point: Ints, ends: Ints
) -> NDArray[np.bool_]:
    """Say which points (p,) are determined: each view gives two equations, each length one."""
    pairs = np.unique(np.stack([point[moment < 0], camera[moment < 0]], axis=1), axis=0)
    n_views = np.bincount(pairs[:, 0], minlength=len(free))
    n_lengths = np.bincount(ends.ravel(), minlength=len(free))
    return (n_views > 0) & (2 * n_views + n_lengths >= free.sum(axis=1))


def _other_columns(is_fixed: NDArray[np.bool_], free: NDArray[np.bool_], moment: Ints) -> tuple[Ints, Ints, int]:
    is_seen = np.isin(np.arange(len(is_fixed)), moment)
    moves = np.repeat((~is_fixed & is_seen)[:, None], 6, axis=1)
    targets, points = np.full(moves.shape, -1), np.full(free.shape, -1)
    targets[moves] = np.arange(moves.sum())
    points[free] = np.arange(free.sum()) + moves.sum()
    return targets, points, int(moves.sum() + free.sum())


def _clusters(sources: Sequence[Source]) -> Ints:
    clusters, n = [], 0
    for source in sources:
        if source.cluster is None:
            clusters.append(np.full(len(source.px), -1))
            continue
        _, own = np.unique(source.cluster, return_inverse=True)
        clusters.append(own + n)
        n += int(own.max(initial=-1)) + 1
    return _concatenate(clusters)


def _lags(sources: Sequence[Source]) -> tuple[Ints, Array, Ints]:
    """Return every observation's lag (n,), the lags' standard deviations (l,) and sources (l,)."""
    lags, sds, owners, n = [], [np.zeros(0)], [np.zeros(0, int)], 0
    for i, source in enumerate(sources):
        own = np.full(len(source.px), -1)
        if source.lags is not None:
            is_late = source.lags.group >= 0
            groups, rows = np.unique(source.lags.group[is_late], return_inverse=True)
            own[is_late] = rows + n
            n += len(groups)
            sds.append(np.full(len(groups), source.lags.sd_s))
            owners.append(np.full(len(groups), i))
        lags.append(own)
    return _concatenate(lags), np.concatenate(sds), np.concatenate(owners)


def _times(source: Source) -> Array:
    return np.full(source.n_moments, np.nan) if source.lags is None else source.lags.time_s
