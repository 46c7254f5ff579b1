"""through_mask.png: crops seen through the mask of the tracked body, camera by camera (paper B, figs 7 and 8)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from airborne.body import PosedBody
from airborne.cameras import Camera, Rig
from airborne.export.palette import STATUS_RGB, TEXT_RGB, hex_colour
from airborne.export.panels import FONT_PT, WIDTH_IN
from airborne.export.views import cached_surface_arrays, crop_camera, resample_view
from airborne.geometry.even_sample import EvenSample
from airborne.io.figures import save_png
from airborne.rendering import FLAT, render, through_mask
from airborne.tracking import Status
from airborne.types import Image
from airborne.video import Frames, View

_N_COLUMNS = 8  # moments shown
N_BUFFERED = 32  # columns kept while tracking
SHEET_DPI = 200  # of a sheet in print
BACKGROUND_GREY = 205  # around the model


class _Column(NamedTuple):
    title: str
    colour: str
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
        title = f"frame {frames.index}\n{float(frames.time_s):.3f} s"
        colour = hex_colour(STATUS_RGB[status] if status is not Status.TRACKED else TEXT_RGB)
        cells = [_cell(view, camera, posed) for view, camera in zip(frames.views, self._cameras, strict=True)]
        return _Column(title, colour, cells)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Write the sheet; after an error too, with what was collected."""
        columns = list(self._columns)
        if columns:
            selected = np.linspace(0, len(columns) - 1, min(len(columns), _N_COLUMNS)).round().astype(int)
            names = [camera.name for camera in self._cameras]
            save_png(_sheet_figure([columns[i] for i in selected], names), self._path)


def _sheet_figure(columns: Sequence[_Column], names: Sequence[str]) -> Figure:
    cell_in = (WIDTH_IN - 0.5) / _N_COLUMNS
    figure = Figure((0.5 + cell_in * len(columns), 0.5 + cell_in * len(names)), dpi=SHEET_DPI)
    figure.set_layout_engine("constrained", w_pad=0.02, h_pad=0.02, wspace=0, hspace=0)
    grid = figure.subplots(len(names), len(columns), squeeze=False)
    for k, column in enumerate(columns):
        grid[0, k].set_title(column.title, fontsize=FONT_PT - 2, color=column.colour)
        for i, cell in enumerate(column.cells):
            draw_cell(grid[i, k], cell)
    for axes, name in zip(grid[:, 0], names, strict=True):
        axes.set_ylabel(name, fontsize=FONT_PT - 1, color=hex_colour(TEXT_RGB))
    return figure


def _cell(view: View | None, camera: Camera, posed: PosedBody) -> Image | None:
    crop = crop_camera(camera, posed)
    if view is None or crop is None:
        return None
    rendering = render(cached_surface_arrays(posed.model), posed, crop, FLAT)
    image = through_mask(resample_view(view, crop), rendering)
    image[~rendering.mask] = BACKGROUND_GREY
    return image


def draw_cell(axes: Axes, cell: Image | None) -> None:
    """Show an image without axes, or say that there is none."""
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_visible(False)
    if cell is None:
        axes.set_box_aspect(1)
        axes.text(0.5, 0.5, "no picture", ha="center", va="center", fontsize=FONT_PT - 2, transform=axes.transAxes)
    else:
        axes.imshow(cell)


def cell_figure(
    rows: Sequence[Sequence[Image | None]], names: Sequence[str], titles: Sequence[str], *, aspect: float = 1.0
) -> Figure:
    """Return a figure of report width, images in rows with names, titles above; aspect: height over width of a cell."""
    cell_in = (WIDTH_IN - 0.5) / len(titles)
    figure = Figure((WIDTH_IN, 0.4 + aspect * cell_in * len(rows)), dpi=SHEET_DPI)
    figure.set_layout_engine("constrained", w_pad=0.02, h_pad=0.02, wspace=0, hspace=0)
    grid = figure.subplots(len(rows), len(titles), squeeze=False)
    for axes, title in zip(grid[0], titles, strict=True):
        axes.set_title(title, fontsize=FONT_PT - 1, color=hex_colour(TEXT_RGB))
    for i, (row, name) in enumerate(zip(rows, names, strict=True)):
        for axes, cell in zip(grid[i], row, strict=True):
            draw_cell(axes, cell)
        grid[i, 0].set_ylabel(name, fontsize=FONT_PT - 1, color=hex_colour(TEXT_RGB))
    return figure
