"""Diagnosis of a calibration from any sources, after it: each check with its data."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np

from airborne.calibration.diagnosis.clocks import check_rolling_shutter
from airborne.calibration.diagnosis.coverage import check_coverage, check_links, check_tilts, check_view_count
from airborne.calibration.diagnosis.images import check_floor, check_roll, check_swapped_files
from airborne.calibration.diagnosis.moved_cameras import check_moved_cameras
from airborne.calibration.diagnosis.net import check_net
from airborne.calibration.from_sources import RigCalibration
from airborne.calibration.initial.chaining import Views
from airborne.cameras.finding import Finding
from airborne.cameras.units import check_baselines
from airborne.types import Array

_UP = np.array([0.0, 0.0, 1.0])  # the world's z
_MISFIT_TIMES = 3.0  # chosen: a camera that an object fits so many times worse than most
_MISFIT_PX, _MISFIT_SHARE = 4.0, 0.002  # RMS of clicked points; share of the images' longer sides


def diagnose(calibration: RigCalibration) -> tuple[Finding, ...]:
    """Return everything that is wrong, the most serious first; empty for a good recording."""
    inputs, rig = calibration.inputs, calibration.rig
    is_level = bool(inputs.points) or inputs.sources.world.points is not None
    below = check_floor(rig) if any(table.is_court for table in inputs.sources.tables.values()) else []
    checks = [
        inputs.findings,
        _check_swapped_files(calibration),
        below,
        () if below else check_baselines(rig),  # of a world that is folded over, distances say nothing
        _check_clicks(calibration),
        _check_objects(calibration),
        check_roll(rig, _UP if is_level else None),
        _check_moved_cameras(calibration),
        _check_links(calibration),
        _check_lens_views(calibration),
        chain.from_iterable(
            check_coverage(camera.name, _all_px(calibration, i), camera.size) for i, camera in enumerate(rig)
        ),
        _check_rolling_shutter(calibration),
    ]
    return tuple(chain.from_iterable(checks))


def _check_clicks(calibration: RigCalibration) -> Iterator[Finding]:
    """Report clicked points that fit much worse than clicks are accurate."""
    adjusted, tables = calibration.adjustment, calibration.inputs.sources.tables
    sides = [max(camera.size) for camera in calibration.rig]
    most_px = max(_MISFIT_PX, _MISFIT_SHARE * float(np.mean(sides)))
    for i, source in enumerate(adjusted.sources):
        rms_px = adjusted.rms_px(source=i)
        if not source.is_surveyed or rms_px <= most_px:
            continue
        of_net = tables[source.name].is_court and check_net(
            calibration.rig, calibration.inputs.points[source.name], most_px=most_px
        )
        if of_net:
            yield from of_net
        else:
            yield Finding(
                kind="misfit",
                what=f"{source.name}: the points fit to {rms_px:.1f} px only, and clicks are good to 1 or 2 px",
                advice="look for points that are mixed up, a court with another net, or a wrong survey",
            )


def _check_objects(calibration: RigCalibration) -> Iterator[Finding]:
    """Report cameras that a moving board or wand, found to a pixel, fits much worse than it fits most."""
    adjusted, cameras = calibration.adjustment, calibration.rig.cameras
    for i, source in enumerate(adjusted.sources):
        rms_px = np.array([adjusted.rms_px(source=i, camera=c) for c in range(len(cameras))])
        if not source.is_object or np.isnan(rms_px).all():
            continue
        usual_px = float(np.nanmedian(rms_px))
        for camera, own_px in zip(cameras, rms_px, strict=True):
            if own_px > max(_MISFIT_PX, _MISFIT_SHARE * max(camera.size), _MISFIT_TIMES * usual_px):
                yield Finding(
                    kind="misfit",
                    what=f"{camera.name}: the {source.name} fits to {own_px:.1f} px only, usual are {usual_px:.1f} px",
                    advice="its images may be of other moments, as of a video that begins later (airborne sync); else "
                    "it was moved meanwhile, or its lens is of another kind",
                    cameras=(camera.name,),
                )


def _tracks(calibration: RigCalibration) -> Iterator[tuple[Array, Array | None]]:
    """Yield the observations of each moving object: (moments, points, cameras of the rig, 2) [px], and times [s]."""
    inputs, names = calibration.inputs, calibration.rig.names
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


def _all_px(calibration: RigCalibration, camera: int) -> Array:
    return np.concatenate([source.px[source.camera == camera] for source in calibration.adjustment.sources])


def _check_swapped_files(calibration: RigCalibration) -> list[Finding]:
    """Check with the initial calibration whether two cameras' recordings are exchanged."""
    start_rig = calibration.inputs.start_rig
    if start_rig is None or calibration.resections:
        return []
    tracks = [px.reshape(-1, *px.shape[2:]) for px, _ in _tracks(calibration)]
    return check_swapped_files(start_rig, np.concatenate(tracks)) if tracks else []


def _check_moved_cameras(calibration: RigCalibration) -> Iterator[Finding]:
    for px, time_s in _tracks(calibration):
        yield from check_moved_cameras(calibration.rig, px, time_s)


def _check_links(calibration: RigCalibration) -> list[Finding]:
    """Count what two cameras see at once; known points link a camera to the world."""
    names = calibration.rig.names
    shared = np.zeros((len(names), len(names)))
    for px, _ in _tracks(calibration):
        is_seen = np.isfinite(px[..., 0]).any(axis=1).astype(float)
        shared += is_seen.T @ is_seen
    for points in calibration.inputs.points.values():
        linked = [i for i, name in enumerate(names) if name in points.cameras]
        shared[np.ix_(linked, linked)] += np.inf
    if calibration.inputs.start_rig is not None:
        return []
    return check_links(names, shared)


def _check_lens_views(calibration: RigCalibration) -> Iterator[Finding]:
    """Check the views of the board that determine a lens: their number and tilts."""
    for i, source in enumerate(calibration.adjustment.sources):
        targets = source.world_from_target
        if targets is None:
            continue
        for c, camera in enumerate(calibration.rig):
            if camera.name not in calibration.inputs.lenses or (
                not source.is_of_lens and camera.name in calibration.inputs.lens_views
            ):
                continue
            moments = np.unique(
                source.moments[(source.camera == c) & np.isfinite(calibration.adjustment.residual_px[i][:, 0])]
            )
            if not len(moments):
                continue
            yield from check_view_count(camera.name, len(moments))
            rotations = targets[moments].rotation
            rays = targets[moments].apply(source.points.mean(axis=0)) - camera.centre
            cosines = np.sum(rotations.apply(_UP) * rays, axis=1) / np.linalg.norm(rays, axis=1)
            yield from check_tilts(camera.name, np.arccos(np.clip(np.abs(cosines), 0, 1)))


def _check_rolling_shutter(calibration: RigCalibration) -> Iterator[Finding]:
    """Check for rolling shutters with the moving board, if the cameras are synchronous."""
    board = calibration.inputs.board_detections
    if board is None or board.time_s is None or calibration.lag_s or len(board.time_s) < 3:
        return
    row = calibration.adjustment.target_row
    source, residual = calibration.adjustment.sources[row], calibration.adjustment.residual_px[row]
    px = _board_px(board.views, calibration.rig.names)
    velocity = np.gradient(px, board.time_s, axis=0)
    for c, camera in enumerate(calibration.rig):
        own = source.camera == c
        v = velocity[source.moments[own], source.point[own], c]
        yield from check_rolling_shutter(
            camera.name, residual[own], v, row_px=source.px[own, 1], height_px=camera.size[1]
        )
