"""All sources in one adjustment: observations, lags, world frame, cross-validation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from airborne.calibration.bundle import Adjustment, FreeParameters, ObservationLags, Source, adjust
from airborne.calibration.cross_validation import cross_validate
from airborne.calibration.initial.chaining import board_poses, board_source
from airborne.calibration.initial.resection import Resection, find_misplaced_cameras, resect_cameras
from airborne.calibration.initial.values import Inputs, read_inputs
from airborne.calibration.sources.control_points import SURVEYED_SD
from airborne.calibration.sources.files import Sources
from airborne.calibration.sources.person import calibration_prior, person_source
from airborne.calibration.sources.scene_points import scene_source
from airborne.calibration.sources.wand import wand_source
from airborne.calibration.world_frame.choice import WorldFrame, choose_world_frame
from airborne.cameras import Rig
from airborne.types import Array, StageProgress

_LONGEST_GAP_S = 0.26  # between images of which the board's motion can be interpolated
_LOOSE_SYNC_NOISE_SHARE = 0.75  # lags are accepted where they lower the noise to less than this share
_FEWEST_MOMENTS = 10  # with a board, to estimate lags
_LAG_SD = 0.5  # of the time between images


def rms(distances: Array) -> float:
    """Return the root mean square of those that are known; NaN where none is."""
    distances = distances[np.isfinite(distances)]
    return float(np.sqrt(np.mean(distances**2))) if len(distances) else float("nan")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RigCalibration:
    """Cameras from all sources, with their uncertainty."""

    inputs: Inputs
    adjustment: Adjustment  # in the requested world frame
    world: str  # what defines the world frame, in words
    held_out_px: Mapping[str, Array]  # by source, distances of held-out observations [px]
    lag_s: Mapping[str, Array]  # by camera, of its images against the others' mean; empty if synchronous
    resections: tuple[Resection, ...]
    notes: tuple[str, ...]

    @property
    def rig(self) -> Rig:
        """The cameras."""
        return self.adjustment.rig

    @property
    def held_out_rms_px(self) -> float:
        """The RMS distance of all held-out observations from their predictions [px]; NaN where none is held out."""
        return rms(np.concatenate(list(self.held_out_px.values())))

    def held_out_px_of(self, camera: str) -> Array:
        """Return the distances of a camera's held-out observations from their predictions, of all sources [px]."""
        i = self.rig.names.index(camera)
        return np.concatenate([self.held_out_px[s.name][s.camera == i] for s in self.adjustment.sources])


def calibrate_from(sources: Sources, progress: StageProgress) -> RigCalibration:
    """Read all sources and adjust the cameras to all of them at once; raises an AirborneError in one line.

    progress is called with the stage, the steps done, and the steps expected.
    """
    inputs = read_inputs(sources, progress)
    rig, mended = _resect_misplaced(inputs)
    free = inputs.free
    without_lags = _adjust(inputs, rig, free, lag_sd_s=None, progress=progress)
    adjustment, lag_sd_s = without_lags, _lag_sd_s(inputs)
    if lag_sd_s is not None:
        with_lags = _adjust(inputs, without_lags.rig, free, lag_sd_s=lag_sd_s, progress=progress)
        is_requested = sources.board is not None and sources.board.sync == "loose"
        is_better = is_requested or _is_looser_better(without_lags, with_lags, progress)
        adjustment, lag_sd_s = (with_lags, lag_sd_s) if is_better else (without_lags, None)
    elif inputs.wand is not None or (inputs.detections is not None and without_lags.prior is None):
        adjustment = _adjust(
            inputs, without_lags.rig, free, lag_sd_s=None, progress=progress
        )  # triangulated anew by better cameras
    frame = choose_world_frame(inputs, adjustment, [m.camera.name for m in mended])
    final = adjustment if frame.is_unchanged else _adjust_in_world(adjustment, frame, progress)
    if frame.is_unchanged and inputs.are_surveyed_points:
        final = _with_lens_model_error(inputs, final)
    held_out_px = cross_validate(final, lambda done, n: progress("leaving out and predicting", done, n))
    lags = _lags(final) if lag_sd_s is not None else {}
    calibration = RigCalibration(
        inputs=inputs,
        adjustment=final,
        world=frame.description,
        held_out_px=held_out_px,
        lag_s=lags,
        resections=mended,
        notes=(*inputs.notes, *_lag_notes(lags)),
    )
    rig, rms_px, left_out_px = final.rig, final.rms_px(), calibration.held_out_rms_px
    camera_sd = final.camera_sd
    if left_out_px > rms_px > 0:
        wider = left_out_px / rms_px
        rig, camera_sd = _with_wider_errors(rig, np.full(len(rig), wider)), wider * camera_sd
    if inputs.points:
        rig = Rig(tuple(replace(camera, world_sd=SURVEYED_SD) for camera in rig))
    return replace(calibration, adjustment=replace(final, rig=rig, camera_sd=camera_sd))


def _resect_misplaced(inputs: Inputs) -> tuple[Rig, tuple[Resection, ...]]:
    """Resect the cameras that a person's detections show to be misplaced in the initial calibration."""
    if inputs.detections is None or inputs.start_rig is None:
        return inputs.rig, ()
    misplaced = find_misplaced_cameras(inputs.rig, inputs.detections)
    if not misplaced:
        return inputs.rig, ()
    return resect_cameras(inputs.rig, inputs.detections, [m.camera.name for m in misplaced])[0], misplaced


def _adjust(
    inputs: Inputs, rig: Rig, free: Mapping[str, FreeParameters], *, lag_sd_s: float | None, progress: StageProgress
) -> Adjustment:
    sources = _sources(inputs, rig, lag_sd_s)
    prior = None
    if inputs.start_rig is not None and not inputs.sources.place_cameras:
        prior = calibration_prior(
            rig, [c.name for c, old in zip(rig, inputs.rig, strict=True) if c is old], sources[0].points
        )
    return adjust(rig, sources, free, prior=prior, progress=lambda step, _: progress("adjusting", step, None))


def _sources(inputs: Inputs, rig: Rig, lag_sd_s: float | None) -> list[Source]:
    """Return every source, its unknowns initialised from the rig."""
    sources = [scene_source(rig.names, points, name=name) for name, points in inputs.points.items()]
    if inputs.board_detections is not None:
        views = inputs.board_detections.views
        source = board_source(
            views, board_poses(rig.select(views.cameras), views), rows=[rig.names.index(name) for name in views.cameras]
        )
        time_s = inputs.board_detections.time_s
        if lag_sd_s is not None and time_s is not None:
            group = source.camera * views.n_moments + source.moments
            source = replace(source, lags=ObservationLags(group=group, time_s=time_s, sd_s=lag_sd_s))
        sources.append(source)
    for name, views in inputs.lens_views.items():
        world_from_board = board_poses(rig.select([name]), views)
        sources.append(board_source(views, world_from_board, lens_of=name, rows=[rig.names.index(name)]))
    if inputs.wand is not None:
        sources.append(wand_source(rig, inputs.wand))
    if inputs.detections is not None:
        sources.append(person_source(rig, inputs.detections))
    return sources


def _lag_sd_s(inputs: Inputs) -> float | None:
    """Return the prior standard deviation of images' lags [s], or None where the cameras count as synchronous."""
    detections, table = inputs.board_detections, inputs.sources.board
    if (
        detections is None
        or table is None
        or table.sync == "exact"
        or detections.time_s is None
        or len(detections.views.cameras) < 2
    ):
        return None
    gap_s = float(np.median(np.diff(detections.time_s))) if len(detections.time_s) > 1 else np.inf
    is_dense = gap_s <= _LONGEST_GAP_S and (detections.views.n_corners > 0).any(axis=0).sum() >= _FEWEST_MOMENTS
    return _LAG_SD * gap_s if is_dense else None


def _is_looser_better(without_lags: Adjustment, with_lags: Adjustment, progress: StageProgress) -> bool:
    """Say whether lags come to rest, clearly lower the board's noise, and predict left-out moments as well."""
    row = with_lags.target_row
    noise_share = with_lags.noise_px[row] / without_lags.noise_px[row]
    if not with_lags.has_converged or noise_share >= _LOOSE_SYNC_NOISE_SHARE:
        return False
    held_out = [
        cross_validate(adjustment, lambda done, n: progress("comparing the clocks", done, n))[
            with_lags.sources[row].name
        ]
        for adjustment in (without_lags, with_lags)
    ]
    exact, loose = (float(np.sqrt(np.nanmean(distances**2))) for distances in held_out)
    return not loose > exact


def _adjust_in_world(adjustment: Adjustment, frame: WorldFrame, progress: StageProgress) -> Adjustment:
    """Transform everything to the requested world frame, and estimate the standard deviations there."""
    rig, sources = adjustment.transform(frame.new_from_old, frame.scale)
    if frame.fixed_moment is not None:
        row, fixed = adjustment.target_row, list(sources)
        fixed[row] = replace(fixed[row], is_fixed=np.arange(fixed[row].n_moments) == frame.fixed_moment)
        sources = tuple(fixed)
    free = dict(adjustment.free)
    if frame.fixed_camera is not None:
        free[frame.fixed_camera] = replace(free[frame.fixed_camera], extrinsics=False)
    return adjust(rig, sources, free, progress=lambda step, _: progress("adjusting", step, None))


def _with_lens_model_error(inputs: Inputs, adjustment: Adjustment) -> Adjustment:
    """Widen the standard deviations of places to those that hold the error of the lens model."""
    camera_sd = adjustment.camera_sd.copy()
    for row, name in zip(camera_sd, adjustment.rig.names, strict=True):
        fit = inputs.lenses.get(name)
        if fit is not None and fit.place_sd_m is not None:
            row[3:6] = np.maximum(row[3:6], fit.place_sd_m)
    wider = np.mean(camera_sd[:, 3:6] / np.maximum(adjustment.camera_sd[:, 3:6], 1e-12), axis=1)
    return replace(adjustment, camera_sd=camera_sd, rig=_with_wider_errors(adjustment.rig, wider))


def _with_wider_errors(rig: Rig, factors: Array) -> Rig:
    """Return the cameras with deviations so many times as large, by camera; none becomes smaller."""
    cameras = [
        camera if camera.covariance is None else replace(camera, covariance=max(factor, 1.0) ** 2 * camera.covariance)
        for camera, factor in zip(rig, factors, strict=True)
    ]
    return Rig(tuple(cameras))


def _lags(adjustment: Adjustment) -> dict[str, Array]:
    """Return each camera's lags, one an image of the moving board."""
    row = adjustment.target_row
    source, lag_s = adjustment.sources[row], adjustment.lag_s[row]
    lags = {}
    for i, name in enumerate(adjustment.rig.names):
        _, first = np.unique(source.moments[source.camera == i], return_index=True)
        lags[name] = lag_s[source.camera == i][first]
    return lags


def _lag_notes(lags: Mapping[str, Array]) -> tuple[str, ...]:
    if not lags:
        return ()
    medians = ", ".join(f"{name} {np.median(lag_s) * 1e3:+.0f} ms" for name, lag_s in lags.items() if len(lag_s))
    return (
        "the cameras do not look at the same instant; each image of the moving board has its own time now "
        f"(median against the others, + is later: {medians})",
    )
