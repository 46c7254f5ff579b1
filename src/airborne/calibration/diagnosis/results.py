"""What is wrong with a calibration from any sources, looked for after it: each diagnosis with its evidence."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np

from airborne.calibration.diagnosis.clocks import check_rolling_shutter
from airborne.calibration.diagnosis.coverage import check_coverage, check_links, check_tilts, check_view_count
from airborne.calibration.diagnosis.images import check_floor, check_roll, check_swapped_files
from airborne.calibration.diagnosis.moved_cameras import check_moved_cameras
from airborne.calibration.from_sources import RigCalibration
from airborne.calibration.initial.chaining import Views
from airborne.cameras.finding import Finding
from airborne.cameras.units import check_baselines
from airborne.types import Array

_UP = np.array([0.0, 0.0, 1.0])
_MISFIT_PX, _MISFIT_SHARE = 4.0, 0.002  # RMS of clicked points; share of the pictures' longer sides


def diagnose(found: RigCalibration) -> tuple[Finding, ...]:
    """Return everything that is wrong, the gravest first; empty for a sound recording."""
    inputs, rig = found.inputs, found.rig
    is_level = bool(inputs.points) or inputs.sources.world.points is not None
    told = [
        inputs.findings,
        _check_swapped_files(found),
        check_floor(rig) if "court" in inputs.points else (),
        check_baselines(rig),
        _check_clicks(found),
        check_roll(rig, _UP if is_level else None),
        _check_moved_cameras(found),
        _check_links(found),
        _check_lens_views(found),
        chain.from_iterable(
            check_coverage(camera.name, _all_px(found, i), camera.size) for i, camera in enumerate(rig)
        ),
        _check_rolling_shutter(found),
    ]
    return tuple(chain.from_iterable(told))


def _check_clicks(found: RigCalibration) -> Iterator[Finding]:
    """Doubt clicked points that fit much less well than clicks are made."""
    adjusted, sides = found.adjustment, [max(camera.size) for camera in found.rig]
    for i, source in enumerate(adjusted.sources):
        rms_px = adjusted.rms_px(source=i)
        if source.name in found.inputs.points and rms_px > max(_MISFIT_PX, _MISFIT_SHARE * float(np.mean(sides))):
            yield Finding(
                kind="misfit",
                what=f"{source.name}: the points fit to {rms_px:.1f} px only, and clicks are good to 1 or 2 px",
                advice="look for points that are mixed up, a court with another net, or a wrong survey",
            )


def _tracks(found: RigCalibration) -> Iterator[tuple[Array, Array | None]]:
    """Yield what was seen of each thing that moves: (moments, points, cameras of the rig, 2) [px], and times [s]."""
    inputs, names = found.inputs, found.rig.names
    if inputs.board_detections is not None:
        yield _board_px(inputs.board_detections.views, names), inputs.board_detections.time_s
    for tracks in (inputs.wand, inputs.detections):
        if tracks is not None:
            px = np.full((*tracks.px.shape[:2], len(names), 2), np.nan)
            for k, name in enumerate(tracks.cameras):
                px[:, :, names.index(name)] = tracks.px[:, :, k]
            yield px, None


def _board_px(views: Views, names: tuple[str, ...]) -> Array:
    px = np.full((views.n_moments, len(views.board.corners), len(names), 2), np.nan)
    for name, row in zip(views.cameras, views.detections, strict=True):
        for moment, sighting in enumerate(row):
            px[moment, sighting.corner, names.index(name)] = sighting.px
    return px


def _all_px(found: RigCalibration, camera: int) -> Array:
    return np.concatenate([source.px[source.camera == camera] for source in found.adjustment.sources])


def _check_swapped_files(found: RigCalibration) -> list[Finding]:
    """Ask the calibration at the start whether two cameras' recordings are exchanged."""
    given = found.inputs.start_rig
    if given is None or found.resections:
        return []
    tracks = [px.reshape(-1, *px.shape[2:]) for px, _ in _tracks(found)]
    return check_swapped_files(given, np.concatenate(tracks)) if tracks else []


def _check_moved_cameras(found: RigCalibration) -> Iterator[Finding]:
    for px, time_s in _tracks(found):
        yield from check_moved_cameras(found.rig, px, time_s)


def _check_links(found: RigCalibration) -> list[Finding]:
    """Count what two cameras see at once, and the known points that tie each to the world."""
    names = found.rig.names
    shared = np.zeros((len(names), len(names)))
    for px, _ in _tracks(found):
        sees = np.isfinite(px[..., 0]).any(axis=1).astype(float)
        shared += sees.T @ sees
    for points in found.inputs.points.values():
        tied = [i for i, name in enumerate(names) if name in points.cameras]
        shared[np.ix_(tied, tied)] += np.inf
    if found.inputs.start_rig is not None:
        return []
    return check_links(names, shared)


def _check_lens_views(found: RigCalibration) -> Iterator[Finding]:
    """Look at the views of the board that tell a lens: their number and tilts."""
    for i, source in enumerate(found.adjustment.sources):
        targets = source.world_from_target
        if targets is None:
            continue
        for c, camera in enumerate(found.rig):
            if camera.name not in found.inputs.lenses or (
                source.name == "board" and camera.name in found.inputs.lens_views
            ):
                continue
            moments = np.unique(
                source.moments[(source.camera == c) & np.isfinite(found.adjustment.residual_px[i][:, 0])]
            )
            if not len(moments):
                continue
            yield from check_view_count(camera.name, len(moments))
            turns = targets[moments].rotation
            middles = targets[moments].apply(source.points.mean(axis=0)) - camera.centre
            away = np.sum(turns.apply(_UP) * middles, axis=1) / np.linalg.norm(middles, axis=1)
            yield from check_tilts(camera.name, np.arccos(np.clip(np.abs(away), 0, 1)))


def _check_rolling_shutter(found: RigCalibration) -> Iterator[Finding]:
    """Ask the moving board, where all pictures are of the same instants, whether rows are read one by one."""
    seen = found.inputs.board_detections
    if seen is None or seen.time_s is None or found.lag_s or len(seen.time_s) < 3:
        return
    row = [source.name for source in found.adjustment.sources].index("board")
    source, residual = found.adjustment.sources[row], found.adjustment.residual_px[row]
    px = _board_px(seen.views, found.rig.names)
    velocity = np.gradient(px, seen.time_s, axis=0)
    for c, camera in enumerate(found.rig):
        own = source.camera == c
        v = velocity[source.moments[own], source.point[own], c]
        yield from check_rolling_shutter(camera.name, residual[own], v, source.px[own, 1], camera.size[1])
