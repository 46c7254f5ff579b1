"""What the sources of a file hold, read and looked for in recordings: boards, saved cameras, sizes, points."""

from __future__ import annotations

from dataclasses import replace

from airborne.calibration.diagnosis.control_points import check_inside
from airborne.calibration.diagnosis.images import check_image_size
from airborne.calibration.initial.chaining import Views
from airborne.calibration.sources.board_detection import BoardDetections, detect_boards, detect_lens_board, image_size
from airborne.calibration.sources.boards import Board, board_from_table, read_board
from airborne.calibration.sources.control_points import ControlPoints, read_control_points
from airborne.calibration.sources.files import Sources, SurveyTable
from airborne.cameras import Rig, read_rig
from airborne.errors import CalibrationError
from airborne.types import Progress


def detect_all_boards(
    sources: Sources, board: Board, progress: Progress
) -> tuple[BoardDetections | None, dict[str, Views]]:
    """Detect the board in the common recordings, and in those for one camera's lens."""
    lens_views = {camera.name: detect_lens_board(sources, camera, board, progress) for camera in sources.camera}
    is_together = any(camera.video or camera.pictures for camera in sources.camera)
    seen_alone = {name: views for name, views in lens_views.items() if views is not None}
    if not is_together and not seen_alone:
        raise CalibrationError("[board] needs recordings: add video, pictures or lens_video to each [[camera]]")
    return detect_boards(sources, board, progress) if is_together else None, seen_alone


def read_source_board(sources: Sources) -> Board | None:
    """Return the board of [board] or of its file; None without that table."""
    table = sources.board
    if table is None:
        return None
    if table.file is not None:
        return read_board(sources.path(table.file))
    keys = (
        "kind",
        "columns",
        "rows",
        "square_m",
        "marker_m",
        "dictionary",
        "inverted",
        "legacy",
        "two_sided",
        "thickness_m",
    )
    return board_from_table({key: v for key in keys if (v := getattr(table, key)) is not None}, "[board]")


def read_start_rig(sources: Sources) -> Rig:
    """Return the calibration of [start] in the recordings' own pixels."""
    rig = read_rig(sources.path(sources.start.file if sources.start else ""))
    cameras = []
    for camera in sources.camera:
        calibrated = replace(rig[camera.calibrated_as or camera.name], name=camera.name)
        size = image_size(sources, camera)
        du, dv = camera.saved_offset_px
        if camera.saved_scale != 1 or (du, dv) != (0, 0):
            scale = (camera.saved_scale, camera.saved_scale)
            width, height = (round(length / camera.saved_scale) for length in calibrated.size)
            calibrated = calibrated.resample(scale=scale, offset=(du, dv), size=size or (width, height))
        for finding in check_image_size(camera.name, calibrated.size, size or calibrated.size):
            raise CalibrationError(finding.sentence)
        cameras.append(calibrated)
    return Rig(tuple(cameras))


def read_sizes(sources: Sources, start_rig: Rig | None) -> dict[str, tuple[int, int]]:
    """Return each camera's (width, height) [px]; raises CalibrationError for one whose size nothing tells."""
    sizes = {}
    for camera in sources.camera:
        size = start_rig[camera.name].size if start_rig is not None else image_size(sources, camera)
        if size is None:
            raise CalibrationError(f"camera '{camera.name}': give its video, or size = [width, height] in pixels")
        sizes[camera.name] = size
    return sizes


def read_known_points(sources: Sources, sizes: dict[str, tuple[int, int]]) -> dict[str, ControlPoints]:
    """Read the points of known places; raises CalibrationError where one lies outside its image."""
    points = {
        name: read_control_points(sources.path(table.file), table.scene_points())
        for name, table in sources.tables.items()
        if isinstance(table, SurveyTable)
    }
    for table in points.values():
        for camera in common_cameras(table.cameras, sizes):
            check_inside(table, camera, sizes)
    return points


def common_cameras(cameras: tuple[str, ...], sizes: dict[str, tuple[int, int]]) -> list[str]:
    """Return the names that clicked points and cameras share; raises CalibrationError where they share none."""
    names = [name for name in cameras if name in sizes]
    if not names:
        raise CalibrationError(
            f"the points are clicked in {', '.join(cameras)}; the cameras are {', '.join(sizes)}: use the same names"
        )
    return names
