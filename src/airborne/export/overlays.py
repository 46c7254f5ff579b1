"""overlay_<camera>.mp4: what a camera saw, with the outline of the body where it was found."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import ExitStack
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Self

import cv2
import numpy as np

from airborne.body import PosedBody
from airborne.cameras import Camera, Rig
from airborne.export.palette import STATUS_RGB
from airborne.export.views import Picture, seen_by, shapes_of
from airborne.rendering import FLAT, render
from airborne.tracking import Status
from airborne.video import Frames, VideoWriter, View

LONGEST_SIDE_PX = 1280  # larger pictures are reduced to it
LINE_SHARE = 1 / 240  # of the picture's height
TEXT_SHARE = 1 / 30
MISSING_GREY = 40
FONT = cv2.FONT_HERSHEY_SIMPLEX


class CameraVideos:
    """`overlay_<camera>.mp4` of each camera, written picture by picture; use it in a `with` block."""

    def __init__(self, folder: Path, rig: Rig, rate: Fraction) -> None:
        """Start a file for each camera of the rig, whose sizes are those of whole pictures.

        rate: pictures in a second. Raises VideoError where a file cannot be written.
        """
        self.cameras = tuple(_reduced(camera.undistorted()) for camera in rig)  # of the pictures to write
        with ExitStack() as opened:
            self._writers = [
                opened.enter_context(VideoWriter(folder / f"overlay_{camera.name}.mp4", size=camera.size, rate=rate))
                for camera in self.cameras
            ]
            self._opened = opened.pop_all()

    def write(self, pictures: Iterable[Picture]) -> None:
        """Append one picture of each camera."""
        for picture, writer in zip(pictures, self._writers, strict=True):
            writer.write(picture)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Finish the files; after an error too, so that they hold what was written."""
        self._opened.close()


class OverlayVideos:
    """One video per camera with a body's outline, written picture by picture; use it in a `with` block.

    A killed run leaves videos that can be played up to about a second before its end.
    """

    def __init__(self, folder: Path, rig: Rig, rate: Fraction) -> None:
        """Start the videos of the rig's cameras, whose sizes are those of whole pictures.

        rate: pictures in a second. Raises VideoError where a file cannot be written.
        """
        self._videos = CameraVideos(folder, rig, rate)

    def write(self, frames: Frames, posed: PosedBody | None, status: Status) -> None:
        """Append what every camera saw at one time; no outline is drawn where `posed` is None."""
        pictures = []
        for view, camera in zip(frames.views, self._videos.cameras, strict=True):
            picture = shown(view, camera)
            if view is not None and posed is not None:
                _draw_outline(picture, render(shapes_of(posed.model), posed, camera, FLAT).mask, STATUS_RGB[status])
            if status is Status.LOST:
                _draw_border(picture, STATUS_RGB[status])
            draw_label(picture, time_label(frames, status), STATUS_RGB[status])
            pictures.append(picture)
        self._videos.write(pictures)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Finish the files; after an error too, so that they hold what was written."""
        self._videos.__exit__(kind, error, trace)


def shown(view: View | None, camera: Camera) -> Picture:
    """Return what a view shows in the pixels of `camera`, or a grey picture that says there is none."""
    return _empty(camera) if view is None else seen_by(view, camera)


def time_label(frames: Frames, status: Status) -> str:
    """Return the words in the corner of a picture."""
    return f"frame {frames.index}   {float(frames.time_s):.3f} s   {status}"


def _reduced(camera: Camera) -> Camera:
    width, height = camera.size
    scale = max(1.0, max(width, height) / LONGEST_SIDE_PX)
    size = (round(width / scale), round(height / scale))
    step = (width / size[0], height / size[1])
    return camera.resampled(scale=step, offset=((step[0] - 1) / 2, (step[1] - 1) / 2), size=size)


def _empty(camera: Camera) -> Picture:
    width, height = camera.size
    picture = np.full((height, width, 3), MISSING_GREY, np.uint8)
    scale = height * TEXT_SHARE / 16
    (text_width, text_height), _ = cv2.getTextSize("no picture", FONT, scale, 1)
    at = ((width - text_width) // 2, (height + text_height) // 2)
    cv2.putText(picture, "no picture", at, FONT, scale, (200, 200, 200), 1, cv2.LINE_AA)
    return picture


def _draw_outline(picture: Picture, mask: np.ndarray, rgb: tuple[int, int, int]) -> None:
    """Draw a line close round the mask (h, w), hiding none of it, with a thin dark line between it and the scene."""
    line = line_px(picture)
    inside = mask.astype(np.uint8)
    around = [cv2.dilate(inside, np.ones((2 * px + 1, 2 * px + 1), np.uint8)) for px in (line, line + 1)]
    picture[around[1] > inside] = 0
    picture[around[0] > inside] = rgb


def _draw_border(picture: Picture, rgb: tuple[int, int, int]) -> None:
    height, width = picture.shape[:2]
    line = 3 * line_px(picture)
    cv2.rectangle(picture, (line // 2, line // 2), (width - 1 - line // 2, height - 1 - line // 2), rgb, line)


def draw_label(picture: Picture, text: str, rgb: tuple[int, int, int]) -> None:
    """Write light text on a dark box in the top left corner, with a square of the status's colour before it."""
    em = max(round(picture.shape[0] * TEXT_SHARE), 10)
    scale, margin = em / 30, em // 2
    (text_width, text_height), _ = cv2.getTextSize(text, FONT, scale, 1)
    box = picture[margin : margin + 2 * text_height, margin : margin + text_width + 4 * text_height]
    box[:] = box // 5
    cv2.rectangle(box, (text_height // 2, text_height // 2), (3 * text_height // 2, 3 * text_height // 2), rgb, -1)
    at = (5 * text_height // 2, 3 * text_height // 2)
    cv2.putText(box, text, at, FONT, scale, (255, 255, 255), 1, cv2.LINE_AA)


def line_px(picture: Picture) -> int:
    """Return how thick a line is in a picture [px]."""
    return max(round(picture.shape[0] * LINE_SHARE), 1)
