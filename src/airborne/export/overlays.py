"""overlay_<camera>.mp4: what a camera saw, with the outline of the tracked body."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack, nullcontext
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Literal, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.body import PosedBody
from airborne.cameras import Camera, Rig
from airborne.export.film import Film
from airborne.export.lettering import draw_text
from airborne.export.lettering import text_width as width_of
from airborne.export.palette import STATUS_RGB
from airborne.export.pictures import encode_png
from airborne.export.views import cached_surface_arrays, resample_view
from airborne.io.names import file_stem
from airborne.io.writing import explain_full_disk
from airborne.motion.run_folder import PICTURES
from airborne.rendering import FLAT, render
from airborne.tracking import Status
from airborne.types import Image
from airborne.video import Frames, VideoWriter, View

OverlaysAs = Literal["videos", "stills"]

LONGEST_SIDE_PX = 1280  # larger images are reduced to it
_LINE_SHARE = 1 / 240  # of the image's height
_TEXT_SHARE = 1 / 30  # of the image's height
_SMALLER = 0.6  # chosen: of that size, down to which a label shrinks so that it fits
_MISSING_GREY = 40  # stands in for an image that is missing
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_PRESET, _CRF = "ultrafast", 20  # of the encoder: docs/speed.md has what it costs and saves


@dataclass(frozen=True, slots=True)
class _Still:
    """A picture file in the place of a video: the last image written stays."""

    path: Path

    def write(self, image: Image) -> None:
        with explain_full_disk(self.path):
            self.path.write_bytes(encode_png(image))


class CameraVideos:
    """`overlay_<camera>.mp4` of each camera, written frame by frame, and some pictures of them for the report.

    Use it in a `with` block.
    """

    def __init__(self, folder: Path, rig: Rig, rate: Fraction, drawn: OverlaysAs = "videos") -> None:
        """Start a file for each camera of the rig, whose sizes are those of whole frames; "stills" as PNG.

        rate: frames per second. Raises VideoError where a file cannot be written.
        """
        self.cameras = tuple(_reduce_camera(camera.without_distortion()) for camera in rig)  # of the images to write
        with ExitStack() as stack:
            self._writers = [
                stack.enter_context(
                    VideoWriter(
                        folder / f"overlay_{file_stem(camera.name)}.mp4",
                        size=camera.size,
                        rate=rate,
                        preset=_PRESET,
                        crf=_CRF,
                    )
                    if drawn == "videos"
                    else nullcontext(_Still(folder / f"overlay_{file_stem(camera.name)}.png"))
                )
                for camera in self.cameras
            ]
            self._stack = stack.pop_all()
        self._film = Film(folder / PICTURES, [camera.name for camera in rig]) if drawn == "videos" else None

    def write(self, frame: int, images: Sequence[Image]) -> None:
        """Append one image of each camera."""
        if self._film is not None:
            self._film.add(frame, images)
        for image, writer in zip(images, self._writers, strict=True):
            writer.write(image)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Finish the files; after an error too, so that they hold what was written."""
        self._stack.__exit__(kind, error, trace)
        if self._film is not None:
            self._film.write()


class OverlayVideos:
    """One video per camera with a body's outline, written frame by frame; use it in a `with` block.

    A killed run leaves videos that can be played up to about a second before its end.
    """

    def __init__(self, folder: Path, rig: Rig, rate: Fraction, drawn: OverlaysAs = "videos") -> None:
        """Start the videos of the rig's cameras, whose sizes are those of whole frames.

        rate: frames per second. Raises VideoError where a file cannot be written.
        """
        self._videos = CameraVideos(folder, rig, rate, drawn)

    def write(
        self, frames: Frames, posed: PosedBody | None, status: Status, doubtful: NDArray[np.bool_] | None = None
    ) -> None:
        """Append what every camera saw at one time; no outline is drawn where `posed` is None.

        doubtful (segments,): these are drawn in the colour of an uncertain frame.
        """
        images = []
        for view, camera in zip(frames.views, self._videos.cameras, strict=True):
            image = view_image(view, camera)
            if view is not None and posed is not None:
                drawn = render(cached_surface_arrays(posed.model), posed, camera, FLAT)
                _draw_outline(image, drawn.mask, STATUS_RGB[status])
                if doubtful is not None and doubtful.any():
                    shown = drawn.mask & doubtful[np.maximum(drawn.segment, 0)]
                    _draw_outline(image, shown, STATUS_RGB[Status.UNCERTAIN])
            if status is Status.LOST:
                _draw_border(image, STATUS_RGB[status])
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


def view_image(view: View | None, camera: Camera) -> Image:
    """Return a view resampled to the pixels of `camera`, or a grey image that says there is none."""
    return _missing_image(camera) if view is None else resample_view(view, camera)


def time_label(frames: Frames, status: Status) -> str:
    """Return the text in the corner of an image."""
    return f"frame {frames.index}   {float(frames.time_s):.3f} s   {status}"


def _reduce_camera(camera: Camera) -> Camera:
    width, height = camera.size
    scale = max(1.0, max(width, height) / LONGEST_SIDE_PX)
    size = (round(width / scale), round(height / scale))
    step = (width / size[0], height / size[1])
    return camera.resample(scale=step, offset=((step[0] - 1) / 2, (step[1] - 1) / 2), size=size)


def _missing_image(camera: Camera) -> Image:
    width, height = camera.size
    image = np.full((height, width, 3), _MISSING_GREY, np.uint8)
    scale = height * _TEXT_SHARE / 16
    (text_width, text_height), _ = cv2.getTextSize("no picture", _FONT, scale, 1)
    at = ((width - text_width) // 2, (height + text_height) // 2)
    cv2.putText(image, "no picture", at, _FONT, scale, (200, 200, 200), 1, cv2.LINE_AA)
    return image


def _draw_outline(image: Image, mask: np.ndarray, rgb: tuple[int, int, int]) -> None:
    """Draw a line close round the mask (h, w), hiding none of it, with a thin dark line between it and the scene."""
    line = line_px(image)
    inside = mask.astype(np.uint8)
    around = [cv2.dilate(inside, np.ones((2 * px + 1, 2 * px + 1), np.uint8)) for px in (line, line + 1)]
    image[around[1] > inside] = 0
    image[around[0] > inside] = rgb


def _draw_border(image: Image, rgb: tuple[int, int, int]) -> None:
    height, width = image.shape[:2]
    line = 3 * line_px(image)
    cv2.rectangle(image, (line // 2, line // 2), (width - 1 - line // 2, height - 1 - line // 2), rgb, line)


def draw_label(image: Image, text: str, name: str, rgb: tuple[int, int, int]) -> None:
    """Write light text on a dark box in the top left corner, before it a square of the status's colour, then a name.

    Smaller where the name needs it, as in an upright image; one that does not fit then is cut.
    """
    whole = max(round(image.shape[0] * _TEXT_SHARE), 10)
    sizes = range(whole, max(round(_SMALLER * whole), 10) - 1, -1)
    em = next((em for em in sizes if _place_name(text, name, em)[1] + em // 2 <= image.shape[1]), whole)
    scale, margin = em / 30, em // 2
    (_, text_height), _ = cv2.getTextSize(text, _FONT, scale, 1)
    name_at, right = _place_name(text, name, em)
    box = image[margin : margin + 2 * text_height, margin:right]
    box[:] = box // 5
    cv2.rectangle(box, (text_height // 2, text_height // 2), (3 * text_height // 2, 3 * text_height // 2), rgb, -1)
    at = (5 * text_height // 2, 3 * text_height // 2)
    cv2.putText(box, text, at, _FONT, scale, (255, 255, 255), 1, cv2.LINE_AA)
    draw_text(box, name, (name_at, at[1]), size_px=text_height, rgb=(255, 255, 255))


def _place_name(text: str, name: str, em: int) -> tuple[int, int]:
    """Return where a label's name begins in its box, and where the box ends in the image [px]."""
    (text_width, text_height), _ = cv2.getTextSize(text, _FONT, em / 30, 1)
    begins = 7 * text_height // 2 + text_width
    return begins, em // 2 + begins + round(width_of(name, size_px=text_height)) + text_height


def line_px(image: Image) -> int:
    """Return the thickness of a line in an image [px]."""
    return max(round(image.shape[0] * _LINE_SHARE), 1)
