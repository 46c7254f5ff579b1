"""What the figures of a run share: panels over time, error bands, shading of what is lost or unobservable."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from airborne.export.palette import ESTIMATE_RGB, PURPLE, STATUS_RGB, TEXT_RGB, hex_colour
from airborne.io.figures import save_png
from airborne.motion import Motion, root_angles
from airborne.tracking import Status
from airborne.types import Array, Mask

WIDTH_IN = 7.6  # of a figure
DPI = 150  # of a figure
FONT_PT = 9  # of labels
_LEGEND_CHARACTERS = 85  # that fit into one row
ANGLES = ("somersault", "tilt", "twist")
TEXT, LINE, FAINT = hex_colour(TEXT_RGB), hex_colour(ESTIMATE_RGB), "#dddddd"
_MARKERS = {Status.TRACKED: "o", Status.UNCERTAIN: "D"}
_BAND_STYLE = {"facecolor": LINE, "alpha": 0.25, "linewidth": 0}
LOST_STYLE = {"facecolor": "#cccccc", "edgecolor": "none", "alpha": 0.8}
UNOBSERVABLE_STYLE = {"facecolor": "none", "edgecolor": PURPLE, "hatch": "////", "linewidth": 0.0}
SINGULAR_STYLE = {"facecolor": PURPLE, "edgecolor": "none", "alpha": 0.18}


def panel_figure(n_rows: int, n_columns: int, *, row_in: float) -> tuple[Figure, list[list[Axes]]]:
    """Create a figure of report width with a grid of panels that share their time axis."""
    figure = Figure((WIDTH_IN, n_rows * row_in + 0.7), dpi=DPI, layout="constrained")
    grid = figure.subplots(n_rows, n_columns, sharex=True, squeeze=False)
    for axes in grid.ravel():
        axes.tick_params(labelsize=FONT_PT - 1, color=TEXT, labelcolor=TEXT)
        axes.grid(True, color=FAINT, linewidth=0.6)
        axes.set_axisbelow(True)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    for axes in grid[-1]:
        axes.set_xlabel("time [s]", fontsize=FONT_PT, color=TEXT)
    return figure, grid.tolist()


def label_panel(axes: Axes, label: str) -> None:
    """Label a panel's vertical axis, without an offset to be added to its numbers."""
    axes.set_ylabel(label, fontsize=FONT_PT, color=TEXT)
    axes.ticklabel_format(axis="y", useOffset=False, style="plain")


def draw_estimate(axes: Axes, motion: Motion, values: Array, of_frames: NDArray[np.str_] | None = None) -> None:
    """Draw values (n,) with a marker for each status, the motion's if not given; lost frames are shaded gaps."""
    of_frames = motion.status if of_frames is None else of_frames
    axes.plot(motion.time_s, values, color=LINE, linewidth=1.0)
    for status, marker in _MARKERS.items():
        has_status = of_frames == status.value
        axes.plot(
            motion.time_s[has_status], values[has_status], marker, color=hex_colour(STATUS_RGB[status]), markersize=2.8
        )
    shade_lost(axes, motion)


def shade_lost(axes: Axes, motion: Motion) -> None:
    """Shade the frames that were lost."""
    shade_spans(axes, motion.time_s, motion.status == Status.LOST.value, LOST_STYLE)


def shade_spans(axes: Axes, time_s: Array, mask: Mask, style: dict) -> None:
    """Shade the intervals of time (n,) where `mask` (n,) is true."""
    for start_s, stop_s in intervals(time_s, mask):
        axes.axvspan(start_s, stop_s, zorder=0, **style)


def begin_at_zero(axes: Axes) -> None:
    """Let the vertical axis of a plotted panel run from zero to a little above its largest value."""
    axes.update_datalim([(axes.dataLim.x0, 0.0)] if np.isfinite(axes.dataLim.x0) else [])
    axes.autoscale_view()
    axes.set_ylim(bottom=0)


def save_figure(figure: Figure, path: Path, motion: Motion, extra: Sequence[Artist] = ()) -> None:
    """Add the legend on top and write the PNG."""
    save_png(add_legend(figure, motion, extra), path)


def add_legend(figure: Figure, motion: Motion, extra: Sequence[Artist] = ()) -> Figure:
    """Add the legend on top: the statuses with their numbers of frames, and what else is given."""
    return draw_legend(figure, [*status_handles(motion.status), *extra])


def status_handles(statuses: NDArray[np.str_]) -> list[Artist]:
    """Return the legend's entries for statuses, of any shape, with how many there are."""
    counts = {status: int(np.count_nonzero(statuses == status.value)) for status in Status}
    handles: list[Artist] = [
        Line2D([], [], color=LINE, marker=marker, markerfacecolor=hex_colour(STATUS_RGB[status]), markeredgewidth=0,
               markersize=4, label=f"{status} ({counts[status]})")
        for status, marker in _MARKERS.items()
        if counts[status]
    ]  # fmt: skip
    if counts[Status.LOST]:
        handles.append(Patch(**LOST_STYLE, label=f"lost ({counts[Status.LOST]})"))
    return handles


def draw_legend(figure: Figure, handles: Sequence[Artist]) -> Figure:
    """Add a legend on top."""
    fits = sum(len(str(handle.get_label())) for handle in handles) <= _LEGEND_CHARACTERS
    figure.legend(
        handles=handles, loc="outside upper center", ncols=4 if fits else 2, fontsize=FONT_PT - 1, frameon=False,
        labelcolor=TEXT,
    )  # fmt: skip
    figure.align_ylabels()
    return figure


def draw_band(axes: Axes, time_s: Array, middle: Array, sd: Array) -> None:
    """Draw a band of two standard deviations (n,) about `middle` (n,); none where they are infinite or unknown.

    That of a frame alone among others without one is half a frame wide, so that it does not read as exact.
    """
    spread = 2 * np.where(np.isfinite(sd), sd, np.nan)
    axes.fill_between(time_s, middle - spread, middle + spread, **_BAND_STYLE)
    is_known = np.pad(np.isfinite(middle + spread), 1)
    for k in np.flatnonzero(is_known[1:-1] & ~is_known[:-2] & ~is_known[2:]):
        ((begin_s, end_s),) = intervals(time_s, np.arange(len(time_s)) == k)
        axes.fill_between(
            [begin_s + (end_s - begin_s) / 4, end_s - (end_s - begin_s) / 4],
            middle[k] - spread[k],
            middle[k] + spread[k],
            **_BAND_STYLE,
        )


def band_handle(label: str) -> Patch:
    """Return the legend entry of `draw_band`."""
    return Patch(**_BAND_STYLE, label=label)


def unobservable_handles(
    unobservable: Mask, label: str = "a direction cannot be seen (infinite deviation)"
) -> list[Patch]:
    """Return the legend entry of the intervals shaded as unobservable, if any."""
    return [Patch(**UNOBSERVABLE_STYLE, label=label)] if unobservable.any() else []


def singular_handles(singular: Mask, label: str = "tilt near ±90°: somersault and twist mix") -> list[Patch]:
    """Return the legend entry of the intervals shaded as singular, if any."""
    return [Patch(**SINGULAR_STYLE, label=label)] if singular.any() else []


def intervals(time_s: Array, mask: Mask) -> Iterator[tuple[float, float]]:
    """Yield begin and end of the intervals of time (n,) [s] where `mask` (n,) is true, half a frame around each."""
    half_s = float(np.median(np.diff(time_s))) / 2 if len(time_s) > 1 else 0.5
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]])))
    for first, stop in edges.reshape(-1, 2):
        yield float(time_s[first]) - half_s, float(time_s[stop - 1]) + half_s


def singular_frames(motion: Motion) -> Mask:
    """Say in which frames the root's angles are singular: (n,)."""
    return root_angles(motion).is_singular & motion.has_pose


def unobservable_frames(motion: Motion) -> tuple[Mask, Mask]:
    """Say in which frames some direction of the position, and of the rotation, is unobservable: (n,) each."""
    return is_unobservable(motion.position_sd), is_unobservable(motion.rotation_sd)


def is_unobservable(sd: Array) -> Mask:
    """Say of which rows of standard deviations (n, k) one is infinite: (n,)."""
    return np.asarray(np.isinf(sd).any(axis=1))
