"""All sources in one adjustment: evidence, time, world frame, and how well what was left out is predicted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from airborne.calibration.bundle import Adjustment, FreeParameters, ObservationLags, Source, adjust
from airborne.calibration.cross_validation import cross_validate
from airborne.calibration.initial.chaining import board_poses, board_source
from airborne.calibration.initial.resection import Resection, find_misplaced_cameras, resect_cameras
from airborne.calibration.initial.values import Inputs, Progress, read_inputs
from airborne.calibration.sources.files import Sources
from airborne.calibration.sources.person import calibration_prior, person_source
from airborne.calibration.sources.scene_points import scene_source
from airborne.calibration.sources.wand import wand_source
from airborne.calibration.world_frame.choice import WorldFrame, choose_world_frame
from airborne.cameras import Rig
from airborne.types import Array

_LONGEST_GAP_S = 0.26  # between pictures that say how the board moves
_LOOSE_SYNC_NOISE_SHARE = 0.75  # of the noise: lags are kept where they leave less than this
_FEWEST_MOMENTS = 10
_LAG_SD = 0.5  # of the time between pictures


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RigCalibration:
    """Cameras from all sources, and how far to trust them."""

    inputs: Inputs
    adjustment: Adjustment  # in the wanted world
    world: str  # how the world's frame was found, in words
    held_out_px: Mapping[str, Array]  # by source, distances of what was left out of the fit [px]
    lag_s: Mapping[str, Array]  # by camera, of its pictures against the others' mean; empty where all are in time
    resections: tuple[Resection, ...]
    notes: tuple[str, ...]

    @property
    def rig(self) -> Rig:
        """The cameras."""
        return self.adjustment.rig


def calibrate_from(sources: Sources, progress: Progress) -> RigCalibration:
    """Read all sources and adjust the cameras to all of them at once; raises an AirborneError in one line.

    told: what is being done, how much of it is done, and of how much.
    """
    inputs = read_inputs(sources, progress)
    rig, mended = _resect_misplaced(inputs)
    freedom = inputs.free
    first = _adjust(inputs, rig, freedom, None, progress)
    adjusted, lag_sd_s = first, _lag_sd_s(inputs)
    if lag_sd_s is not None:
        looser = _adjust(inputs, first.rig, freedom, lag_sd_s, progress)
        row = [source.name for source in looser.sources].index("board")
        is_better = looser.noise_px[row] < _LOOSE_SYNC_NOISE_SHARE * first.noise_px[row]
        asked = sources.board is not None and sources.board.sync == "loose"
        adjusted, lag_sd_s = (looser, lag_sd_s) if is_better or asked else (first, None)
    elif inputs.wand is not None or (inputs.detections is not None and first.prior is None):
        adjusted = _adjust(inputs, first.rig, freedom, None, progress)  # triangulated anew by better cameras
    place = choose_world_frame(inputs, adjusted, [m.camera.name for m in mended])
    final = adjusted if place.is_unchanged else _adjust_in_world(adjusted, place, progress)
    missed = cross_validate(final, lambda done, n: progress("leaving out and predicting", done, n))
    lags = _lags(final) if lag_sd_s is not None else {}
    return RigCalibration(
        inputs=inputs,
        adjustment=final,
        world=place.description,
        held_out_px=missed,
        lag_s=lags,
        resections=mended,
        notes=(*inputs.notes, *_lag_notes(lags)),
    )


def _resect_misplaced(inputs: Inputs) -> tuple[Rig, tuple[Resection, ...]]:
    """Place cameras anew first that a person's detections say are elsewhere than the calibration at the start."""
    if inputs.detections is None or inputs.start_rig is None:
        return inputs.rig, ()
    wrong = find_misplaced_cameras(inputs.rig, inputs.detections)
    if not wrong:
        return inputs.rig, ()
    return resect_cameras(inputs.rig, inputs.detections, [m.camera.name for m in wrong])[0], wrong


def _adjust(
    inputs: Inputs, rig: Rig, freedom: Mapping[str, FreeParameters], lag_sd_s: float | None, told: Progress
) -> Adjustment:
    evidence = _sources(inputs, rig, lag_sd_s)
    prior = None
    if inputs.start_rig is not None and inputs.sources.kinds == ["detections"]:
        prior = calibration_prior(
            rig, [c.name for c, old in zip(rig, inputs.rig, strict=True) if c is old], evidence[0].points
        )
    return adjust(rig, evidence, freedom, prior=prior, progress=lambda step, _: told("adjusting", step, None))


def _sources(inputs: Inputs, rig: Rig, lag_sd_s: float | None) -> list[Source]:
    """Return every source, its unknowns beginning where the rig sees them."""
    found = [scene_source(rig.names, points, name=name) for name, points in inputs.points.items()]
    if inputs.board_detections is not None:
        views = inputs.board_detections.views
        source = board_source(
            views, board_poses(rig.select(views.cameras), views), rows=[rig.names.index(name) for name in views.cameras]
        )
        time_s = inputs.board_detections.time_s
        if lag_sd_s is not None and time_s is not None:
            group = source.camera * views.n_moments + source.moments
            source = replace(source, lags=ObservationLags(group=group, time_s=time_s, sd_s=lag_sd_s))
        found.append(source)
    for name, views in inputs.lens_views.items():
        places = board_poses(rig.select([name]), views)
        found.append(board_source(views, places, name=f"lens of {name}", rows=[rig.names.index(name)]))
    if inputs.wand is not None:
        found.append(wand_source(rig, inputs.wand))
    if inputs.detections is not None:
        found.append(person_source(rig, inputs.detections))
    return found


def _lag_sd_s(inputs: Inputs) -> float | None:
    """Return how far pictures may lag behind others, or None where they are taken to be of the same instant."""
    seen, table = inputs.board_detections, inputs.sources.board
    if seen is None or table is None or table.sync == "exact" or seen.time_s is None or len(seen.views.cameras) < 2:
        return None
    gap_s = float(np.median(np.diff(seen.time_s))) if len(seen.time_s) > 1 else np.inf
    is_dense = gap_s <= _LONGEST_GAP_S and (seen.views.n_corners > 0).any(axis=0).sum() >= _FEWEST_MOMENTS
    return _LAG_SD * gap_s if is_dense else None


def _adjust_in_world(adjusted: Adjustment, place: WorldFrame, told: Progress) -> Adjustment:
    """Move everything to the world that is wanted, and find the standard deviations there."""
    rig, sources = adjusted.transform(place.new_from_old, place.scale)
    if place.fixed_moment is not None:
        held = [
            replace(s, is_fixed=np.arange(s.n_moments) == place.fixed_moment) if s.name == "board" else s
            for s in sources
        ]
        sources = tuple(held)
    freedom = dict(adjusted.free)
    if place.fixed_camera is not None:
        freedom[place.fixed_camera] = replace(freedom[place.fixed_camera], extrinsics=False)
    return adjust(rig, sources, freedom, progress=lambda step, _: told("adjusting", step, None))


def _lags(adjusted: Adjustment) -> dict[str, Array]:
    """Return each camera's lags, one a picture of the moving board."""
    row = [source.name for source in adjusted.sources].index("board")
    source, lag_s = adjusted.sources[row], adjusted.lag_s[row]
    found = {}
    for i, name in enumerate(adjusted.rig.names):
        _, first = np.unique(source.moments[source.camera == i], return_index=True)
        found[name] = lag_s[source.camera == i][first]
    return found


def _lag_notes(lags: Mapping[str, Array]) -> tuple[str, ...]:
    if not lags:
        return ()
    said = ", ".join(f"{name} {np.median(lag_s) * 1e3:+.0f} ms" for name, lag_s in lags.items() if len(lag_s))
    return (
        "the cameras do not look at the same instant; each picture of the moving board has its own time now "
        f"(median against the others: {said})",
    )
