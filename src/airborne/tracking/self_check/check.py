"""The self-check of a run: some of its frames are kept while it is tracked, and looked at again when it has ended."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel
from airborne.cameras import Rig
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.self_check.absolute import has_stayed, lies_elsewhere, spread, too_fast, zigzags
from airborne.tracking.self_check.causes import Diagnosis, name_causes
from airborne.tracking.self_check.empty_scenes import EmptyScenes
from airborne.tracking.self_check.free_flight import excess, fall
from airborne.tracking.self_check.light import register_light
from airborne.tracking.self_check.nuisances import (
    allow_cause,
    biases,
    first_bias,
    n_parameters,
    nuisances_of,
    prior_covariance,
    shift_covariance,
    twists,
)
from airborne.tracking.self_check.path import TrackedPath
from airborne.tracking.self_check.reach import reach_beyond
from airborne.tracking.self_check.registration import Silhouette, draw_silhouette, foreground, outline_of, register
from airborne.tracking.self_check.solution import Evidence, NuisanceSolution, PoseErrors, pose_errors, solve
from airborne.types import Array, Image
from airborne.video import Frames

_MOST_MOMENTS = 16  # at which silhouettes are registered
_N_THREADS = min(os.cpu_count() or 1, 4)  # register silhouettes; kernels and OpenCV let go of Python's lock
_FEWEST_MOMENTS = 3  # with fewer, nothing is said of causes
# of how large a body with joints looks: limbs bend until it covers the pixels. Chosen: of synthetic people with
# statures 8 % wrong the silhouettes alone showed 0 to 2 % of that
_POSTURE_SD = 0.04

STAYED = (
    "what the body covered at its start, and does not cover any more, looks as it did then: that may not have been the "
    "body, so look at where it starts"
)
ELSEWHERE = "what stands out from the empty scene lies beside the body by more than its interval"
FAST = "the body moves faster than bodies do"
ZIGZAG = "the body goes forth and back between them, as where `fields` under [[camera]] has the wrong order"


@dataclass(frozen=True, slots=True, eq=False)
class RunEquations:
    """What some moments of a run say of its parameters and of its poses."""

    rows: Sequence[int]  # of the path, the moments
    evidence: Evidence
    solution: NuisanceSolution
    errors: PoseErrors
    prior: Array  # (k, k) what is usual
    reach: Array  # (m, c, segments) [m] see `reach_beyond`; NaN where nothing is seen, and of bodies without joints

    @property
    def says_causes(self) -> bool:
        """Whether enough moments were registered, in two views if there are two: one alone is a matter of the pose."""
        is_seen = self.evidence.is_seen
        return int(np.count_nonzero(is_seen.sum(axis=1) >= min(2, is_seen.shape[1]))) >= _FEWEST_MOMENTS


@dataclass(frozen=True, slots=True, eq=False)
class SelfCheck:
    """What a run says of itself."""

    diagnosis: Diagnosis
    index: NDArray[np.int64]  # (m,) frames at which silhouettes were registered
    constant: Array  # (m, 6, 6) covariance of the pose's errors that last all run long [m, rad]
    added: Array  # (m, 6, 6) of it, what the tracker's own covariances do not hold
    lies_elsewhere: NDArray[np.bool_]  # (m,) the silhouettes show the body beside its interval

    def lasting_at(self, index: NDArray[np.int64]) -> Array:
        """Interpolate `added` to other frames: (n, 6, 6)."""
        return _interpolate(index, self.index, self.added)

    def constant_at(self, index: NDArray[np.int64]) -> Array:
        """Interpolate `constant` to other frames: (n, 6, 6)."""
        return _interpolate(index, self.index, self.constant)


def self_check(run: RunEquations, model: BodyModel, rig: Rig, path: TrackedPath) -> SelfCheck:
    """Check a run by the equations gathered from some of its frames."""
    rows, evidence, errors = run.rows, run.evidence, run.errors
    diagnosis = Diagnosis((), np.zeros(len(run.prior)), run.prior)
    if run.says_causes:
        # one camera's place and clock are those of the poses
        causes = [each for each in nuisances_of(rig) if len(rig) > 1 or each.kind in ("scale", "focal")]
        diagnosis = name_causes(run.solution, causes, run.prior)
        if model.has_joints:
            diagnosis = diagnosis.with_size_sd(_POSTURE_SD)
    shows_place = diagnosis.has_alarm and len(rig) > 1  # one camera's silhouettes do not tell how far away a body is
    constant = _constant_errors(errors, diagnosis, len(run.prior), shows_place=shows_place)
    if model.has_joints:  # the covariances of its frames hold that its shape is wrong
        added = _constant_errors(errors, diagnosis, first_bias(rig), shows_place=shows_place)
    else:
        K = errors.by_parameter
        added = _positive(constant - K @ shift_covariance(rig) @ np.swapaxes(K, 1, 2))
    covariance = added[:, :3, :3] + path.covariance[rows, :3, :3]
    is_seen = (evidence.is_seen.sum(axis=1) > 1) & np.isfinite(covariance).all(axis=(1, 2)) & (not model.has_joints)
    elsewhere = np.zeros(len(rows), bool)
    shown = errors.at(diagnosis.theta)[is_seen, :3]
    elsewhere[is_seen] = lies_elsewhere(shown, errors.noise[is_seen, :3, :3], covariance[is_seen])
    return SelfCheck(diagnosis, path.index[rows], constant, added, elsewhere)


def _constant_errors(errors: PoseErrors, diagnosis: Diagnosis, n: int, *, shows_place: bool) -> Array:
    """Return the covariance (m, 6, 6) of the pose's errors by the first n parameters.

    shows_place: their mean is what the silhouettes show, not what the parameters say.
    """
    K = errors.by_parameter[:, :, :n]
    mean = errors.at(diagnosis.theta) if shows_place else K @ diagnosis.theta[:n]
    return K @ diagnosis.covariance[:n, :n] @ np.swapaxes(K, 1, 2) + mean[:, :, None] * mean[:, None, :]


def doubts(
    model: BodyModel, path: TrackedPath, kept: Sequence[Frames], began: int, found: SelfCheck | None
) -> dict[str, NDArray[np.bool_]]:
    """Return which frames of a path are in doubt (n,), by what speaks against them; reasons without a frame too.

    `kept` are in the order of time; `began` is the frame that was tracked first. What the body covered at its start is
    told by the first tracked pose, not by the given one, which may be off by as much as the tracker mends.
    """
    render_model, rows = RenderModel.of(model), [path.row(frames.index) for frames in kept]
    pairs = [(row, frames) for row, frames in zip(rows, kept, strict=True) if row is not None]
    stayed: list[bool] = []
    if pairs:
        row, first = min(pairs, key=lambda pair: abs(pair[1].index - began))
        stayed = [
            has_stayed(render_model, path.poses[row], path.poses[now], first=first, later=frames)
            for now, frames in pairs
        ]
    at = path.index[[row for row, _ in pairs]]
    none = np.zeros(len(path.index), bool)
    return {
        STAYED: spread(np.array(stayed), at, path.index) if pairs else none,
        ELSEWHERE: none if found is None else spread(found.lies_elsewhere, found.index, path.index),
        ZIGZAG: np.full(len(path.index), zigzags(path.index, path.positions, path.covariance[:, :3, :3])),
        FAST: too_fast(path.time_s, path.positions, path.turns) if len(path.poses) > 1 else none,
    }


def _interpolate(index: NDArray[np.int64], known: NDArray[np.int64], values: Array) -> Array:
    columns = [np.interp(index, known, column) for column in values.reshape(len(known), -1).T]
    return np.stack(columns, axis=1).reshape(len(index), 6, 6)


def _positive(matrices: Array) -> Array:
    """Return the nearest matrices (n, 6, 6) without negative eigenvalues."""
    values, vectors = np.linalg.eigh(matrices)
    return (vectors * np.maximum(values, 0)[:, None, :]) @ np.swapaxes(vectors, 1, 2)


def gather_equations(
    model: BodyModel,
    rig: Rig,
    path: TrackedPath,
    kept: Sequence[Frames],
    *,
    body_sd: float,
) -> RunEquations | None:
    """Look at some frames of a run again; None where none of them shows the body.

    body_sd: as `prior_covariance` takes it.
    """
    seen = [(row, frames) for frames in kept if (row := path.row(frames.index)) is not None]
    if not seen:
        return None
    chosen = np.unique(np.linspace(0, len(seen) - 1, _MOST_MOMENTS).round().astype(int))
    rows, moments = [seen[i][0] for i in chosen], [seen[i][1] for i in chosen]
    evidence, reach = _gather(RenderModel.of(model), rig, path, rows, moments=moments, kept=kept)
    is_drawn = np.asarray(evidence.edge.any(axis=(1, 2, 3)))
    if not is_drawn.any():
        return None
    evidence, rows = evidence.select(is_drawn), list(np.array(rows)[is_drawn])
    prior = prior_covariance(rig, body_sd, is_person=model.has_joints)
    wide = prior
    for nuisance in nuisances_of(rig):
        wide = allow_cause(wide, nuisance)
    solution, weights = solve(evidence, wide)
    errors = pose_errors(evidence, weights)
    if not model.has_joints:  # a person's centre of mass moves in the root; `find_wrong_fall` measures its fall
        solution = _with_fall(solution, errors, rig, path, rows=rows)
    return RunEquations(rows, evidence, solution, errors, prior, reach[is_drawn])


def _gather(
    render_model: RenderModel,
    rig: Rig,
    path: TrackedPath,
    rows: Sequence[int],
    *,
    moments: Sequence[Frames],
    kept: Sequence[Frames],
) -> tuple[Evidence, Array]:
    """Register every view of the moments; return how far a person reaches there too, as `RunEquations` has it."""
    n, c, k = len(moments), len(rig), n_parameters(rig)
    evidence = Evidence(
        offset=np.zeros((n, c, 4)),
        by_twist=np.zeros((n, c, 4, 6)),
        by_parameter=np.zeros((n, c, 4, k)),
        is_seen=np.zeros((n, c), bool),
        edge=np.zeros((n, c, 6, 6)),
        edge_by_parameter=np.zeros((n, c, 6, k)),
    )
    reach = np.full((n, c, len(render_model.model.segments)), np.nan)
    empty = EmptyScenes(kept, render_model, path)
    registered = list[tuple[int, int, Future[tuple[Array | None, Array | None]], Array, Array]]()
    with ThreadPoolExecutor(_N_THREADS) as pool:
        for i, (row, frames) in enumerate(zip(rows, moments, strict=True)):
            velocity = path.velocity(row)
            for j, view in enumerate(frames.views):
                if view is None:
                    continue
                posed = render_model.with_pose(path.pose_after(row, view.delay_s))
                silhouette = draw_silhouette(render_model, posed, view.camera)
                if silhouette is None:
                    continue
                outline = outline_of(silhouette, posed)
                columns, shifts = twists(rig, j, posed.t[0], velocity), biases(rig, j)
                evidence.edge[i, j] = outline.edge
                evidence.edge_by_parameter[i, j] = outline.edge @ columns + outline.edge_by_offset @ shifts
                scene = empty.behind(j, view, silhouette) if silhouette.is_whole else None
                if scene is not None:
                    found = pool.submit(_register, render_model, silhouette, view.rgb, scene)
                    registered.append((i, j, found, outline.by_twist, outline.by_twist @ columns + shifts))
    for i, j, found, by_twist, by_parameter in registered:
        offset, own_reach = found.result()
        if own_reach is not None:
            reach[i, j] = own_reach
        if offset is not None:
            evidence.offset[i, j], evidence.by_twist[i, j], evidence.is_seen[i, j] = offset, by_twist, True
            evidence.by_parameter[i, j] = by_parameter
    return evidence, reach


def _register(
    render_model: RenderModel, silhouette: Silhouette, rgb: Image, scene: Image
) -> tuple[Array | None, Array | None]:
    """Return the offset (4,) of a silhouette in an image, None where it is not found, and how far a person reaches.

    That of a thing is refined by its light.
    """
    shown = foreground(rgb, scene, silhouette)
    offset = register(silhouette, shown)
    if render_model.model.has_joints:
        return offset, reach_beyond(render_model, silhouette, rgb, scene, shown)
    return offset if offset is None else register_light(silhouette, offset, rgb, scene), None


def _with_fall(
    solution: NuisanceSolution, errors: PoseErrors, rig: Rig, path: TrackedPath, *, rows: Sequence[int]
) -> NuisanceSolution:
    """Add what the fall says of the sizes, where the body falls freely.

    Silhouettes correct its path where cameras contradict each other. One camera's poses agree with it whatever is
    wrong, and so lie where that takes them.
    """
    if len(rig) == 1:
        found = fall(path.time_s, path.positions, path.rotations, path.covariance[:, :3, :3])
        by_parameter = -np.stack([twists(rig, 0, position, np.zeros(6)) for position in path.positions])
    else:
        at = list(rows)
        position = path.positions[at] + errors.seen[:, :3]
        found = fall(path.time_s[at], position, path.rotations[at], errors.noise[:, :3, :3])
        by_parameter = errors.seen_by_parameter
    if found is None:
        return solution
    by_position, acceleration, sd = found
    row = by_position @ by_parameter[:, :3].reshape(len(by_position), -1)
    return solution.with_row(row, -excess(acceleration), sd)
