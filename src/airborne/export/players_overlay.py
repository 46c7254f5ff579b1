"""overlay_<camera>.mp4 of several players: the block-jump paper's rectangles, or a graphic for a broadcast."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Literal, Self

import cv2
import numpy as np

from airborne.body.legs import LEG_POINTS, RODS, SHANK_WIDTH_M, THIGH_WIDTH_M
from airborne.cameras import Camera, Rig
from airborne.export.broadcast import Heights, Jumper, draw_heights
from airborne.export.lettering import draw_text, text_width
from airborne.export.overlays import CameraVideos, OverlaysAs, draw_label, line_px, time_label, view_image
from airborne.export.palette import STATUS_RGB
from airborne.tracking import Status
from airborne.tracking.estimate import worst_status
from airborne.tracking.players import PlayerEstimate, PlayerStart
from airborne.types import Array, Image
from airborne.video import Frames

OverlayStyle = Literal["paper", "broadcast"]
_Box = tuple[float, float, float, float]  # left, top, right, bottom [px]

_ROD_WIDTHS_M = (THIGH_WIDTH_M, THIGH_WIDTH_M, SHANK_WIDTH_M, SHANK_WIDTH_M)  # as RODS
GREEN_RGB = (0, 255, 0)  # the paper's
_NAME_SHARE = 1 / 45  # of the image's height
_BITS = 4  # of a pixel, for smooth edges


class PlayersOverlayVideos:
    """One video per camera, written frame by frame; use it in a `with` block."""

    def __init__(
        self,
        folder: Path,
        rig: Rig,
        rate: Fraction,
        *,
        style: OverlayStyle,
        starts: Sequence[PlayerStart],
        drawn: OverlaysAs = "videos",
    ) -> None:
        """Start the videos of the rig's cameras; heights count from the feet in `starts`.

        rate: frames per second. Raises VideoError where a file cannot be written.
        """
        self._style = style
        self._heights = Heights(starts)
        self._videos = CameraVideos(folder, rig, rate, drawn)

    def write(self, frames: Frames, joints: Sequence[str], estimates: Sequence[PlayerEstimate]) -> None:
        """Append what every camera saw at one time, with every player drawn who is not lost."""
        at = [joints.index(name) for name in LEG_POINTS]
        found = [estimate for estimate in estimates if estimate.status is not Status.LOST]
        located = {each.player: (each.points[at], each.status) for each in found}
        heights = self._heights.update(located)
        jumpers = [
            Jumper(player, points, heights[player], is_sure=status is Status.TRACKED)
            for player, (points, status) in located.items()
        ]
        status = worst_status(estimate.status for estimate in estimates)
        images = []
        for view, camera in zip(frames.views, self._videos.cameras, strict=True):
            image = view_image(view, camera)
            if self._style == "broadcast":
                draw_heights(image, camera, jumpers if view is not None else [])
            else:
                names: list[_Box] = []
                for each in found if view is not None else ():
                    own = [each.joint_status[k] for k in at]
                    _draw_rods(image, camera, each.player, points=each.points[at], statuses=own, names=names)
                draw_label(image, time_label(frames, status), camera.name, STATUS_RGB[status])
            images.append(image)
        self._videos.write(frames.index, images)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Finish the files; after an error too, so that they hold what was written."""
        self._videos.__exit__(kind, error, trace)


def rectangle_px(camera: Camera, upper: Array, lower: Array, width_m: float) -> Array | None:
    """Return the corners (4, 2) [px] of a rod's rectangle in an image; None where an end is behind the camera.

    Its axis joins the projected ends (3,) [m], its width is that of a sphere of this diameter at the rod's middle.
    """
    ends = camera.px_from_world(np.stack([upper, lower]))
    if not np.isfinite(ends).all():
        return None
    depth_m = float(camera.camera_from_world.apply((upper + lower) / 2)[2])
    along = ends[1] - ends[0]
    length = float(np.linalg.norm(along))
    across = np.array([-along[1], along[0]]) / length if length > 1e-6 else np.array([1.0, 0.0])
    half = across * (width_m / 2 * float(np.sqrt(camera.K[0, 0] * camera.K[1, 1])) / depth_m)
    return np.stack([ends[0] - half, ends[0] + half, ends[1] + half, ends[1] - half])


def _draw_rods(
    image: Image, camera: Camera, player: str, *, points: Array, statuses: Sequence[Status], names: list[_Box]
) -> None:
    """Draw a player's legs, LEG_POINTS (6, 3) [m], each rod in the colour of the less trusted of its ends.

    The name stands above them, and above the names that are there; it joins these.
    """
    drawn = []
    for (a, b), width_m in zip(RODS, _ROD_WIDTHS_M, strict=True):
        corners = rectangle_px(camera, points[a], points[b], width_m)
        if corners is not None:
            rgb = _rgb(worst_status([statuses[a], statuses[b]]))
            polygon = np.rint(corners * (1 << _BITS)).astype(np.int32)
            cv2.polylines(image, [polygon], True, rgb, max(line_px(image) // 2, 1), cv2.LINE_AA, _BITS)
            drawn.append(corners)
    if drawn:
        highest = np.concatenate(drawn)
        x, y = highest[np.argmin(highest[:, 1])]
        size_px = image.shape[0] * _NAME_SHARE
        box = place_name(x, y - size_px / 2, (text_width(player, size_px=size_px), size_px), names)
        names.append(box)
        draw_text(image, player, (box[0], box[3]), size_px=size_px, rgb=_rgb(worst_status(statuses)))


def place_name(left: float, bottom: float, size: tuple[float, float], taken: Sequence[_Box]) -> _Box:
    """Return the box of a name of some width and height [px], moved up until it is clear of those taken."""
    width, height = size
    box = left, bottom - height, left + width, bottom
    for other in sorted(taken, key=lambda each: -each[3]):
        if box[0] < other[2] and other[0] < box[2] and box[1] < other[3] and other[1] < box[3]:
            box = left, other[1] - height, left + width, other[1]
    return box


def _rgb(status: Status) -> tuple[int, int, int]:
    return GREEN_RGB if status is Status.TRACKED else STATUS_RGB[status]
