"""matching.png: how an image and the rendered body are compared, camera by camera (paper B, fig. 2)."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import Self

from airborne.body import PosedBody
from airborne.cameras import Camera, Rig
from airborne.export.mosaic import ColumnTitle, write_mosaic
from airborne.export.views import cached_surface_arrays, crop_camera, resample_view
from airborne.rendering import FLAT, mask_picture, match_picture, model_picture, render, through_mask
from airborne.tracking import Status
from airborne.types import Image
from airborne.video import Frames, View

TITLES = ("picture", "body", "mask", "through the mask", "match")


class MatchingPicture:
    """Draws the first frame in which the body was tracked; use it in a `with` block."""

    def __init__(self, path: Path, rig: Rig) -> None:
        """Begin; one row for each camera of the rig, whose sizes are those of whole frames."""
        path.unlink(missing_ok=True)
        self._path = path
        self._cameras = [camera.without_distortion() for camera in rig]
        self._is_drawn = False

    def write(self, frames: Frames, posed: PosedBody | None, status: Status) -> None:
        """Draw what every camera saw, the first time that the body is tracked."""
        if self._is_drawn or posed is None or status is not Status.TRACKED:
            return
        rows = [_row(view, camera, posed) for view, camera in zip(frames.views, self._cameras, strict=True)]
        write_mosaic(
            self._path, rows, [camera.name for camera in self._cameras], [ColumnTitle(text) for text in TITLES]
        )
        self._is_drawn = True

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End; the figure is already written."""


def _row(view: View | None, camera: Camera, posed: PosedBody) -> list[Image | None]:
    crop = crop_camera(camera, posed)
    if view is None or crop is None:
        return [None] * len(TITLES)
    observed, rendering = resample_view(view, crop), render(cached_surface_arrays(posed.model), posed, crop, FLAT)
    return [
        observed,
        model_picture(rendering),
        mask_picture(rendering),
        through_mask(observed, rendering),
        match_picture(observed, rendering),
    ]
