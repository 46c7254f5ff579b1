"""Figures of an analysis: residuals over cut-offs, agreement with another measurement."""

from __future__ import annotations

import re
from collections.abc import Sequence
from math import ceil, floor, isfinite, log10
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from airborne.errors import format_digits
from airborne.evaluation import Agreement, Series
from airborne.evaluation.compare import or_dash
from airborne.export import panels
from airborne.export.palette import CYCLE, GREEN, PURPLE, VERMILION
from airborne.io.figures import save_png
from airborne.motion.smoothing import ResidualAnalysis
from airborne.types import Array

_CHOSEN, _OTHER = VERMILION, "#333333"
_COLOURS = (*CYCLE, "#333333")


def write_residuals(path: Path, analysis: ResidualAnalysis, used_hz: float | None = None) -> None:
    """Draw the residual of a Butterworth filter over its cut-off, with the noise line and the cut-offs chosen.

    `used_hz` is the cut-off that was applied, if any.
    """
    figure = Figure((panels.WIDTH_IN, 3.6), dpi=panels.DPI, layout="constrained")
    axes = figure.subplots()
    _style_axes(axes)
    start, slope = (1e3 * each for each in analysis.line)
    f, residual = analysis.cutoff_hz, 1e3 * analysis.residual
    axes.plot(f, residual, color=panels.LINE, label="residual, all joints and axes")
    if np.isfinite(start):
        axes.plot(f, np.maximum(start + slope * f, 0), "--", color=_OTHER, linewidth=1, label="line of noise alone")
        axes.axhline(start, color=_OTHER, linewidth=0.6, label=f"RMS of the noise: {format_digits(start, 2)} mm")
        axes.set_ylim(0, max(4 * start, 1.2 * float(np.interp(f[-1] / 6, f, residual))))
    for hz, colour, style, label in (
        (analysis.chosen_hz, _CHOSEN, "-", "Winter"),
        (analysis.whitest_hz, PURPLE, ":", "whitest residuals (Challis)"),
        (used_hz, GREEN, "-.", "used"),
    ):
        if hz is not None and np.isfinite(hz):
            axes.axvline(hz, color=colour, linestyle=style, linewidth=1.2, label=f"{label}: {hz:.1f} Hz")
    axes.set_xlim(0, f[-1])
    axes.set_xlabel("cut-off [Hz]", fontsize=panels.FONT_PT, color=panels.TEXT)
    panels.label_panel(axes, "RMS residual [mm]")
    axes.legend(fontsize=panels.FONT_PT - 1, frameon=False, labelcolor=panels.TEXT)
    save_png(figure, path)


def write_bland_altman(path: Path, variables: Sequence[tuple[Series, Agreement]]) -> None:
    """Draw differences over means, one panel a variable, with bias, limits of agreement and their 95 % intervals.

    Individuals differ in colour. Source: Bland and Altman 1986, 1999.
    """
    figure, grid = _panels(variables)
    figure.legend(
        handles=[
            Line2D([], [], color=_OTHER, linewidth=1.0, label="bias"),
            Line2D([], [], color=_OTHER, linewidth=1.0, linestyle="--", label="95 % limits of agreement"),
            Patch(facecolor=_OTHER, alpha=0.12, linewidth=0, label="95 % intervals of all three"),
        ],
        loc="outside upper center", ncols=min(3, len(variables)), fontsize=panels.FONT_PT - 1, frameon=False,
        labelcolor=panels.TEXT,
    )  # fmt: skip
    for axes, (series, row) in zip(grid, variables, strict=False):
        measured, reference = series.drop_missing().values.T
        _points(axes, series.drop_missing(), (measured + reference) / 2, measured - reference)
        for estimate, style in ((row.bias, "-"), (row.lower_limit, "--"), (row.upper_limit, "--")):
            if np.isfinite(estimate.value):
                axes.axhline(estimate.value, color=_OTHER, linestyle=style, linewidth=1.0)
            if np.isfinite(estimate.low):
                axes.axhspan(estimate.low, estimate.high, color=_OTHER, alpha=0.12, linewidth=0)
        reach = [row.lower_limit.value, row.upper_limit.value, float(np.min(measured - reference))]
        span = np.nanmax([*reach, float(np.max(measured - reference))]) - np.nanmin(reach)
        middle = row.bias.value
        axes.set_ylim(middle - 0.75 * span, middle + 0.75 * span) if span > 0 else None
        title = format_limits(row)
        axes.set_title(f"{row.name}\n{title}", fontsize=panels.FONT_PT - 1, color=panels.TEXT)
        axes.set_xlabel(f"mean [{row.unit}]", fontsize=panels.FONT_PT - 1, color=panels.TEXT)
        axes.set_ylabel(f"difference [{row.unit}]", fontsize=panels.FONT_PT - 1, color=panels.TEXT)
    save_png(figure, path)


def format_limits(row: Agreement) -> str:
    """Return bias and limits of agreement, all with as many decimals as show two digits of the limits' distance.

    A single difference has no limits, which is said.
    """
    bias, low, high = (each.value for each in (row.bias, row.lower_limit, row.upper_limit))
    distance = high - low
    decimals = max(0, 1 - floor(log10(distance))) if isfinite(distance) and distance > 0 else 2
    limits = f"[{low:.{decimals}f}, {high:.{decimals}f}] {row.unit}" if isfinite(distance) else f"{row.unit}, no limits"
    text = f"{bias:.{decimals}f} {limits}"
    return re.sub(r"-(0\.?0*)(?![\d.])", r"\1", text).replace("-", "−")  # no minus before zero


def write_identity(path: Path, variables: Sequence[tuple[Series, Agreement]]) -> None:
    """Draw measured over reference with the line of identity, one panel a variable."""
    figure, grid = _panels(variables)
    for axes, (series, row) in zip(grid, variables, strict=False):
        measured, reference = series.drop_missing().values.T
        ends = [float(min(measured.min(), reference.min())), float(max(measured.max(), reference.max()))]
        axes.plot(ends, ends, color=_OTHER, linewidth=0.8)
        _points(axes, series.drop_missing(), reference, measured)
        title = f"{row.name}\nICC(A,1) {or_dash(row.icc.agreement.value, '.4f')}"
        axes.set_title(title, fontsize=panels.FONT_PT - 1, color=panels.TEXT)
        axes.set_xlabel(f"reference [{row.unit}]", fontsize=panels.FONT_PT - 1, color=panels.TEXT)
        axes.set_ylabel(f"measured [{row.unit}]", fontsize=panels.FONT_PT - 1, color=panels.TEXT)
    save_png(figure, path)


def _panels(variables: Sequence[tuple[Series, Agreement]]) -> tuple[Figure, list[Axes]]:
    n_columns = min(3, len(variables))
    n_rows = ceil(len(variables) / n_columns)
    size = panels.WIDTH_IN * n_columns / 3, 2.5 * n_rows
    figure = Figure(size, dpi=panels.DPI, layout="constrained")
    grid = figure.subplots(n_rows, n_columns, squeeze=False).ravel().tolist()
    for axes in grid[: len(variables)]:
        _style_axes(axes)
    for axes in grid[len(variables) :]:
        axes.set_axis_off()
    return figure, grid


def _points(axes: Axes, series: Series, x: Array, y: Array) -> None:
    names = list(dict.fromkeys(series.individual.tolist()))
    for k, name in enumerate(names):
        own = series.individual == name
        colour = panels.LINE if len(names) == 1 else _COLOURS[k % len(_COLOURS)]
        axes.plot(x[own], y[own], "o", markersize=2.2, markeredgewidth=0, alpha=0.7, color=colour)


def _style_axes(axes: Axes) -> None:
    axes.tick_params(labelsize=panels.FONT_PT - 1, color=panels.TEXT, labelcolor=panels.TEXT)
    axes.grid(True, color=panels.FAINT, linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
