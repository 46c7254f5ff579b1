"""All sources as one list of arrays, and a column of the equations for every number that is free."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration.bundle.lenses import N_PARAMETERS
from airborne.calibration.bundle.source import FreeParameters, Source
from airborne.cameras.camera import Camera, Rig
from airborne.types import Array, Ints


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """The value of every number that may be free, and of those that are not."""

    R: Array  # (cameras, 3, 3) camera from world
    centre: Array  # (cameras, 3) [m]
    intrinsics: Array  # (cameras, 9) fx, fy, cx, cy [px], lens terms
    target_R: Array  # (m, 3, 3) world from target
    target_t: Array  # (m, 3) [m]
    points: Array  # (p, 3) [m], in the world or in a target's axes
    lags: Array  # (l,) [s]
    target_paths: Array  # (m, 2, 6): turn about the world's axes [rad] and shift [m] a second, and a square second


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """What is measured, all sources after each other, and which numbers are free.

    A camera's columns count from 0; those of targets and points, which are eliminated, count from 0 again. -1: held.
    """

    is_fisheye: NDArray[np.bool_]  # (cameras,)
    camera: Ints  # (n,)
    moment: Ints  # (n,)
    point: Ints  # (n,)
    px: Array  # (n, 2)
    sd_px: Array  # (n,)
    source: Ints  # (n,)
    cluster: Ints  # (n,), numbered over all sources; -1: none
    is_used: NDArray[np.bool_]  # (n,) whether the observation says anything about the unknowns
    camera_columns: Ints  # (cameras, 15)
    target_columns: Ints  # (m, 6): turn about the world's axes [rad], shift [m]
    point_columns: Ints  # (p, 3)
    source_of_column: Ints  # of targets' and points' columns
    length_ends: Ints  # (k, 2) rows of points
    length_m: Array  # (k,)
    length_sd_m: Array  # (k,)
    length_source: Ints  # (k,)
    lag: Ints  # (n,) rows of lags, -1: none
    lag_columns: Ints  # (l,)
    lag_sd_s: Array  # (l,)
    lag_source: Ints  # (l,)
    time_s: Array  # (m,) of each moment; NaN where nobody asks [s]

    @property
    def n_camera_columns(self) -> int:
        """How many numbers of cameras are free."""
        return int(self.camera_columns.max(initial=-1)) + 1

    @property
    def n_other_columns(self) -> int:
        """How many numbers of targets and points are free."""
        return len(self.source_of_column)


def build_problem(rig: Rig, sources: Sequence[Source], freedom: Mapping[str, FreeParameters]) -> Problem:
    """Return everything that is measured, with a number for everything that is free."""
    moments = np.cumsum([0, *(source.n_moments for source in sources)])
    points = np.cumsum([0, *(len(source.points) for source in sources)])
    moment = _concatenate([np.where(s.moments < 0, -1, s.moments + m) for s, m in zip(sources, moments, strict=False)])
    point = _concatenate([s.point + p for s, p in zip(sources, points, strict=False)])
    camera = _concatenate([s.camera for s in sources])
    lengths = [(i, s.lengths, points[i]) for i, s in enumerate(sources) if s.lengths is not None]
    ends = [np.stack([x.first, x.second], axis=1) + p for _, x, p in lengths]
    length_ends = np.concatenate([np.zeros((0, 2), int), *ends])
    free = np.concatenate([np.zeros((0, 3), bool), *(s.free_coordinates for s in sources)])
    free &= _is_determined(free, camera, moment, point, length_ends)[:, None]
    held = np.concatenate([np.zeros(0, bool), *(s.fixed_targets for s in sources)])
    target_columns, point_columns, n_others = _other_columns(held, free, moment)
    lag, lag_sd_s, lag_source = _lags(sources)
    source_of_column = np.concatenate([np.zeros(n_others, int), lag_source])
    for i, _ in enumerate(sources):
        for columns, first in ((target_columns, moments), (point_columns, points)):
            own = columns[first[i] : first[i + 1]]
            source_of_column[own[own >= 0]] = i
    is_free_point = np.concatenate([np.zeros(0, bool), *(s.free_coordinates.any(axis=1) for s in sources)])
    lost = (is_free_point & (point_columns < 0).all(axis=1))[point]
    return Problem(
        is_fisheye=np.array([c.lens == "fisheye" for c in rig]),
        camera=camera,
        moment=moment,
        point=point,
        px=np.concatenate([np.zeros((0, 2)), *(s.px for s in sources)]),
        sd_px=np.concatenate([np.zeros(0), *(np.broadcast_to(s.sd_px, len(s.px)) for s in sources)]),
        source=np.repeat(np.arange(len(sources)), [len(s.px) for s in sources]),
        cluster=_clusters(sources),
        is_used=~lost,
        camera_columns=_camera_columns(rig, freedom),
        target_columns=target_columns,
        point_columns=point_columns,
        source_of_column=source_of_column,
        length_ends=length_ends,
        length_m=np.concatenate([np.zeros(0), *(x.length_m for _, x, _ in lengths)]),
        length_sd_m=np.concatenate([np.zeros(0), *(np.broadcast_to(x.sd_m, len(x.first)) for _, x, _ in lengths)]),
        lag=lag,
        lag_columns=n_others + np.arange(len(lag_sd_s)),
        lag_sd_s=lag_sd_s,
        lag_source=lag_source,
        time_s=np.concatenate([np.zeros(0), *(_times(s) for s in sources)]),
        length_source=np.repeat([i for i, _, _ in lengths], [len(x.first) for _, x, _ in lengths]).astype(int),
    )


def initial_state(rig: Rig, sources: Sequence[Source], task: Problem) -> State:
    """Return the start as arrays."""
    targets = [s.world_from_target for s in sources if s.world_from_target is not None]
    state = State(
        R=np.stack([c.camera_from_world.rotation.as_matrix() for c in rig]),
        centre=np.stack([c.centre for c in rig]),
        intrinsics=np.stack(
            [
                [c.K[0, 0], c.K[1, 1], c.K[0, 2], c.K[1, 2], *np.pad(c.distortion, (0, 5 - len(c.distortion)))]
                for c in rig
            ]
        ),
        target_R=np.concatenate([np.zeros((0, 3, 3)), *(t.rotation.as_matrix() for t in targets)]),
        target_t=np.concatenate([np.zeros((0, 3)), *(t.translation for t in targets)]),
        points=np.concatenate([np.zeros((0, 3)), *(s.points for s in sources)]).astype(float),
        lags=np.zeros(len(task.lag_sd_s)),
        target_paths=np.zeros((len(task.time_s), 2, 6)),
    )
    return with_target_paths(task, state)


def with_target_paths(task: Problem, state: State) -> State:
    """Return the state with each target's way about its moment: the parabola through the moments before and after.

    A straight line where only one neighbour has been seen, standstill where none or where nobody asks for lags.
    """
    is_known = np.isfinite(task.time_s) & np.isin(np.arange(len(task.time_s)), task.moment)
    paths = np.zeros((len(task.time_s), 2, 6))
    for m in np.flatnonzero(is_known):
        near = [
            i for i in (m - 1, m + 1) if 0 <= i < len(is_known) and is_known[i] and task.time_s[i] != task.time_s[m]
        ]
        if near:
            turn = Rotation.from_matrix(state.target_R[near] @ state.target_R[m].T).as_rotvec()
            change = np.concatenate([turn, state.target_t[near] - state.target_t[m]], axis=1)
            time_s = task.time_s[near] - task.time_s[m]
            powers = time_s[:, None] ** np.arange(1, len(near) + 1)
            paths[m, : len(near)] = np.linalg.solve(powers, change)
    return replace(state, target_paths=paths)


def apply_step(task: Problem, state: State, step: Array, other_step: Array) -> State:
    """Return the state after a step of the cameras' columns and one of the others'."""
    change = _step_of(step, task.camera_columns)
    target, point = _step_of(other_step, task.target_columns), _step_of(other_step, task.point_columns)
    return replace(
        state,
        R=Rotation.from_rotvec(change[:, :3]).as_matrix() @ state.R,
        centre=state.centre + change[:, 3:6],
        intrinsics=state.intrinsics + _keep_focal_ratio(state, change[:, 6:], task.camera_columns),
        target_R=Rotation.from_rotvec(target[:, :3]).as_matrix() @ state.target_R if len(target) else state.target_R,
        target_t=state.target_t + target[:, 3:],
        points=state.points + point,
        lags=state.lags + _step_of(other_step, task.lag_columns),
    )


def rig_from_state(rig: Rig, state: State) -> Rig:
    """Return the cameras with the state's numbers."""
    return Rig(tuple(_camera(camera, state, i) for i, camera in enumerate(rig)))


def sources_from_state(sources: Sequence[Source], state: State) -> tuple[Source, ...]:
    """Return the sources with their points and targets where the state has them."""
    done, m, p = [], 0, 0
    for source in sources:
        moments, points = slice(m, m + source.n_moments), slice(p, p + len(source.points))
        targets = None
        if source.n_moments:
            rotation = Rotation.from_matrix(state.target_R[moments])
            targets = RigidTransform.from_components(state.target_t[moments], rotation)
        done.append(replace(source, points=state.points[points], world_from_target=targets))
        m, p = moments.stop, points.stop
    return tuple(done)


def _camera(camera: Camera, state: State, i: int) -> Camera:
    fx, fy, cx, cy, *terms = state.intrinsics[i]
    R = state.R[i]
    return replace(
        camera,
        K=np.array([[fx, camera.K[0, 1], cx], [0, fy, cy], [0, 0, 1]]),
        camera_from_world=RigidTransform.from_components(-R @ state.centre[i], Rotation.from_matrix(R)),
        distortion=np.array(terms[: 4 if camera.lens == "fisheye" else 5]),
    )


def _concatenate(columns: Sequence[Ints]) -> Ints:
    return np.concatenate([np.zeros(0, int), *columns])


def _step_of(step: Array, columns: Ints) -> Array:
    """Return each number's step, 0 where it is held; the shape is that of columns."""
    return np.append(step, 0.0)[columns]


def _keep_focal_ratio(state: State, change: Array, columns: Ints) -> Array:
    """Keep the ratio of the focal lengths where they share a column; change (cameras, 9)."""
    is_square = (columns[:, 6] >= 0) & (columns[:, 6] == columns[:, 7])
    ratio = state.intrinsics[:, 1] / state.intrinsics[:, 0]
    change = change.copy()
    change[:, 1] = np.where(is_square, change[:, 0] * ratio, change[:, 1])
    return change


def _camera_columns(rig: Rig, freedom: Mapping[str, FreeParameters]) -> Ints:
    columns = np.full((len(rig), N_PARAMETERS), -1)
    shared: dict[str, int] = {}
    n = 0
    for row, camera in zip(columns, rig, strict=True):
        own = freedom[camera.name]
        for number in own.parameters(camera.lens):
            if number in (6, 7) and own.shares_focal:
                key = f"{own.shares_focal} {number}"
                if key in shared:
                    row[number] = shared[key]
                    continue
                shared[key] = n
            row[number] = n
            n += 1
        if own.focal and own.square_pixels:
            row[7] = row[6]
    return columns


def _is_determined(free: NDArray[np.bool_], camera: Ints, moment: Ints, point: Ints, ends: Ints) -> NDArray[np.bool_]:
    """Say which points (p,) can be found: each view tells two coordinates, each length one."""
    pairs = np.unique(np.stack([point[moment < 0], camera[moment < 0]], axis=1), axis=0)
    n_views = np.bincount(pairs[:, 0], minlength=len(free))
    n_lengths = np.bincount(ends.ravel(), minlength=len(free))
    return (n_views > 0) & (2 * n_views + n_lengths >= free.sum(axis=1))


def _other_columns(held: NDArray[np.bool_], free: NDArray[np.bool_], moment: Ints) -> tuple[Ints, Ints, int]:
    is_seen = np.isin(np.arange(len(held)), moment)
    moves = np.repeat((~held & is_seen)[:, None], 6, axis=1)
    targets, points = np.full(moves.shape, -1), np.full(free.shape, -1)
    targets[moves] = np.arange(moves.sum())
    points[free] = np.arange(free.sum()) + moves.sum()
    return targets, points, int(moves.sum() + free.sum())


def _clusters(sources: Sequence[Source]) -> Ints:
    found, n = [], 0
    for source in sources:
        if source.cluster is None:
            found.append(np.full(len(source.px), -1))
            continue
        _, own = np.unique(source.cluster, return_inverse=True)
        found.append(own + n)
        n += int(own.max(initial=-1)) + 1
    return _concatenate(found)


def _lags(sources: Sequence[Source]) -> tuple[Ints, Array, Ints]:
    """Return every observation's lag (n,), the lags' standard deviations (l,) and sources (l,)."""
    found, sds, owners, n = [], [np.zeros(0)], [np.zeros(0, int)], 0
    for i, source in enumerate(sources):
        own = np.full(len(source.px), -1)
        if source.lags is not None:
            is_late = source.lags.group >= 0
            groups, rows = np.unique(source.lags.group[is_late], return_inverse=True)
            own[is_late] = rows + n
            n += len(groups)
            sds.append(np.full(len(groups), source.lags.sd_s))
            owners.append(np.full(len(groups), i))
        found.append(own)
    return _concatenate(found), np.concatenate(sds), np.concatenate(owners)


def _times(source: Source) -> Array:
    return np.full(source.n_moments, np.nan) if source.lags is None else source.lags.time_s
