"""The choice of the world frame: known points, the initial calibration, a board, clicked points, a throw, a camera."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration.bundle import Adjustment
from airborne.calibration.initial.values import Inputs
from airborne.calibration.sources.files import pixel_convention
from airborne.calibration.sources.person import align_rigs
from airborne.calibration.world_frame.alignment import estimate_gravity, frame_of_gravity, frame_of_three_points
from airborne.cameras.clicks import read_clicks
from airborne.cameras.consensus import triangulate_consensus
from airborne.cameras.formats.dltdv import read_xypts
from airborne.cameras.formats.options import FileOptions
from airborne.errors import CalibrationError

_IDENTITY = RigidTransform.from_components(np.zeros(3), Rotation.identity())
_FACE_UP = Rotation.from_matrix(
    np.diag([1.0, -1.0, -1.0])
)  # the board's z points into the paper, the world's out of it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WorldFrame:
    """The requested world frame, and what defines it."""

    new_from_old: RigidTransform = _IDENTITY
    scale: float = 1.0
    description: str = ""
    fixed_moment: int | None = None  # of the board, whose pose is then fixed
    fixed_camera: str | None = None
    is_unchanged: bool = False  # the adjustment is in this world already


def choose_world_frame(inputs: Inputs, adjustment: Adjustment, misplaced: Sequence[str]) -> WorldFrame:
    """Choose the world frame that the sources ask for; `misplaced` cameras do not align it with the initial rig.

    Raises CalibrationError where its definition is missing.
    """
    table = inputs.sources.world
    if table.points is not None:
        return _frame_by_points(inputs, adjustment)
    if table.frame == "board" or (table.frame == "auto" and _has_only_board(inputs)):
        return _frame_by_board(inputs, adjustment)
    if adjustment.prior is not None and table.frame in ("auto", "start"):
        return WorldFrame(description=f"as {_start_file(inputs)} has it, scale and all", is_unchanged=True)
    if table.frame == "start" or (table.frame == "auto" and inputs.start_rig is not None and not inputs.points):
        return _frame_by_start(inputs, adjustment, misplaced)
    if table.frame == "auto" and inputs.points:
        return WorldFrame(description=f"that of the {' and the '.join(inputs.points)}", is_unchanged=True)
    first = adjustment.rig.cameras[0]
    description = f"the origin is camera {first.name}, z is where it looks: give [world] for z up"
    return WorldFrame(new_from_old=first.camera_from_world, description=description, fixed_camera=first.name)


def _start_file(inputs: Inputs) -> str:
    return "" if inputs.sources.start is None else inputs.sources.start.file


def _has_only_board(inputs: Inputs) -> bool:
    return inputs.board_detections is not None and inputs.start_rig is None and not inputs.points


def _frame_by_board(inputs: Inputs, adjustment: Adjustment) -> WorldFrame:
    if inputs.board_detections is None:
        raise CalibrationError('[world] frame = "board" needs a board that the cameras see together')
    source = adjustment.sources[adjustment.target_row]
    n_corners = inputs.board_detections.views.n_corners
    moment = inputs.sources.world.moment
    if moment is None:
        moment = int(np.argmax(n_corners.sum(axis=0)))
    if moment >= n_corners.shape[1] or not n_corners[:, moment].any():
        raise CalibrationError(f"[world] moment = {moment}: no camera sees the board then; choose another")
    if source.world_from_target is None:
        raise CalibrationError("the board was not found")
    rotation = RigidTransform.from_rotation(_FACE_UP)
    return WorldFrame(
        new_from_old=rotation * source.world_from_target[moment].inv(),
        description=f"the board at moment {moment}: origin its first corner, x along a row, z out of its face",
        fixed_moment=moment,
    )


def _frame_by_start(inputs: Inputs, adjustment: Adjustment, misplaced: Sequence[str]) -> WorldFrame:
    if inputs.start_rig is None:
        raise CalibrationError('[world] frame = "start" needs [start] file = "..."')
    trusted = [name for name in inputs.start_rig.names if name not in misplaced]
    transform, scale = align_rigs(adjustment.rig, inputs.start_rig, trusted)
    has_scale = any(table.has_lengths for table in inputs.sources.tables.values())
    if has_scale:
        transform, scale = align_rigs(adjustment.rig, inputs.start_rig, trusted, fits_scale=False)
    description = f"as {_start_file(inputs)} has it, by {', '.join(trusted)}"
    return WorldFrame(
        new_from_old=transform, scale=scale, description=description if has_scale else f"{description}, its scale kept"
    )


def _frame_by_points(inputs: Inputs, adjustment: Adjustment) -> WorldFrame:
    """Define the frame by clicked points; the third of them, or a throw, gives the plane."""
    table, rig = inputs.sources.world, adjustment.rig
    names, px = read_clicks(inputs.sources.path(table.points or ""), rig.names)
    position_of = dict(zip(names, triangulate_consensus(rig, px, np.ones(px.shape[:-1])).points, strict=True))
    axis_names = [name for name in (table.origin, table.along_x, table.in_xy) if name is not None]
    for name in axis_names:
        if name not in position_of or not np.isfinite(position_of[name]).all():
            raise CalibrationError(
                f"[world] point '{name}' is not clicked in two cameras that agree; {table.points} has: "
                f"{', '.join(names)}"
            )
    origin, along_x = position_of[axis_names[0]], position_of[axis_names[1]]
    if table.throw is None:
        description = f"origin {axis_names[0]}, x toward {axis_names[1]}, {axis_names[2]} in the plane of x and y"
        return WorldFrame(
            new_from_old=frame_of_three_points(origin, along_x, position_of[axis_names[2]]), description=description
        )
    sizes = {camera.name: camera.size for camera in rig}
    tracks = read_xypts(
        inputs.sources.path(table.throw), FileOptions(size=sizes, pixels=pixel_convention(table.pixels)), rig.names
    )
    points = triangulate_consensus(rig, tracks.px, np.ones(tracks.px.shape[:-1])).points
    times_s = np.arange(len(points)) / (table.rate_hz or 1.0)
    gravity = estimate_gravity(times_s, list(np.swapaxes(points, 0, 1)))
    description = f"{gravity.describe()}; origin {axis_names[0]}, x toward {axis_names[1]}"
    return WorldFrame(new_from_old=frame_of_gravity(gravity, origin, along_x), description=description)
