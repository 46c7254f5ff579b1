"""What is wrong with a calibration from any sources, looked for after it: each diagnosis with its evidence."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from airborne.calibration.diagnosis.clocks import rolling_shutter
from airborne.calibration.diagnosis.coverage import clustered_views, few_views, missing_bridges, untilted_views
from airborne.calibration.diagnosis.images import below_floor, swapped_files, turned_pictures
from airborne.calibration.diagnosis.moved_cameras import moved_cameras
from airborne.calibration.from_sources import Calibrated
from airborne.calibration.initial.chaining import Views
from airborne.cameras.finding import Finding
from airborne.cameras.units import odd_distances

Array = NDArray[np.floating]

UP = np.array([0.0, 0.0, 1.0])
MISFIT_PX, MISFIT_SHARE = 4.0, 0.002  # RMS of clicked points; share of the pictures' longer sides


def findings(found: Calibrated) -> tuple[Finding, ...]:
    """Return everything that is wrong, the gravest first; empty for a sound recording."""
    inputs, rig = found.inputs, found.rig
    is_level = bool(inputs.points) or inputs.sources.world.points is not None
    told = [
        inputs.findings,
        _swapped(found),
        below_floor(rig) if "court" in inputs.points else (),
        odd_distances(rig),
        _misfits(found),
        turned_pictures(rig, UP if is_level else None),
        _moved(found),
        _bridges(found),
        _lens_views(found),
        chain.from_iterable(
            clustered_views(camera.name, _all_px(found, i), camera.size) for i, camera in enumerate(rig)
        ),
        _rolling(found),
    ]
    return tuple(chain.from_iterable(told))


def _misfits(found: Calibrated) -> Iterator[Finding]:
    """Doubt clicked points that fit much less well than clicks are made."""
    adjusted, sides = found.adjusted, [max(camera.size) for camera in found.rig]
    for i, source in enumerate(adjusted.sources):
        rms_px = adjusted.rms_px(source=i)
        if source.name in found.inputs.points and rms_px > max(MISFIT_PX, MISFIT_SHARE * float(np.mean(sides))):
            yield Finding(
                kind="misfit",
                what=f"{source.name}: the points fit to {rms_px:.1f} px only, and clicks are good to 1 or 2 px",
                advice="look for points that are mixed up, a court with another net, or a wrong survey",
            )


def _tracks(found: Calibrated) -> Iterator[tuple[Array, Array | None]]:
    """Yield what was seen of each thing that moves: (moments, points, cameras of the rig, 2) [px], and times [s]."""
    inputs, names = found.inputs, found.rig.names
    if inputs.seen is not None:
        yield _board_px(inputs.seen.views, names), inputs.seen.time_s
    for tracks in (inputs.wand, inputs.detections):
        if tracks is not None:
            px = np.full((*tracks.px.shape[:2], len(names), 2), np.nan)
            for k, name in enumerate(tracks.cameras):
                px[:, :, names.index(name)] = tracks.px[:, :, k]
            yield px, None


def _board_px(views: Views, names: tuple[str, ...]) -> Array:
    px = np.full((views.n_moments, len(views.board.corners), len(names), 2), np.nan)
    for name, row in zip(views.cameras, views.sightings, strict=True):
        for moment, sighting in enumerate(row):
            px[moment, sighting.corner, names.index(name)] = sighting.px
    return px


def _all_px(found: Calibrated, camera: int) -> Array:
    return np.concatenate([source.px[source.camera == camera] for source in found.adjusted.sources])


def _swapped(found: Calibrated) -> list[Finding]:
    """Ask the calibration at the start whether two cameras' recordings are exchanged."""
    given = found.inputs.given
    if given is None or found.mended:
        return []
    tracks = [px.reshape(-1, *px.shape[2:]) for px, _ in _tracks(found)]
    return swapped_files(given, np.concatenate(tracks)) if tracks else []


def _moved(found: Calibrated) -> Iterator[Finding]:
    for px, time_s in _tracks(found):
        yield from moved_cameras(found.rig, px, time_s)


def _bridges(found: Calibrated) -> list[Finding]:
    """Count what two cameras see at once, and the known points that tie each to the world."""
    names = found.rig.names
    shared = np.zeros((len(names), len(names)))
    for px, _ in _tracks(found):
        sees = np.isfinite(px[..., 0]).any(axis=1).astype(float)
        shared += sees.T @ sees
    for points in found.inputs.points.values():
        tied = [i for i, name in enumerate(names) if name in points.cameras]
        shared[np.ix_(tied, tied)] += np.inf
    if found.inputs.given is not None:
        return []
    return missing_bridges(names, shared)


def _lens_views(found: Calibrated) -> Iterator[Finding]:
    """Look at the views of the board that tell a lens: their number and tilts."""
    for i, source in enumerate(found.adjusted.sources):
        targets = source.world_from_target
        if targets is None:
            continue
        for c, camera in enumerate(found.rig):
            if camera.name not in found.inputs.lenses or (source.name == "board" and camera.name in found.inputs.alone):
                continue
            moments = np.unique(source.moments[(source.camera == c) & np.isfinite(found.adjusted.residual_px[i][:, 0])])
            if not len(moments):
                continue
            yield from few_views(camera.name, len(moments))
            turns = targets[moments].rotation
            middles = targets[moments].apply(source.points.mean(axis=0)) - camera.centre
            away = np.sum(turns.apply(UP) * middles, axis=1) / np.linalg.norm(middles, axis=1)
            yield from untilted_views(camera.name, np.arccos(np.clip(np.abs(away), 0, 1)))


def _rolling(found: Calibrated) -> Iterator[Finding]:
    """Ask the moving board, where all pictures are of the same instants, whether rows are read one by one."""
    seen = found.inputs.seen
    if seen is None or seen.time_s is None or found.lag_s or len(seen.time_s) < 3:
        return
    row = [source.name for source in found.adjusted.sources].index("board")
    source, residual = found.adjusted.sources[row], found.adjusted.residual_px[row]
    px = _board_px(seen.views, found.rig.names)
    velocity = np.gradient(px, seen.time_s, axis=0)
    for c, camera in enumerate(found.rig):
        own = source.camera == c
        v = velocity[source.moments[own], source.point[own], c]
        yield from rolling_shutter(camera.name, residual[own], v, source.px[own, 1], camera.size[1])
