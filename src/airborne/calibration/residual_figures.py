"""A figure a camera: its observations and their residuals, magnified."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.calibration.from_sources import RigCalibration
from airborne.calibration.sources.board_detection import first_image
from airborne.io.figures import save_png
from airborne.io.names import file_stem
from airborne.types import Array

_INCHES, _LEAST_INCHES = 9.0, 6.0  # of a figure's longer side; least width, for the title
# chosen on a wand's 6000 points and on 30 control points: sides of the squares that hold one arrow each, as shares of
# an image's longer side, and the percentile of the residuals whose arrow is as long as that
_LEAST_SQUARE, _MOST_SQUARE, _LONG_PERCENT = 1 / 32, 1 / 16, 90
_FEW = 100  # chosen: of a source's points, such as control points, that are all drawn
_COLOURS = ("#d95f02", "#1b9e77", "#7570b3", "#e7298a", "#66a61e", "#e6ab02")


class _Seen(NamedTuple):
    """What one camera saw of a source."""

    name: str
    colour: str  # the same in all cameras
    px: Array  # (n, 2)
    residual_px: Array  # (n, 2) seen minus expected


def write_residual_figures(folder: Path, calibration: RigCalibration) -> list[Path]:
    """Write `residuals_<camera>.png` for every camera and return the paths."""
    folder.mkdir(parents=True, exist_ok=True)
    return [
        _write_figure(folder / f"residuals_{file_stem(name)}.png", calibration, i)
        for i, name in enumerate(calibration.rig.names)
    ]


def _write_figure(path: Path, calibration: RigCalibration, i: int) -> Path:
    """Draw one camera: an image if there is one, arrows from observed to projected points, magnified."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    camera = calibration.rig.cameras[i]
    width, height = camera.size
    inches = _INCHES / max(width, height)
    figure = Figure(figsize=(max(width * inches, _LEAST_INCHES), height * inches + 0.9), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    example = (
        calibration.inputs.board_detections.examples.get(camera.name)
        if calibration.inputs.board_detections is not None
        else None
    )
    if example is None:
        example = first_image(calibration.inputs.sources, calibration.inputs.sources.camera[i])
    if example is not None:
        axes.imshow(example, cmap="gray", vmin=-500, vmax=300)  # pale, so that arrows stand out
    seen = _seen_by(calibration, i)
    distances = np.concatenate([np.linalg.norm(each.residual_px, axis=1) for each in seen] or [np.ones(1)])
    typical, long = (max(float(np.percentile(distances, share)), 1e-3) for share in (50, _LONG_PERCENT))
    side = np.sqrt(width * height / len(distances))
    side = float(np.clip(side, _LEAST_SQUARE * max(width, height), _MOST_SQUARE * max(width, height)))
    magnified, arrows = side / long, None
    for each, is_drawn in zip(seen, one_per_square([each.px for each in seen], side), strict=True):
        colour, (u, v), (du, dv) = each.colour, each.px[is_drawn].T, -each.residual_px[is_drawn].T * magnified
        arrows = axes.quiver(u, v, du, dv, color=colour, angles="xy", scale_units="xy", scale=1, width=0.0015)
        rms = np.sqrt(np.mean(np.sum(each.residual_px**2, axis=1)))
        n = f"{len(each.px)} seen" if is_drawn.all() else f"{np.count_nonzero(is_drawn)} of {len(each.px)} drawn"
        axes.plot(u, v, ".", color=colour, markersize=2, label=f"{each.name}: {n}, RMS {rms:.2f} px")
    axes.set_xlim(-0.5, width - 0.5)
    axes.set_ylim(height - 0.5, -0.5)
    axes.set_aspect("equal")
    axes.set_title(f"{camera.name}: from where seen to where expected, {magnified:.0f} times", fontsize="medium")
    if arrows is not None:
        axes.quiverkey(arrows, 0.95, 1.03, magnified * typical, f"{typical:.2g} px", labelpos="W", color="black")
        figure.legend(loc="outside lower left", fontsize="small", ncols=3, markerscale=5)
    save_png(figure, path, dpi=110)
    return path


def _seen_by(calibration: RigCalibration, i: int) -> list[_Seen]:
    """Return what one camera saw of each source of which it saw anything."""
    seen = []
    of_sources = zip(calibration.adjustment.sources, calibration.adjustment.residual_px, strict=True)
    for number, (source, residual) in enumerate(of_sources):
        rows = np.flatnonzero((source.camera == i) & np.isfinite(residual[:, 0]))
        if len(rows):
            seen.append(_Seen(source.name, _COLOURS[number % len(_COLOURS)], source.px[rows], residual[rows]))
    return seen


def one_per_square(px: Sequence[Array], side_px: float) -> list[NDArray[np.bool_]]:
    """Say which points (n, 2) of each source are drawn: one in each square of an image, and all of a small source."""
    if not px:
        return []
    n, points = np.array([len(each) for each in px]), np.concatenate(px)
    source = np.repeat(np.arange(len(px)), n)
    order = np.lexsort((np.random.default_rng(0).random(len(points)), n[source]))
    _, first = np.unique(np.floor(points[order] / side_px), axis=0, return_index=True)
    is_drawn = n[source] <= _FEW
    is_drawn[order[first]] = True
    return np.split(is_drawn, np.cumsum(n)[:-1])
