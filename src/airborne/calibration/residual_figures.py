"""A picture a camera: where it saw something, and how far that lies from where the calibration expects it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from airborne.calibration.from_sources import RigCalibration
from airborne.calibration.sources.board_detection import first_image

_INCHES, _LEAST_INCHES = 9.0, 6.0
_ARROW_SHARE = 0.06  # of a picture's longer side: how long an arrow of the typical residual is drawn
_MOST_ARROWS = 1500
_COLOURS = ("#d95f02", "#1b9e77", "#7570b3", "#e7298a", "#66a61e", "#e6ab02")


def write_residual_figures(folder: Path, found: RigCalibration) -> list[Path]:
    """Write `residuals_<camera>.png` for every camera and return the paths."""
    folder.mkdir(parents=True, exist_ok=True)
    return [
        _write_figure(folder / f"residuals_{_file_name(name)}.png", found, i) for i, name in enumerate(found.rig.names)
    ]


def _write_figure(path: Path, found: RigCalibration, i: int) -> Path:
    """Draw one camera: its picture where there is one, arrows from seen to expected places, magnified."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    camera = found.rig.cameras[i]
    width, height = camera.size
    inches = _INCHES / max(width, height)
    figure = Figure(figsize=(max(width * inches, _LEAST_INCHES), height * inches + 0.9), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    example = (
        found.inputs.board_detections.examples.get(camera.name) if found.inputs.board_detections is not None else None
    )
    if example is None:
        example = first_image(found.inputs.sources, found.inputs.sources.camera[i])
    if example is not None:
        axes.imshow(example, cmap="gray", vmin=-500, vmax=300)  # pale, so that arrows stand out
    rng = np.random.default_rng(0)
    typical = _typical_px(found, i)
    magnified = _ARROW_SHARE * max(width, height) / 2 / typical
    for number, (source, residual) in enumerate(
        zip(found.adjustment.sources, found.adjustment.residual_px, strict=True)
    ):
        rows = np.flatnonzero((source.camera == i) & np.isfinite(residual[:, 0]))
        if len(rows) > _MOST_ARROWS:
            rows = np.sort(rng.choice(rows, _MOST_ARROWS, replace=False))
        if not len(rows):
            continue
        colour, (u, v) = _COLOURS[number % len(_COLOURS)], source.px[rows].T
        du, dv = -residual[rows].T * magnified
        axes.quiver(u, v, du, dv, color=colour, angles="xy", scale_units="xy", scale=1, width=0.0015)
        rms = np.sqrt(np.mean(np.sum(residual[rows] ** 2, axis=1)))
        axes.plot(u, v, ".", color=colour, markersize=2, label=f"{source.name}: {len(rows)} seen, RMS {rms:.2f} px")
    axes.set_xlim(-0.5, width - 0.5)
    axes.set_ylim(height - 0.5, -0.5)
    axes.set_aspect("equal")
    axes.set_title(f"{camera.name}: from where seen to where expected, {magnified:.0f} times", fontsize="medium")
    if axes.get_legend_handles_labels()[0]:
        figure.legend(loc="outside lower left", fontsize="small", ncols=3, markerscale=5)
    figure.savefig(path, dpi=110)
    return path


def _typical_px(found: RigCalibration, i: int) -> float:
    off = np.concatenate(
        [
            np.linalg.norm(residual[source.camera == i], axis=1)
            for source, residual in zip(found.adjustment.sources, found.adjustment.residual_px, strict=True)
        ]
    )
    off = off[np.isfinite(off)]
    return max(float(np.median(off)) if len(off) else 1.0, 1e-3)


def _file_name(name: str) -> str:
    return "".join(letter if letter.isalnum() or letter in "-_" else "_" for letter in name)
