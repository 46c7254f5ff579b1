"""Where every camera begins, from whatever sources can say it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from airborne.calibration.bundle import FreeParameters
from airborne.calibration.diagnosis.images import check_image_size
from airborne.calibration.initial.chaining import Views, chain_cameras
from airborne.calibration.initial.wand import initial_rig_from_wand
from airborne.calibration.intrinsics.lens_selection import LENS_MODELS, LensFit, choose_lens
from airborne.calibration.sources.board_detection import BoardDetections, detect_boards, detect_lens_board, image_size
from airborne.calibration.sources.boards import Board, board_from_table, read_board
from airborne.calibration.sources.control_points import ControlPoints, read_control_points
from airborne.calibration.sources.court import court_points
from airborne.calibration.sources.files import CameraSource, PixelConventionName, Sources
from airborne.calibration.sources.scene_points import initial_rig_from_points
from airborne.calibration.sources.wand import WandTracks, read_wand
from airborne.calibration.world_frame.alignment import merge_rigs
from airborne.cameras import Camera, Detections, PixelConvention, Rig, read_rig
from airborne.cameras.detections import read_detections
from airborne.cameras.finding import Finding
from airborne.cameras.formats.options import FileOptions
from airborne.cameras.units import check_scales
from airborne.errors import CalibrationError
from airborne.types import Progress

Progress = Callable[[str, int, int | None], None]

_MANY_OBSERVATIONS = 200  # observations of a camera that tell two lens terms without a board


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Inputs:
    """Everything read, and where the cameras begin."""

    sources: Sources
    rig: Rig  # in the order of the file
    free: dict[str, FreeParameters]
    lenses: dict[str, LensFit]
    start_rig: Rig | None  # the calibration that was there before
    board_detections: BoardDetections | None
    lens_views: dict[str, Views]  # by camera, board views for its lens only
    points: dict[str, ControlPoints]  # by source
    wand: WandTracks | None
    detections: Detections | None
    notes: tuple[str, ...]
    findings: tuple[Finding, ...]  # what is wrong with the recordings and starts


def read_inputs(sources: Sources, progress: Progress) -> Inputs:
    """Read all sources and place the cameras roughly; raises an AirborneError for what cannot be used."""
    given = _read_start(sources) if sources.start is not None else None
    sizes = _sizes(sources, given)
    board = _board(sources)
    seen, alone = None, {}
    if board is not None:
        seen, alone = _detect_boards(sources, board, lambda done, n: progress("looking for the board", done, n))
    lenses = _fit_lenses(sources, seen, alone, sizes, progress)
    points = {}
    if sources.control_points is not None:
        points["control points"] = read_control_points(sources.path(sources.control_points.file))
    if sources.court is not None:
        points["court"] = read_control_points(sources.path(sources.court.file), court_points(sources.court.net))
    wand = _wand(sources, sizes)
    detections = None
    if sources.detections is not None:
        detections = read_detections(sources.path(sources.detections.file), sources.names, sources.detections.cameras)
    known = {name: fit.camera for name, fit in lenses.items()}
    if given is not None:
        known |= {camera.name: camera for camera in given if camera.name not in known}
    told_by = {
        name: initial_rig_from_points(table.select(_common(table.cameras, sizes)), sizes, known)
        for name, table in points.items()
    }
    told_by |= {"calibration at the start": given} if given is not None else {}
    if wand is not None:
        told_by["wand"] = initial_rig_from_wand(wand, {name: sizes[name] for name in wand.cameras}, known)
    starts = list(told_by.values())
    if seen is not None:
        starts += _board_starts(seen.views, known, alone_is_enough=sources.kinds == ["board"] and given is None)
    starts = [start for start in starts if len(start)]
    if not starts:
        raise CalibrationError("no source places any camera; each needs four known points, or board or wand views")
    rig = merge_rigs(starts)
    missing = [name for name in sources.names if name not in rig.names]
    if missing:
        raise CalibrationError(
            f"no source says where {', '.join(missing)} stands; show it the board or the wand together with another "
            "camera, or click four known points in its picture"
        )
    rig = Rig(tuple(_with_lens(rig[name], lenses.get(name)) for name in sources.names))
    counts = {name: _n_observations(name, points, wand) for name in sources.names}
    return Inputs(
        sources=sources,
        rig=rig,
        free={
            c.name: _free_parameters(c, lenses.get(c.name), given is not None, counts[c.name]) for c in sources.camera
        },
        lenses=lenses,
        start_rig=given,
        board_detections=seen,
        lens_views=alone,
        points=points,
        wand=wand,
        detections=detections,
        notes=(*(seen.notes if seen is not None else ()), *(detections.notes if detections is not None else ())),
        findings=(*(seen.findings if seen is not None else ()), *check_scales(told_by)),
    )


def pixel_convention(said: PixelConventionName) -> PixelConvention:
    """Return where a table of pixels counts from."""
    corner, _, base = said.rpartition("-")
    return PixelConvention("lower-left" if corner == "lower-left" else "upper-left", int(base))


def _detect_boards(sources: Sources, board: Board, told: Progress) -> tuple[BoardDetections | None, dict[str, Views]]:
    """Return what the cameras saw of the board together, and what those alone that have a recording for it."""
    alone = {camera.name: detect_lens_board(sources, camera, board, told) for camera in sources.camera}
    is_together = any(camera.video or camera.pictures for camera in sources.camera)
    found = {name: views for name, views in alone.items() if views is not None}
    if not is_together and not found:
        raise CalibrationError("[board] needs recordings: add video, pictures or lens_video to each [[camera]]")
    return detect_boards(sources, board, told) if is_together else None, found


def _board(sources: Sources) -> Board | None:
    table = sources.board
    if table is None:
        return None
    if table.file is not None:
        return read_board(sources.path(table.file))
    keys = ("kind", "columns", "rows", "square_m", "marker_m", "dictionary", "inverted", "legacy")
    return board_from_table({key: v for key in keys if (v := getattr(table, key)) is not None}, "[board]")


def _read_start(sources: Sources) -> Rig:
    """Return the calibration of [start] as that of the recordings' own pixels."""
    rig = read_rig(sources.path(sources.start.file if sources.start else ""))
    found = []
    for camera in sources.camera:
        old = replace(rig[camera.calibrated_as or camera.name], name=camera.name)
        size = image_size(sources, camera)
        du, dv = camera.saved_offset_px
        if camera.saved_scale != 1 or (du, dv) != (0, 0):
            scale = (camera.saved_scale, camera.saved_scale)
            width, height = (round(length / camera.saved_scale) for length in old.size)
            old = old.resample(scale=scale, offset=(du, dv), size=size or (width, height))
        for finding in check_image_size(camera.name, old.size, size or old.size):
            raise CalibrationError(finding.sentence)
        found.append(old)
    return Rig(tuple(found))


def _sizes(sources: Sources, given: Rig | None) -> dict[str, tuple[int, int]]:
    sizes = {}
    for camera in sources.camera:
        size = given[camera.name].size if given is not None else image_size(sources, camera)
        if size is None:
            raise CalibrationError(f"camera '{camera.name}': give its video, or size = [width, height] in pixels")
        sizes[camera.name] = size
    return sizes


def _fit_lenses(
    sources: Sources,
    seen: BoardDetections | None,
    alone: dict[str, Views],
    sizes: dict[str, tuple[int, int]],
    told: Progress,
) -> dict[str, LensFit]:
    """Find the lens of every camera that sees the board, by its own recording for that or by the common one."""
    wanted = {}
    for camera in sources.camera:
        views = alone.get(camera.name)
        if views is None and seen is not None and camera.name in seen.views.cameras:
            views = seen.views.of_camera(seen.views.cameras.index(camera.name))
        if views is not None and not (camera.focal == "fixed" and sources.start is not None):
            wanted[camera.name] = (camera, views)
    found = {}
    total, done = sum(len(LENS_MODELS[camera.lens]) for camera, _ in wanted.values()), 0
    for name, (camera, views) in wanted.items():

        def step() -> None:
            nonlocal done
            done += 1
            told("fitting the lenses", done, total)

        found[name] = choose_lens(views, sizes[name], lens=camera.lens, progress=step)
    return found


def _board_starts(views: Views, known: dict[str, Camera], *, alone_is_enough: bool) -> list[Rig]:
    if views.board.is_ambiguous and len(views.cameras) > 1:
        raise CalibrationError(
            "this chessboard looks the same when turned by half, so cameras cannot be linked by it: use a board with "
            "an even and an odd number of inner corners, or a ChArUco board"
        )
    groups = [list(range(len(views.cameras)))] if alone_is_enough else views.groups()
    return [chain_cameras([known[views.cameras[c]] for c in group], views.select_cameras(group))[0] for group in groups]


def _wand(sources: Sources, sizes: dict[str, tuple[int, int]]) -> WandTracks | None:
    table = sources.wand
    if table is None:
        return None
    given = FileOptions(size=dict(sizes), pixels=pixel_convention(table.pixels))
    lengths = table.lengths_m or [table.length_m or 0.0]
    return read_wand(sources.path(table.file), table.cameras or sources.names, given, lengths)


def _common(cameras: tuple[str, ...], sizes: dict[str, tuple[int, int]]) -> list[str]:
    found = [name for name in cameras if name in sizes]
    if not found:
        raise CalibrationError(
            f"the points are clicked in {', '.join(cameras)}; the cameras are {', '.join(sizes)}: use the same names"
        )
    return found


def _with_lens(camera: Camera, fit: LensFit | None) -> Camera:
    """Return the camera with the lens that the board told, at its place."""
    return camera if fit is None else replace(fit.camera, camera_from_world=camera.camera_from_world)


def _n_observations(name: str, points: dict[str, ControlPoints], wand: WandTracks | None) -> int:
    n = sum(int(table.is_seen_by(name).sum()) for table in points.values() if name in table.cameras)
    if wand is not None and name in wand.cameras:
        n += int((wand.px[:, :, wand.cameras.index(name), 0] == wand.px[:, :, wand.cameras.index(name), 0]).sum())
    return n


def _free_parameters(camera: CameraSource, fit: LensFit | None, is_given: bool, n_seen: int) -> FreeParameters:
    """Return what may change: the lens as the board's pictures support it, else as much as there is data for."""
    if fit is not None:
        own = fit.free
    elif is_given and camera.focal in ("auto", "fixed"):
        return FreeParameters(focal=False)
    else:
        own = FreeParameters(n_terms=0 if is_given else 2 if n_seen >= _MANY_OBSERVATIONS else 0)
    if camera.focal == "fixed":
        return replace(own, focal=False)
    return replace(own, shares_focal="shared") if camera.focal == "shared" else own
