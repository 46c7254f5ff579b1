"""Figures of the reproduced block-jump paper: success of each part, the worst sequences over time, the sweep."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from airborne.export import panels
from airborne.export.palette import BLUE, GREEN, ORANGE
from airborne.io.figures import save_png
from airborne.reproduction.block.plan import BLOCK_METHODS, PAPER_PARTS, PAPER_SUCCESS
from airborne.reproduction.block.summary import Record, Summary, by_sequence, success

_COLOURS = {"framework": "#999999", "mixture": ORANGE, "block-jump": BLUE, "blocker": GREEN}
_TITLES = ("left hip", "right hip", "left knee", "right knee", "left foot", "right foot")
_LEAST_MM = 3.0  # lower end of a logarithmic axis


def write_block_figures(folder: Path, summary: Summary, records: Sequence[Record]) -> None:
    """Write success.png, worst.png and, where there is a sweep, sweep.png."""
    _write_success(folder / "success.png", summary)
    _write_worst(folder / "worst.png", [r for r in records if r["n_particles"] in (0, summary["n_particles"])])
    if any(row["success"] for row in summary["sweep"]):
        _write_sweep(folder / "sweep.png", summary)


def _write_success(path: Path, summary: Summary) -> None:
    """Draw bars for each part and method, with the paper's numbers as black lines."""
    figure, axes = _axes(panels.WIDTH_IN, 3.0)
    width = 0.8 / len(BLOCK_METHODS)
    at = np.arange(len(PAPER_PARTS))
    for k, name in enumerate(BLOCK_METHODS):
        rate = summary["rows"][name]["success"]
        x = at + (k - (len(BLOCK_METHODS) - 1) / 2) * width
        sd = 100 * np.nan_to_num(np.asarray(rate["sd"], float))
        axes.bar(x, 100 * np.asarray(rate["mean"]), width, color=_COLOURS[name], label=name)
        axes.errorbar(x, 100 * np.asarray(rate["mean"]), sd, linestyle="", color=panels.TEXT, linewidth=0.8)
        if name in PAPER_SUCCESS:
            label = "the paper's" if k == 0 else ""
            axes.hlines(PAPER_SUCCESS[name], x - width / 2, x + width / 2, color="black", linewidth=2, label=label)
    axes.set_xticks(at, _TITLES)
    axes.set_ylabel("success [%]", fontsize=panels.FONT_PT, color=panels.TEXT)
    axes.set_ylim(0, 103)
    _finish(figure, axes, path)


def _write_worst(path: Path, records: Sequence[Record]) -> None:
    """Draw the mean error over parts, by run and player, in the sequences that block-jump and blocker track worst."""
    figure = Figure((panels.WIDTH_IN, 4.6), dpi=panels.DPI, layout="constrained")
    for axes, tracker in zip(figure.subplots(2, 1), ("block-jump", "blocker"), strict=True):
        _style(axes)
        own = by_sequence(r for r in records if r["row"] == tracker)
        worst = min(own, key=lambda number: (float(success(own[number]).min()), number))
        for name in BLOCK_METHODS:
            each = [r for r in records if r["row"] == name and r["sequence"] == worst]
            errors = np.stack([r["error_mm"].mean(axis=1) for r in each])
            for error in errors:
                axes.plot(
                    each[0]["time_s"], np.maximum(error, _LEAST_MM), color=_COLOURS[name], linewidth=0.4, alpha=0.4
                )
            axes.plot(each[0]["time_s"], np.median(errors, axis=0), color=_COLOURS[name], linewidth=1.5, label=name)
        axes.axhline(100, color="black", linewidth=0.6, linestyle=":")
        axes.set_yscale("log")
        axes.set_title(
            f"sequence {worst}, the worst of {tracker}", fontsize=panels.FONT_PT, color=panels.TEXT, loc="left"
        )
        axes.set_ylabel("mean error [mm]", fontsize=panels.FONT_PT, color=panels.TEXT)
    axes.set_xlabel("time [s]", fontsize=panels.FONT_PT, color=panels.TEXT)
    _finish(figure, axes, path)


def _write_sweep(path: Path, summary: Summary) -> None:
    figure, axes = _axes(panels.WIDTH_IN * 0.6, 2.8)
    rows = [row for row in summary["sweep"] if row["success"]]
    counts = [row["n_particles"] for row in rows]
    for part, colour, columns in (
        ("hips", BLUE, (0, 1)),
        ("knees", ORANGE, (2, 3)),
        ("feet", GREEN, (4, 5)),
    ):
        mean = [100 * np.mean([row["success"]["mean"][k] for k in columns]) for row in rows]
        axes.plot(counts, mean, "o-", color=colour, label=part)
    axes.set_xscale("log")
    axes.set_xticks(counts, [str(count) for count in counts])
    axes.minorticks_off()
    axes.set_xlabel("particles of block-jump", fontsize=panels.FONT_PT, color=panels.TEXT)
    axes.set_ylabel("success [%]", fontsize=panels.FONT_PT, color=panels.TEXT)
    _finish(figure, axes, path)


def _axes(width_in: float, height_in: float) -> tuple[Figure, Axes]:
    figure = Figure((width_in, height_in), dpi=panels.DPI, layout="constrained")
    axes = figure.subplots()
    _style(axes)
    return figure, axes


def _style(axes: Axes) -> None:
    axes.tick_params(labelsize=panels.FONT_PT - 1, color=panels.TEXT, labelcolor=panels.TEXT)
    axes.grid(True, color=panels.FAINT, linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _finish(figure: Figure, axes: Axes, path: Path) -> None:
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside upper center", ncols=len(labels), fontsize=panels.FONT_PT, frameon=False,
        labelcolor=panels.TEXT,
    )  # fmt: skip
    save_png(figure, path)
