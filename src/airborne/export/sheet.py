"""through_mask.png: crops seen through the mask of the tracked body, camera by camera (paper B, figs 7 and 8)."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

import numpy as np

from airborne.body import PosedBody
from airborne.cameras import Camera, Rig
from airborne.export.mosaic import ColumnTitle, write_mosaic
from airborne.export.palette import STATUS_RGB, TEXT_RGB
from airborne.export.views import cached_surface_arrays, crop_camera, resample_view
from airborne.geometry.even_sample import EvenSample
from airborne.rendering import FLAT, render, through_mask
from airborne.tracking import Status
from airborne.types import Image
from airborne.video import Frames, View

_N_COLUMNS = 8  # moments shown
N_BUFFERED = 32  # columns kept while tracking
BACKGROUND_GREY = 205  # around the model


class _Column(NamedTuple):
    title: ColumnTitle
    cells: list[Image | None]  # one per camera


class ContactSheet:
    """Collects crops around the body while it is tracked, at one scale in metres; use it in a `with` block.

    Memory stays flat. The sheet is written at the end of the block: rows are cameras, columns up to eight evenly spaced
    times; no file is written if the body was never found.
    """

    def __init__(self, path: Path, rig: Rig) -> None:
        """Begin an empty sheet; one row for each camera of the rig, whose sizes are those of whole frames."""
        path.unlink(missing_ok=True)
        self._path = path
        self._cameras = [camera.without_distortion() for camera in rig]
        self._columns: EvenSample[_Column] = EvenSample(N_BUFFERED)

    def write(self, frames: Frames, posed: PosedBody | None, status: Status) -> None:
        """Add what every camera saw at one time, except where the body is lost."""
        if posed is None or status is Status.LOST:
            return
        self._columns.offer(lambda: self._column(frames, posed, status))

    def _column(self, frames: Frames, posed: PosedBody, status: Status) -> _Column:
        rgb = STATUS_RGB[status] if status is not Status.TRACKED else TEXT_RGB
        title = ColumnTitle(f"frame {frames.index}\n{float(frames.time_s):.3f} s", rgb)
        cells = [_cell(view, camera, posed) for view, camera in zip(frames.views, self._cameras, strict=True)]
        return _Column(title, cells)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Write the sheet; after an error too, with what was collected."""
        columns = list(self._columns)
        if columns:
            selected = np.linspace(0, len(columns) - 1, min(len(columns), _N_COLUMNS)).round().astype(int)
            rows = list(zip(*(columns[i].cells for i in selected), strict=True))
            titles = [columns[i].title for i in selected]
            names = [camera.name for camera in self._cameras]
            write_mosaic(self._path, rows, names, titles, n_columns=_N_COLUMNS)


def _cell(view: View | None, camera: Camera, posed: PosedBody) -> Image | None:
    crop = crop_camera(camera, posed)
    if view is None or crop is None:
        return None
    rendering = render(cached_surface_arrays(posed.model), posed, crop, FLAT)
    image = through_mask(resample_view(view, crop), rendering)
    image[~rendering.mask] = BACKGROUND_GREY
    return image
