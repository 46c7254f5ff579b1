"""Figures of a repeated experiment: how a score rises about the truth, and sequences of images side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from matplotlib.figure import Figure

from airborne.export import panels
from airborne.export.palette import ESTIMATE_RGB, VERMILION, hex_colour
from airborne.export.pictures import encode_png
from airborne.io.figures import save_png
from airborne.types import Array, Image

_LINE_STYLES = (("-", hex_colour(ESTIMATE_RGB)), ("--", VERMILION))
_TITLE_PX, _GAP_PX, _FONT_SCALE = 18, 2, 0.42  # of a title line, between pictures; of OpenCV's font
_GREY = (210, 210, 210)  # sRGB of the text


class ScoreCurve(NamedTuple):
    """A score over a variable's offset from its true value."""

    offset: Array  # (k,)
    scores: Array  # (poses, k) [grey levels]
    half_width: float  # how far the curve rises on both sides


def write_convergence(
    path: Path, variables: Sequence[tuple[str, str]], curves: Mapping[str, Sequence[ScoreCurve]]
) -> None:
    """Draw the mean score over the poses, and its range, for each variable (name, unit); one line for each name.

    The bars at the bottom reach as far as the curves rise on both sides.
    Source: paper B, figs 5 and 6.
    """
    figure = Figure((panels.WIDTH_IN, 4.6), dpi=panels.DPI, layout="constrained")
    grid = figure.subplots(2, (len(variables) + 1) // 2, squeeze=False, sharey=True)
    top = max(float(curve.scores.max()) for of_label in curves.values() for curve in of_label)
    for k, (axes, (name, unit)) in enumerate(zip(grid.ravel(), variables, strict=False)):
        for row, ((style, colour), (label, of_label)) in enumerate(zip(_LINE_STYLES, curves.items(), strict=False)):
            offset, scores, half = of_label[k]
            axes.fill_between(offset, scores.min(axis=0), scores.max(axis=0), color=colour, alpha=0.15, linewidth=0)
            axes.plot(offset, scores.mean(axis=0), style, color=colour, linewidth=1.2, label=label)
            axes.axvspan(-half, half, 0.02 * row, 0.02 * row + 0.015, color=colour, alpha=0.6, linewidth=0)
        axes.set_xlabel(f"{name} [{unit}]", fontsize=panels.FONT_PT, color=panels.TEXT)
        axes.tick_params(labelsize=panels.FONT_PT - 1, color=panels.TEXT, labelcolor=panels.TEXT)
        axes.grid(True, color=panels.FAINT, linewidth=0.6)
        axes.set_ylim(0, 1.05 * top)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    for row in grid:
        row[0].set_ylabel("score [grey levels]", fontsize=panels.FONT_PT, color=panels.TEXT)
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside upper center", ncols=2, fontsize=panels.FONT_PT, frameon=False,
        labelcolor=panels.TEXT,
    )  # fmt: skip
    save_png(figure, path)


def write_sequences(path: Path, rows: Sequence[tuple[str, Sequence[Image]]]) -> None:
    """Stack rows of images (h, w, 3) RGB, all of one size, each row under its title; write a PNG.

    Source: paper B, fig. 4.
    """
    height, width, _ = rows[0][1][0].shape
    n = max(len(images) for _, images in rows)
    sheet = np.zeros((len(rows) * (height + _TITLE_PX), n * (width + _GAP_PX) - _GAP_PX, 3), np.uint8)
    for k, (title, images) in enumerate(rows):
        top = k * (height + _TITLE_PX)
        cv2.putText(
            sheet, title, (4, top + _TITLE_PX - 5), cv2.FONT_HERSHEY_SIMPLEX, _FONT_SCALE, _GREY, 1, cv2.LINE_AA
        )
        for j, image in enumerate(images):
            left = j * (width + _GAP_PX)
            sheet[top + _TITLE_PX : top + _TITLE_PX + height, left : left + width] = image
    path.write_bytes(encode_png(sheet, is_small=True))
