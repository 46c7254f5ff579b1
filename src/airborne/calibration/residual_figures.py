"""A figure a camera: its observations and their residuals, magnified."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from airborne.calibration.from_sources import RigCalibration
from airborne.calibration.sources.board_detection import first_image
from airborne.io.figures import save_png
from airborne.io.names import file_stem

_INCHES, _LEAST_INCHES = 9.0, 6.0  # of a figure's longer side; least width, for the title
_ARROW_SHARE = 0.06  # of an image's longer side: the length of an arrow of the median residual
_MOST_ARROWS = 1500  # in a figure, drawn at random
_COLOURS = ("#d95f02", "#1b9e77", "#7570b3", "#e7298a", "#66a61e", "#e6ab02")


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
    rng = np.random.default_rng(0)
    typical = _typical_px(calibration, i)
    magnified, arrows = _ARROW_SHARE * max(width, height) / 2 / typical, None
    for number, (source, residual) in enumerate(
        zip(calibration.adjustment.sources, calibration.adjustment.residual_px, strict=True)
    ):
        rows = np.flatnonzero((source.camera == i) & np.isfinite(residual[:, 0]))
        if len(rows) > _MOST_ARROWS:
            rows = np.sort(rng.choice(rows, _MOST_ARROWS, replace=False))
        if not len(rows):
            continue
        colour, (u, v) = _COLOURS[number % len(_COLOURS)], source.px[rows].T
        du, dv = -residual[rows].T * magnified
        arrows = axes.quiver(u, v, du, dv, color=colour, angles="xy", scale_units="xy", scale=1, width=0.0015)
        rms = np.sqrt(np.mean(np.sum(residual[rows] ** 2, axis=1)))
        axes.plot(u, v, ".", color=colour, markersize=2, label=f"{source.name}: {len(rows)} seen, RMS {rms:.2f} px")
    axes.set_xlim(-0.5, width - 0.5)
    axes.set_ylim(height - 0.5, -0.5)
    axes.set_aspect("equal")
    axes.set_title(f"{camera.name}: from where seen to where expected, {magnified:.0f} times", fontsize="medium")
    if arrows is not None:
        axes.quiverkey(arrows, 0.95, 1.03, magnified * typical, f"{typical:.2g} px", labelpos="W", color="black")
        figure.legend(loc="outside lower left", fontsize="small", ncols=3, markerscale=5)
    save_png(figure, path, dpi=110)
    return path


def _typical_px(calibration: RigCalibration, i: int) -> float:
    distances = np.concatenate(
        [
            np.linalg.norm(residual[source.camera == i], axis=1)
            for source, residual in zip(calibration.adjustment.sources, calibration.adjustment.residual_px, strict=True)
        ]
    )
    distances = distances[np.isfinite(distances)]
    return max(float(np.median(distances)) if len(distances) else 1.0, 1e-3)
