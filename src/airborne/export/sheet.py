"""through_mask.png: the pixels that the tracked body claims, camera by camera (paper B, figs 7 and 8)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from airborne.body import BodyModel, Pose, PosedBody
from airborne.cameras import Camera, Rig
from airborne.export.palette import STATUS_RGB, TEXT_RGB, web
from airborne.export.panels import FONT_PT, WIDTH_IN
from airborne.export.views import Picture, seen_by, shapes_of
from airborne.rendering import FLAT, render, through_mask
from airborne.tracking import Status
from airborne.video import Frames, View

Array = NDArray[np.floating]

N_COLUMNS = 8
N_HELD = 32  # columns kept while reading; when full, every second one is dropped
CELL_PX = 160
ROOM = 1.1  # a cell's side in the body's diameters
DPI = 200
BACKGROUND_GREY = 205


class _Column(NamedTuple):
    title: str
    colour: str
    cells: list[Picture | None]  # one per camera


class ContactSheet:
    """Collects crops round the body as frames go by, at one scale in metres; use it in a `with` block.

    Memory stays flat. The sheet is written at the end of the block: rows are cameras, columns up to eight evenly spaced
    times; no file is left where the body was never found.
    """

    def __init__(self, path: Path, rig: Rig) -> None:
        """Begin an empty sheet; one row for each camera of the rig, whose sizes are those of whole pictures."""
        path.unlink(missing_ok=True)
        self._path = path
        self._cameras = [camera.undistorted() for camera in rig]
        self._columns: list[_Column] = []
        self._every, self._n_seen = 1, 0

    def write(self, frames: Frames, posed: PosedBody | None, status: Status) -> None:
        """Consider what every camera saw at one time; nothing is taken where `posed` is None."""
        if posed is None:
            return
        if self._n_seen % self._every == 0:
            if len(self._columns) == N_HELD:
                self._columns, self._every = self._columns[::2], 2 * self._every
            title = f"frame {frames.index}\n{float(frames.time_s):.3f} s"
            colour = web(STATUS_RGB[status] if status is not Status.TRACKED else TEXT_RGB)
            cells = [_cell(view, camera, posed) for view, camera in zip(frames.views, self._cameras, strict=True)]
            self._columns.append(_Column(title, colour, cells))
        self._n_seen += 1

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Write the sheet; after an error too, with what was seen."""
        n = len(self._columns)
        if n:
            chosen = np.linspace(0, n - 1, min(n, N_COLUMNS)).round().astype(int)
            names = [camera.name for camera in self._cameras]
            _sheet_figure([self._columns[i] for i in chosen], names).savefig(self._path)


def _sheet_figure(columns: Sequence[_Column], names: Sequence[str]) -> Figure:
    cell_in = (WIDTH_IN - 0.5) / N_COLUMNS
    figure = Figure((0.5 + cell_in * len(columns), 0.5 + cell_in * len(names)), dpi=DPI)
    figure.set_layout_engine("constrained", w_pad=0.02, h_pad=0.02, wspace=0, hspace=0)
    grid = figure.subplots(len(names), len(columns), squeeze=False)
    for k, column in enumerate(columns):
        grid[0, k].set_title(column.title, fontsize=FONT_PT - 2, color=column.colour)
        for i, cell in enumerate(column.cells):
            _draw_cell(grid[i, k], cell)
    for axes, name in zip(grid[:, 0], names, strict=True):
        axes.set_ylabel(name, fontsize=FONT_PT - 1, color=web(TEXT_RGB))
    return figure


def _cell(view: View | None, camera: Camera, posed: PosedBody) -> Picture | None:
    crop = _close_up(camera, _centre(_points(posed)), ROOM * _diameter_m(posed.model))
    if view is None or crop is None:
        return None
    rendering = render(shapes_of(posed.model), posed, crop, FLAT)
    picture = through_mask(seen_by(view, crop), rendering)
    picture[~rendering.mask] = BACKGROUND_GREY
    return picture


def _draw_cell(axes: Axes, cell: Picture | None) -> None:
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_visible(False)
    if cell is None:
        axes.set_box_aspect(1)
        axes.text(0.5, 0.5, "no picture", ha="center", va="center", fontsize=FONT_PT - 2, transform=axes.transAxes)
    else:
        axes.imshow(cell)


def _close_up(camera: Camera, centre: Array, side_m: float) -> Camera | None:
    """Return the camera of a square crop, `side_m` wide where the body is; None behind the camera."""
    depth_m = camera.camera_from_world.apply(centre)[2]
    if depth_m <= 0:
        return None
    step = side_m / depth_m / CELL_PX * camera.K.diagonal()[:2]  # pixels of the camera to one of the crop
    corner = camera.px_from_world(centre) - step * (CELL_PX - 1) / 2
    return camera.resampled(
        scale=(float(step[0]), float(step[1])), offset=(float(corner[0]), float(corner[1])), size=(CELL_PX, CELL_PX)
    )


@lru_cache(maxsize=2)
def _diameter_m(model: BodyModel) -> float:
    """Measure twice the body's largest distance from its middle, joints straight."""
    points = _points(model.with_pose(Pose(world_from_root=RigidTransform.identity())))
    return 2 * float(np.linalg.norm(points - _centre(points), axis=1).max())


def _points(posed: PosedBody) -> Array:
    """Return corners, and ends of the ellipsoids' axes, in the world: (p, 3) [m]."""
    shapes = shapes_of(posed.model)
    half = np.swapaxes(shapes.ellipsoid_axes * shapes.ellipsoid_semi_axes[:, None], 1, 2)  # rows: half axes
    ends = np.concatenate([shapes.ellipsoid_centre[:, None] + half, shapes.ellipsoid_centre[:, None] - half], axis=1)
    points = np.concatenate([ends.reshape(-1, 3), shapes.corners])
    corner_segment = np.repeat(shapes.polygon_segment, np.diff(shapes.start))
    segment = np.concatenate([np.repeat(shapes.ellipsoid_segment, 6), corner_segment])
    return np.einsum("pij,pj->pi", posed.R[segment], points) + posed.t[segment]


def _centre(points: Array) -> Array:
    return (points.min(axis=0) + points.max(axis=0)) / 2
