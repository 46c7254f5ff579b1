"""Figures of a comparison: curves with bands and their tests, numbers by condition, each athlete for himself."""

from __future__ import annotations

from math import ceil
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from airborne.export import panels
from airborne.export.page import label
from airborne.export.palette import CYCLE
from airborne.io.figures import save_png
from airborne.study.comparison import Contrast, VariableComparison
from airborne.study.spm import NOT_TESTED, format_p
from airborne.types import Array

_GREY = "#333333"
_PANEL_IN = 2.6  # height
_COLUMNS = 3  # of the athletes' panels
_DPI = 300  # of print
_TRIAL, _EACH, _ALL = "a trial", "an athlete's means", "mean ± sd of athletes"  # what the figure of a number shows


def write_comparison_figures(folder: Path, comparison: VariableComparison, stem: str) -> list[Path]:
    """Draw a comparison, and its athletes one by one; return the paths."""
    paths = [folder / f"{stem}.png", folder / f"{stem}_athletes.png"]
    if comparison.axis is None:
        save_png(_numbers(comparison), paths[0], dpi=_DPI)
        return paths[:1]
    save_png(_curves(comparison, comparison.axis), paths[0], dpi=_DPI)
    save_png(_athletes(comparison, comparison.axis), paths[1], dpi=_DPI)
    return paths


def _curves(comparison: VariableComparison, axis: Array) -> Figure:
    """Draw the conditions' means of athletes ± sd; below for each pair the difference and Student's t."""
    contrasts = comparison.contrasts
    rows = 1 + 2 * len(contrasts)
    figure = Figure((panels.WIDTH_IN, _PANEL_IN * rows), layout="constrained")
    grid = figure.subplots(rows, 1, sharex=True)
    cells = comparison.cells
    for k, condition in enumerate(comparison.conditions):
        means = np.stack([cells.mean(athlete, k) for athlete in cells.athletes_in(k)])
        _band(grid[0], axis, means, colour=_colour(k), text=f"{condition}, n = {len(means)}")
    panels.label_panel(grid[0], f"{comparison.title}\nmean ± sd of athletes")
    grid[0].legend(fontsize=panels.FONT_PT - 1, frameon=False, labelcolor=panels.TEXT)
    for contrast, upper, lower in zip(contrasts, grid[1::2], grid[2::2], strict=True):
        _draw_difference(upper, axis, contrast, comparison.title)
        _draw_test(lower, axis, contrast)
    grid[-1].set_xlabel(comparison.axis_label, fontsize=panels.FONT_PT, color=panels.TEXT)
    return figure


def _draw_difference(axes: Axes, axis: Array, contrast: Contrast, title: str) -> None:
    difference = contrast.difference
    axes.axhline(0, color=_GREY, linewidth=0.6)
    axes.fill_between(axis, difference.low, difference.high, color=_GREY, alpha=0.15, linewidth=0)
    axes.plot(axis, difference.value, color=_GREY)
    panels.label_panel(axes, f"{contrast.b} minus {contrast.a}\n{title}, 95 %")


def _draw_test(axes: Axes, axis: Array, contrast: Contrast) -> None:
    test = contrast.test
    assert test is not None, "a curve has a test"
    axes.axhline(0, color=_GREY, linewidth=0.6)
    axes.plot(axis, test.t, color=_GREY)
    for threshold in (test.threshold, -test.threshold):
        if np.isfinite(threshold):
            axes.axhline(threshold, color=CYCLE[1], linestyle="--", linewidth=0.8)
    for low, high, p in test.clusters:
        ends = np.interp([low, high], np.arange(len(axis)), axis)
        axes.axvspan(ends[0], ends[1], color=CYCLE[1], alpha=0.15, linewidth=0)
        at = float(np.mean(ends))
        axes.annotate(
            format_p(p), (at, 0.02), xycoords=("data", "axes fraction"), ha="center", fontsize=panels.FONT_PT - 1
        )
    if not np.isfinite(test.threshold):
        axes.annotate(NOT_TESTED, (0.5, 0.6), xycoords="axes fraction", ha="center", fontsize=panels.FONT_PT)
    panels.label_panel(axes, "SPM{t}")


def _athletes(comparison: VariableComparison, axis: Array) -> Figure:
    """Draw each athlete's trials, mean ± sd by condition."""
    cells, n = comparison.cells, len(comparison.athletes)
    columns = min(_COLUMNS, n)
    rows = ceil(n / columns)
    figure = Figure((panels.WIDTH_IN, _PANEL_IN * rows), layout="constrained")
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for athlete, axes in enumerate(grid):
        if athlete >= n:
            axes.set_visible(False)
            continue
        for k, condition in enumerate(comparison.conditions):
            own = cells.values[(cells.athlete == athlete) & (cells.condition == k)]
            if len(own):
                _band(axes, axis, own, colour=_colour(k), text=f"{condition}, n = {len(own)}")
        axes.set_title(comparison.athletes[athlete], fontsize=panels.FONT_PT, color=panels.TEXT)
        axes.legend(fontsize=panels.FONT_PT - 2, frameon=False, labelcolor=panels.TEXT)
    figure.supxlabel(comparison.axis_label, fontsize=panels.FONT_PT, color=panels.TEXT)
    figure.supylabel(f"{comparison.title}, mean ± sd of trials", fontsize=panels.FONT_PT, color=panels.TEXT)
    return figure


def _band(axes: Axes, axis: Array, values: Array, *, colour: str, text: str) -> None:
    """Draw the mean of curves (n, nodes) ± their sd."""
    mean = values.mean(axis=0)
    axes.plot(axis, mean, color=colour, label=text)
    if len(values) > 1:
        sd = values.std(axis=0, ddof=1)
        axes.fill_between(axis, mean - sd, mean + sd, color=colour, alpha=0.2, linewidth=0)


def _numbers(comparison: VariableComparison) -> Figure:
    """Draw every trial by condition, and each athlete's means joined."""
    figure = Figure((panels.WIDTH_IN / 2, 1.3 * _PANEL_IN), layout="constrained")
    axes, cells = figure.subplots(), comparison.cells
    for athlete in range(len(comparison.athletes)):
        own = [k for k in range(len(comparison.conditions)) if athlete in cells.athletes_in(k)]
        axes.plot(own, [cells.mean(athlete, k)[0] for k in own], color=_GREY, alpha=0.4, linewidth=0.8, label=_EACH)
    for k in range(len(comparison.conditions)):
        values = cells.values[cells.condition == k, 0]
        axes.plot(np.full(len(values), k), values, "o", color=_colour(k), alpha=0.5, markersize=3, label=_TRIAL)
        means = np.array([cells.mean(athlete, k)[0] for athlete in cells.athletes_in(k)])
        sd = means.std(ddof=1) if len(means) > 1 else 0.0
        axes.errorbar([k + 0.15], [means.mean()], [sd], fmt="s", color=_colour(k), capsize=3, markersize=5, label=_ALL)
    axes.set_xticks(range(len(comparison.conditions)), comparison.conditions)
    axes.set_xlim(-0.5, len(comparison.conditions) - 0.5)
    panels.label_panel(axes, label(comparison.variable))
    shown = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))  # one of each
    figure.legend(shown.values(), shown, loc="outside lower center", fontsize=panels.FONT_PT - 2, frameon=False)
    return figure


def _colour(k: int) -> str:
    return CYCLE[k % len(CYCLE)]
