"""The figures of a run against a reference: errors.png (the truth) and digitised.png (points clicked by hand)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from airborne.evaluation import DigitisedPoses, Truth
from airborne.export import panels
from airborne.export.palette import REFERENCE_RGB, hex_colour
from airborne.geometry.rotations import angles_from_matrix, geodesic, unwrap, wrap
from airborne.motion import Motion, root_angles
from airborne.types import Array

Rows = NDArray[np.intp]

_CLICKED = {
    "linestyle": "",
    "marker": "o",
    "markersize": 4.5,
    "markerfacecolor": "none",
    "color": hex_colour(REFERENCE_RGB),
}


def write_errors(path: Path, motion: Motion, truth: Truth, symmetries: Sequence[Array]) -> None:
    """Draw estimate minus truth, position [mm] and angles [deg], with bands of two standard deviations about zero.

    A frame is matched with the true pose nearest in time, if within half a frame. `symmetries` (3, 3) as in
    `evaluation.compare`: the motion is aligned by the one that suits the whole run best.
    """
    rows, truth_rows = _nearest(motion.time_s, truth.time_s)
    reference = _align_rows(motion, rows, truth.position[truth_rows], truth.R[truth_rows])
    motion = _align_by_symmetry(motion, reference, symmetries)
    angles, singular = root_angles(motion), panels.singular_frames(motion)
    position_mm, angle_deg = _differences(motion, reference)
    zero, unobservable = np.zeros(len(motion)), panels.unobservable_frames(motion)
    figure, grid = panels.panel_figure(2, 3, row_in=2.1)
    for k, (axis, angle) in enumerate(zip("xyz", panels.ANGLES, strict=True)):
        above, below = grid[0][k], grid[1][k]
        panels.draw_band(above, motion.time_s, zero, 1e3 * motion.position_sd[:, k])
        panels.draw_band(below, motion.time_s, zero, angles.sd_deg[:, k])
        _draw_error(above, motion, position_mm[:, k])
        _draw_error(below, motion, angle_deg[:, k])
        panels.shade_spans(above, motion.time_s, unobservable[0], panels.UNOBSERVABLE_STYLE)
        panels.shade_spans(below, motion.time_s, unobservable[1], panels.UNOBSERVABLE_STYLE)
        panels.label_panel(above, f"error of {axis} [mm]")
        panels.label_panel(below, f"error of {angle} [°]")
        if angle != "tilt":
            panels.shade_spans(below, motion.time_s, singular, panels.SINGULAR_STYLE)
    handles = [*panels.unobservable_handles(unobservable[0] | unobservable[1]), *panels.singular_handles(singular)]
    panels.save_figure(figure, path, motion, [panels.band_handle("± 2 sd about zero"), *handles])


def write_digitised(path: Path, motion: Motion, poses: DigitisedPoses, symmetries: Sequence[Array]) -> None:
    """Draw the tracked pose with the poses from points clicked by hand, and their difference below.

    Source: paper B, figs 9 and 10. Frames are matched by number; `symmetries` as in `write_errors`.
    """
    _, rows, pose_rows = np.intersect1d(motion.index, poses.index, return_indices=True)
    reference = _align_rows(motion, rows, poses.position[pose_rows], poses.R[pose_rows])
    motion = _align_by_symmetry(motion, reference, symmetries)
    tracked_deg, singular = root_angles(motion).deg, panels.singular_frames(motion)
    clicked_deg = _match_revolutions(tracked_deg, np.rad2deg(unwrap(angles_from_matrix(reference.R), motion.time_s)))
    position_mm, angle_deg = _differences(motion, reference)
    figure, grid = panels.panel_figure(4, 3, row_in=1.6)
    for k, (axis, angle) in enumerate(zip("xyz", panels.ANGLES, strict=True)):
        for row, label, tracked, clicked, difference in (
            (0, f"{axis} [m]", motion.position[:, k], reference.position[:, k], position_mm[:, k]),
            (2, f"{angle} [°]", tracked_deg[:, k], clicked_deg[:, k], angle_deg[:, k]),
        ):
            panels.draw_estimate(grid[row][k], motion, tracked)
            grid[row][k].plot(motion.time_s, clicked, **_CLICKED)
            panels.label_panel(grid[row][k], label)
            _draw_error(grid[row + 1][k], motion, difference)
            panels.label_panel(grid[row + 1][k], f"difference [{'mm' if row == 0 else '°'}]")
        for row in (2, 3):
            if angle != "tilt":
                panels.shade_spans(grid[row][k], motion.time_s, singular, panels.SINGULAR_STYLE)
    clicked_handle = Line2D([], [], **_CLICKED, label="digitised by hand")
    panels.save_figure(figure, path, motion, [clicked_handle, *panels.singular_handles(singular)])


class _Reference(NamedTuple):
    """Reference poses, one for each frame of the motion; NaN where there is none."""

    position: Array  # (n, 3) [m]
    R: Array  # (n, 3, 3) world from root


def _align_rows(motion: Motion, rows: Rows, position: Array, R: Array) -> _Reference:
    reference = _Reference(np.full_like(motion.position, np.nan), np.full_like(motion.R, np.nan))
    reference.position[rows], reference.R[rows] = position, R
    return reference


def _nearest(time_s: Array, reference_s: Array) -> tuple[Rows, Rows]:
    """Match each time with the nearest reference time within half a period: rows of both."""
    half_s = np.median(np.diff(time_s)) / 2 if len(time_s) > 1 else np.inf
    nearest = np.searchsorted((reference_s[1:] + reference_s[:-1]) / 2, time_s)
    rows = np.flatnonzero(np.abs(reference_s[nearest] - time_s) < half_s)
    return rows, nearest[rows]


def _align_by_symmetry(motion: Motion, reference: _Reference, symmetries: Sequence[Array]) -> Motion:
    """Rotate the whole motion by the symmetry of the body that brings it nearest to the reference."""
    symmetric = motion.R[:, None] @ np.stack(list(symmetries))  # (n, symmetries, 3, 3)
    angle = geodesic(symmetric, reference.R[:, None])
    return replace(motion, R=symmetric[:, np.argmin(np.nansum(angle**2, axis=0))])


def _differences(motion: Motion, reference: _Reference) -> tuple[Array, Array]:
    """Motion minus reference: position (n, 3) [mm], somersault, tilt, twist (n, 3) [deg]."""
    difference = wrap(angles_from_matrix(motion.R) - angles_from_matrix(reference.R))
    return 1e3 * (motion.position - reference.position), np.rad2deg(difference)


def _match_revolutions(tracked_deg: Array, reference_deg: Array) -> Array:
    """Add whole revolutions to reference angles (n, 3) to match the tracked ones; where lost, the median number."""
    turns = np.round((tracked_deg - reference_deg) / 360)
    is_known = np.asarray(np.isfinite(turns).all(axis=1))
    median = np.median(turns[is_known], axis=0) if is_known.any() else np.zeros(3)
    return reference_deg + 360 * np.where(is_known[:, None], turns, np.round(median))


def _draw_error(axes: Axes, motion: Motion, error: Array) -> None:
    axes.axhline(0, color=panels.TEXT, linewidth=0.6)
    panels.draw_estimate(axes, motion, error)
