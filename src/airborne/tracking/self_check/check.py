"""The self-check of a run: some of its frames are kept while it is tracked, and looked at again when it has ended."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Pose, PosedBody
from airborne.body.chain import delta_between, move_pose
from airborne.cameras import Rig
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.self_check.causes import Diagnosis, diagnose
from airborne.tracking.self_check.free_flight import excess, fall
from airborne.tracking.self_check.nuisances import (
    biases,
    n_parameters,
    nuisances_of,
    prior_covariance,
    shift_covariance,
    twists,
    widen,
)
from airborne.tracking.self_check.registration import Registration, draw_silhouette, foreground, register
from airborne.tracking.self_check.solution import Evidence, PoseErrors, Solution, pose_errors, solve
from airborne.types import Array
from airborne.video import Frames, View

_MOST_MOMENTS = 16  # at which silhouettes are registered
_FEWEST_MOMENTS = 3  # with fewer, nothing is said
_FEWEST_VIEWS = 4  # images of one camera from which the empty scene can be told


@dataclass(frozen=True, slots=True, eq=False)
class TrackedPath:
    """The tracked poses of a run."""

    index: NDArray[np.int64]  # (n,) of the frames with a pose
    time_s: Array  # (n,)
    poses: Sequence[Pose]

    def row(self, index: int) -> int | None:
        """Return the row of a frame; None where it has no pose."""
        row = int(np.searchsorted(self.index, index))
        return row if row < len(self.index) and self.index[row] == index else None

    def velocity(self, row: int) -> Array:
        """Return the root's velocity by the poses beside: (6,) [m/s, rad/s]."""
        a, b = max(row - 1, 0), min(row + 1, len(self.poses) - 1)
        return delta_between(self.poses[a], self.poses[b])[:6] / max(self.time_s[b] - self.time_s[a], 1e-6)

    def pose_after(self, row: int, delay_s: float) -> Pose:
        """Return the pose a little later than a frame's."""
        delta = np.zeros(6 + self.poses[row].joint_angles.size)
        delta[:6] = delay_s * self.velocity(row)
        return move_pose(self.poses[row], delta) if delay_s else self.poses[row]


@dataclass(frozen=True, slots=True, eq=False)
class SelfCheck:
    """What a run says of itself."""

    diagnosis: Diagnosis
    index: NDArray[np.int64]  # (m,) frames at which silhouettes were registered
    constant: Array  # (m, 6, 6) covariance of the pose's errors that last all run long [m, rad]
    added: Array  # (m, 6, 6) of it, what the tracker's own covariances do not hold

    def lasting_at(self, index: NDArray[np.int64]) -> Array:
        """Interpolate `added` to other frames: (n, 6, 6)."""
        return _interpolate(index, self.index, self.added)

    def constant_at(self, index: NDArray[np.int64]) -> Array:
        """Interpolate `constant` to other frames: (n, 6, 6)."""
        return _interpolate(index, self.index, self.constant)


def self_check(
    model: BodyModel,
    rig: Rig,
    path: TrackedPath,
    kept: Sequence[Frames],
    *,
    calibrated: Mapping[str, Array],
    body_sd: float,
) -> SelfCheck | None:
    """Check a run by some of its frames; None where they show too little.

    calibrated, body_sd: as `prior_covariance` takes them.
    """
    rows = [row for frames in kept if (row := path.row(frames.index)) is not None]
    seen = [frames for frames in kept if path.row(frames.index) is not None]
    if len(path.poses) < _FEWEST_MOMENTS or len(seen) < _FEWEST_MOMENTS:
        return None
    chosen = np.unique(np.linspace(0, len(seen) - 1, _MOST_MOMENTS).round().astype(int))
    rows, moments = [rows[i] for i in chosen], [seen[i] for i in chosen]
    evidence = _gather(RenderModel.of(model), rig, path, rows, moments, kept)
    prior = prior_covariance(rig, calibrated, body_sd)
    nuisances = nuisances_of(rig)
    wide = prior
    for nuisance in nuisances:
        wide = widen(wide, nuisance)
    solution, weights = solve(evidence, wide)
    errors = pose_errors(evidence, weights)
    solution = _with_fall(solution, errors, path, rows)
    diagnosis = diagnose(solution, nuisances, prior)
    K = errors.by_parameter
    constant = K @ diagnosis.covariance @ np.swapaxes(K, 1, 2)
    mean = errors.shown(diagnosis.theta) if diagnosis.has_alarm else K @ diagnosis.theta
    constant = constant + mean[:, :, None] * mean[:, None, :]
    added = _positive(constant - K @ shift_covariance(rig) @ np.swapaxes(K, 1, 2))
    return SelfCheck(diagnosis, path.index[rows], constant, added)


def _interpolate(index: NDArray[np.int64], known: NDArray[np.int64], values: Array) -> Array:
    columns = [np.interp(index, known, column) for column in values.reshape(len(known), -1).T]
    return np.stack(columns, axis=1).reshape(len(index), 6, 6)


def _positive(matrices: Array) -> Array:
    """Return the nearest matrices (n, 6, 6) without negative eigenvalues."""
    values, vectors = np.linalg.eigh(matrices)
    return (vectors * np.maximum(values, 0)[:, None, :]) @ np.swapaxes(vectors, 1, 2)


def _gather(
    render_model: RenderModel,
    rig: Rig,
    path: TrackedPath,
    rows: Sequence[int],
    moments: Sequence[Frames],
    kept: Sequence[Frames],
) -> Evidence:
    """Register every view of the moments."""
    n, c, k = len(moments), len(rig), n_parameters(rig)
    evidence = Evidence(
        offset=np.zeros((n, c, 4)),
        by_twist=np.zeros((n, c, 4, 6)),
        by_parameter=np.zeros((n, c, 4, k)),
        is_seen=np.zeros((n, c), bool),
        edge=np.zeros((n, c, 6, 6)),
        edge_by_parameter=np.zeros((n, c, 6, k)),
    )
    empty = _EmptyScenes(kept)
    for i, (row, frames) in enumerate(zip(rows, moments, strict=True)):
        velocity = path.velocity(row)
        for j, view in enumerate(frames.views):
            if view is None:
                continue
            posed = render_model.with_pose(path.pose_after(row, view.delay_s))
            found = _register_view(render_model, posed, view, empty, j)
            if found is not None:
                columns, shifts = twists(rig, j, posed.t[0], velocity), biases(rig, j)
                evidence.offset[i, j], evidence.by_twist[i, j], evidence.is_seen[i, j] = found.offset, found.by_twist, True
                evidence.by_parameter[i, j] = found.by_twist @ columns + shifts
                evidence.edge[i, j] = found.edge
                evidence.edge_by_parameter[i, j] = found.edge @ columns + found.edge_by_offset @ shifts
    return evidence


def _register_view(
    render_model: RenderModel, posed: PosedBody, view: View, empty: _EmptyScenes, number: int
) -> Registration | None:
    silhouette = draw_silhouette(render_model, posed, view.camera)
    if silhouette is None:
        return None
    scene = empty.crop(number, view, silhouette.box)
    if scene is None:
        return None
    return register(silhouette, foreground(view.rgb, scene, silhouette), posed)


class _EmptyScenes:
    """The median picture of each camera (and field) over the kept frames, where it is asked for."""

    def __init__(self, kept: Sequence[Frames]) -> None:
        self._images: dict[tuple[int, bytes], list[NDArray[np.uint8]]] = {}
        for frames in kept:
            for number, view in enumerate(frames.views):
                if view is not None:
                    self._images.setdefault((number, view.camera.K.tobytes()), []).append(view.rgb)

    def crop(self, number: int, view: View, box: tuple[int, int, int, int]) -> NDArray[np.uint8] | None:
        """Return the empty scene in a box of a view; None where too few pictures tell it."""
        images = self._images[number, view.camera.K.tobytes()]
        if len(images) < _FEWEST_VIEWS:
            return None
        x0, y0, x1, y1 = box
        stack = np.stack([image[y0:y1, x0:x1] for image in images])
        middle = len(images) // 2
        return np.partition(stack, middle, axis=0)[middle]


def _with_fall(solution: Solution, errors: PoseErrors, path: TrackedPath, rows: Sequence[int]) -> Solution:
    """Add what the fall says of the sizes, where the body falls freely."""
    poses = [path.poses[row].world_from_root for row in rows]
    position = np.array([pose.translation for pose in poses])
    R = np.array([pose.rotation.as_matrix() for pose in poses])
    found = fall(path.time_s[list(rows)], position + errors.seen[:, :3], R)
    if found is None:
        return solution
    by_position, acceleration, sd = found
    row = by_position @ errors.seen_by_parameter[:, :3].reshape(len(by_position), -1)
    return solution.with_row(row, -excess(acceleration), sd)
