"""Initial values of every camera, from whatever sources determine them."""

from __future__ import annotations

from dataclasses import dataclass, replace

from airborne.calibration.bundle import FreeParameters
from airborne.calibration.initial.chaining import Views, chain_cameras
from airborne.calibration.initial.mirrored import find_mirrored_cameras
from airborne.calibration.initial.reading import (
    common_cameras,
    detect_all_boards,
    read_known_points,
    read_sizes,
    read_source_board,
    read_start_rig,
)
from airborne.calibration.initial.wand import initial_rig_from_wand
from airborne.calibration.initial.wand_fisheyes import initial_rig_from_wand_and_fisheyes
from airborne.calibration.intrinsics.lens_selection import LENS_MODELS, LensFit, choose_lens, lenses_from_points
from airborne.calibration.sources.board_detection import BoardDetections
from airborne.calibration.sources.control_points import ControlPoints
from airborne.calibration.sources.files import CameraSource, Sources
from airborne.calibration.sources.scene_points import initial_rig_from_points
from airborne.calibration.sources.wand import WandTracks
from airborne.calibration.sources.wand_detection import find_wand
from airborne.calibration.world_frame.alignment import merge_rigs
from airborne.cameras import Camera, Detections, Rig
from airborne.cameras.detections import read_detections
from airborne.cameras.finding import Finding
from airborne.cameras.units import check_scales
from airborne.errors import CalibrationError
from airborne.types import StageProgress

_MANY_OBSERVATIONS = 200  # observations of a camera that determine two lens terms without a board


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Inputs:
    """Everything read, and the initial cameras."""

    sources: Sources
    rig: Rig  # in the order of the file
    free: dict[str, FreeParameters]
    lenses: dict[str, LensFit]
    start_rig: Rig | None  # the calibration of [start]
    board_detections: BoardDetections | None
    lens_views: dict[str, Views]  # by camera, views of the board for its lens only
    points: dict[str, ControlPoints]  # by source
    wand: WandTracks | None
    detections: Detections | None
    notes: tuple[str, ...]
    findings: tuple[Finding, ...]  # what is wrong with the recordings and initial values

    @property
    def are_surveyed_points(self) -> bool:
        """Whether there is nothing but points of exactly known places."""
        return len(self.points) == len(self.sources.tables) and all(each.sd_m is None for each in self.points.values())


def read_inputs(sources: Sources, progress: StageProgress) -> Inputs:
    """Read all sources and find initial cameras; raises an AirborneError for what cannot be used."""
    start_rig = read_start_rig(sources) if sources.start is not None else None
    sizes = read_sizes(sources, start_rig)
    board = read_source_board(sources)
    board_detections, lens_views = None, {}
    if board is not None:
        board_detections, lens_views = detect_all_boards(
            sources, board, lambda done, n: progress("looking for the board", done, n)
        )
    lenses = _fit_lenses(
        sources, board_detections=board_detections, lens_views=lens_views, sizes=sizes, progress=progress
    )
    points = read_known_points(sources, sizes)
    found = find_wand(sources, sizes, lambda done, n: progress("looking for the wand", done, n))
    wand = None if found is None else found.tracks
    fisheyes = [camera.name for camera in sources.camera if camera.lens == "fisheye"]
    detections = None
    if sources.detections is not None:
        own = sources.detections
        detections = read_detections(sources.path(own.file), sources.names, own.cameras, skeleton=own.skeleton)
    for table in points.values() if start_rig is None else ():
        unknown = [name for name in common_cameras(table.cameras, sizes) if name not in lenses]
        lenses |= lenses_from_points(
            initial_rig_from_points(table.select(unknown), sizes, fisheyes=fisheyes),
            table,
            lambda done, n: progress("fitting the lenses", done, n),
        )
    known_lenses = {name: fit.camera for name, fit in lenses.items()}
    if start_rig is not None:
        known_lenses |= {camera.name: camera for camera in start_rig if camera.name not in known_lenses}
    start_of = {
        name: initial_rig_from_points(
            table.select(common_cameras(table.cameras, sizes)), sizes, known_lenses, fisheyes=fisheyes
        )
        for name, table in points.items()
    }
    start_of |= {"calibration at the start": start_rig} if start_rig is not None else {}
    if wand is not None:
        unknown = [name for name in wand.cameras if name in fisheyes and name not in known_lenses]
        wand_sizes = {name: sizes[name] for name in wand.cameras}
        start_of["wand"] = (
            initial_rig_from_wand_and_fisheyes(wand, wand_sizes, known_lenses, unknown)
            if unknown
            else initial_rig_from_wand(wand, wand_sizes, known_lenses)
        )
    starts = list(start_of.values())
    if board_detections is not None:
        starts += _board_starts(
            board_detections.views, known_lenses, alone_is_enough=len(sources.tables) == 1 and start_rig is None
        )
    starts = [start for start in starts if len(start)]
    if not starts:
        raise CalibrationError(
            "no source determines the pose of any camera; each needs four known points, or views of board or wand"
        )
    rig = merge_rigs(starts)
    missing = [name for name in sources.names if name not in rig.names]
    if missing:
        raise CalibrationError(
            f"no source determines where {', '.join(missing)} stands; show it the board or the wand together with "
            "another camera, or click four known points in its image"
        )
    rig = Rig(tuple(_with_lens(rig[name], lenses.get(name)) for name in sources.names))
    counts = {name: _n_observations(name, points, wand) for name in sources.names}
    return Inputs(
        sources=sources,
        rig=rig,
        free={
            c.name: _free_parameters(c, lenses.get(c.name), start_rig is not None, counts[c.name])
            for c in sources.camera
        },
        lenses=lenses,
        start_rig=start_rig,
        board_detections=board_detections,
        lens_views=lens_views,
        points=points,
        wand=wand,
        detections=detections,
        notes=tuple(note for each in (board_detections, found, detections) if each is not None for note in each.notes),
        findings=(
            *(finding for each in (board_detections, found) if each is not None for finding in each.findings),
            *check_scales(start_of),
        ),
    )


def _fit_lenses(
    sources: Sources,
    *,
    board_detections: BoardDetections | None,
    lens_views: dict[str, Views],
    sizes: dict[str, tuple[int, int]],
    progress: StageProgress,
) -> dict[str, LensFit]:
    """Fit the lens of every camera that sees the board, from its own lens recording or from the common one."""
    wanted = {}
    for camera in sources.camera:
        views = lens_views.get(camera.name)
        if views is None and board_detections is not None and camera.name in board_detections.views.cameras:
            views = board_detections.views.of_camera(board_detections.views.cameras.index(camera.name))
        if views is not None and not (camera.focal == "fixed" and sources.start is not None):
            wanted[camera.name] = (camera, views)
    fits = {}
    total, done = sum(len(LENS_MODELS[camera.lens]) for camera, _ in wanted.values()), 0
    for name, (camera, views) in wanted.items():

        def step() -> None:
            nonlocal done
            done += 1
            progress("fitting the lenses", done, total)

        fits[name] = choose_lens(views, sizes[name], lens=camera.lens, progress=step)
    return fits


def _board_starts(views: Views, known_lenses: dict[str, Camera], *, alone_is_enough: bool) -> list[Rig]:
    if views.board.is_ambiguous and len(views.cameras) > 1:
        raise CalibrationError(
            "this chessboard looks the same after half a revolution, so cameras cannot be linked by it: use a board "
            "with an even and an odd number of inner corners, or a ChArUco board"
        )
    if views.board.is_two_sided:
        mirrored = find_mirrored_cameras([known_lenses[name] for name in views.cameras], views)
        if mirrored:
            raise CalibrationError(
                f"{', '.join(mirrored)}: the board is seen mirrored, but no place behind it fits all moments: its "
                "images are mirrored; switch off the camera's mirror image and record or convert anew"
            )
    groups = [list(range(len(views.cameras)))] if alone_is_enough else views.groups()
    return [
        chain_cameras([known_lenses[views.cameras[c]] for c in group], views.select_cameras(group))[0]
        for group in groups
    ]


def _with_lens(camera: Camera, fit: LensFit | None) -> Camera:
    """Return the camera with the lens fitted to the board, in its pose."""
    return camera if fit is None else replace(fit.camera, camera_from_world=camera.camera_from_world)


def _n_observations(name: str, points: dict[str, ControlPoints], wand: WandTracks | None) -> int:
    n = sum(int(table.is_seen_by(name).sum()) for table in points.values() if name in table.cameras)
    if wand is not None and name in wand.cameras:
        n += int((wand.px[:, :, wand.cameras.index(name), 0] == wand.px[:, :, wand.cameras.index(name), 0]).sum())
    return n


def _free_parameters(camera: CameraSource, fit: LensFit | None, has_start: bool, n_observations: int) -> FreeParameters:
    """Return the free parameters: the lens model that the board supports, else as many as the data support."""
    if fit is None and has_start and camera.focal in ("auto", "fixed"):
        return FreeParameters(focal=False)
    own = FreeParameters() if fit is None else fit.free
    n_others = n_observations - (fit.n_views if fit is not None else 0)
    if (fit is None or fit.is_of_points) and not has_start and n_others >= _MANY_OBSERVATIONS:
        own = replace(own, n_terms=max(own.n_terms, 2))
    if camera.focal == "fixed":
        return replace(own, focal=False)
    return replace(own, shares_focal="shared") if camera.focal == "shared" else own
