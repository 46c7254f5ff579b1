"""The figures of a run over time: pose.png, score.png, and against a reference digitised.png and errors.png.

For a body with joints also joints.png, and flight.png where every segment has a mass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from airborne.body import BodyModel
from airborne.evaluation import DigitisedPoses, Truth
from airborne.export import panels
from airborne.export.palette import REFERENCE_RGB, hex_colour
from airborne.geometry.rotations import angles_from_matrix, geodesic, unwrap, wrap
from airborne.motion import Motion, has_inertias, joint_angles, measure_flight, root_angles
from airborne.types import Array, Mask

Rows = NDArray[np.intp]

_AXIS_STYLES = (("x", "-", "#0072b2"), ("y", "--", "#cc79a7"), ("z", ":", "#333333"))
_CLICKED = {
    "linestyle": "",
    "marker": "o",
    "markersize": 4.5,
    "markerfacecolor": "none",
    "color": hex_colour(REFERENCE_RGB),
}
_FLEXION = {  # of a person: the segment that a joint turns, the joint, and the sign of its x angle in flexion
    "upper_arm": ("shoulder", -1.0),
    "forearm": ("elbow", -1.0),
    "thigh": ("hip", -1.0),
    "shank": ("knee", 1.0),
}
_MOST_JOINTS = 8  # of a body that is not a person


def write_figures(
    folder: Path,
    motion: Motion,
    model: BodyModel,
    *,
    truth: Truth | None = None,
    digitised: DigitisedPoses | None = None,
    symmetries: Sequence[Array] = (np.eye(3),),
) -> None:
    """Write every figure that the data allow into a run's folder.

    Always pose.png and score.png; joints.png and flight.png where the body has joints and masses; errors.png and
    digitised.png where there is a reference. `symmetries` (3, 3) are the body's, the identity among them,
    as in `evaluation.compare`. Raises ResultError where the motion is another body's.
    """
    write_pose(folder / "pose.png", motion)
    write_score(folder / "score.png", motion)
    if motion.joints:
        write_joints_figure(folder / "joints.png", motion, model)
    if motion.joints and has_inertias(model):
        write_flight_figure(folder / "flight.png", motion, model)
    if truth is not None:
        write_errors(folder / "errors.png", motion, truth, symmetries)
    if digitised is not None:
        write_digitised(folder / "digitised.png", motion, digitised, symmetries)


def write_pose(path: Path, motion: Motion) -> None:
    """Write `pose_figure` as a PNG."""
    pose_figure(motion).savefig(path)


def pose_figure(motion: Motion) -> Figure:
    """Draw x, y, z [m] and somersault, tilt, twist [deg] over time with bands of two standard deviations.

    Lost frames are gaps, shaded; frames in which some direction is unobservable are hatched.
    """
    table, singular, unobservable = root_angles(motion), _singular(motion), _unobservable_frames(motion)
    figure, grid = panels.panel_figure(3, 2, row_in=1.75)
    for k, (axis, angle) in enumerate(zip("xyz", panels.ANGLES, strict=True)):
        left, right = grid[k]
        for axes, label, values, sd, mask in (
            (left, f"{axis} [m]", motion.position[:, k], motion.position_sd[:, k], unobservable[0]),
            (right, f"{angle} [°]", table[angle].to_numpy(), table[f"{angle}_sd"].to_numpy(), unobservable[1]),
        ):
            panels.draw_band(axes, motion.time_s, values, sd)
            panels.draw_estimate(axes, motion, values)
            panels.shade_spans(axes, motion.time_s, mask, panels.UNOBSERVABLE_STYLE)
            panels.label_panel(axes, label)
        if angle != "tilt":
            panels.shade_spans(right, motion.time_s, singular, panels.SINGULAR_STYLE)
    handles = [*panels.unobservable_handles(unobservable[0] | unobservable[1]), *panels.singular_handles(singular)]
    return panels.add_legend(figure, motion, [panels.band_handle("± 2 standard deviations"), *handles])


def write_score(path: Path, motion: Motion) -> None:
    """Draw the score [grey levels] and the standard deviations of position [mm] and rotation [deg] over time."""
    figure, grid = panels.panel_figure(3, 1, row_in=1.6)
    (score,), (position,), (rotation,) = grid
    panels.draw_estimate(score, motion, motion.score)
    panels.label_panel(score, "score [grey levels]")
    panels.begin_at_zero(score)
    for axes, sd, label in (
        (position, 1e3 * motion.position_sd, "position sd [mm]"),
        (rotation, np.rad2deg(motion.rotation_sd), "rotation sd [°]"),
    ):
        for k, (name, style, colour) in enumerate(_AXIS_STYLES):
            finite = np.where(np.isfinite(sd[:, k]), sd[:, k], np.nan)
            axes.plot(motion.time_s, finite, style, marker=".", markersize=3, color=colour, label=f"world {name}")
        panels.label_panel(axes, label)
        panels.shade_lost(axes, motion)
        panels.shade_spans(axes, motion.time_s, _is_unobservable(sd), panels.UNOBSERVABLE_STYLE)
        panels.begin_at_zero(axes)
    position.legend(fontsize=panels.FONT_PT - 1, frameon=False, ncols=3, labelcolor=panels.TEXT)
    panels.save_figure(figure, path, motion, panels.unobservable_handles(np.logical_or(*_unobservable_frames(motion))))


def write_joints_figure(path: Path, motion: Motion, model: BodyModel) -> None:
    """Write `joints_figure` as a PNG."""
    joints_figure(motion, model).savefig(path)


def joints_figure(motion: Motion, model: BodyModel) -> Figure:
    """Draw the angles of the main joints over time [deg], left beside right, with bands of two standard deviations.

    Where the images do not show an angle, it is left out. Of a person shoulders, elbows, hips and knees: the x angle,
    flexion positive. Of another body the x angles of its first joints.

    Raises ResultError where the motion is another body's.
    """
    table, joint_panels = joint_angles(motion, model), _joint_panels(motion.joints)
    unobservable, singular = np.zeros((2, len(motion)), bool)
    figure, grid = panels.panel_figure(-(-len(joint_panels) // 2), 2, row_in=1.6)
    cells = [axes for row in grid for axes in row]
    for axes, (segment, label, sign) in zip(cells, joint_panels, strict=False):
        of_joint = table.sel(joint=segment)
        values, sd = (of_joint[name].sel(axis="x").to_numpy() for name in ("angle", "angle_sd"))
        is_unobservable, is_singular = np.isinf(sd), of_joint["is_singular"].to_numpy() & motion.has_pose
        values = np.where(is_unobservable, np.nan, values)
        panels.draw_band(axes, motion.time_s, sign * values, sd)
        panels.draw_estimate(axes, motion, sign * values)
        panels.shade_spans(axes, motion.time_s, is_unobservable, panels.UNOBSERVABLE_STYLE)
        panels.shade_spans(axes, motion.time_s, is_singular, panels.SINGULAR_STYLE)
        panels.label_panel(axes, f"{label} [°]")
        unobservable, singular = unobservable | is_unobservable, singular | is_singular
    for axes in cells[len(joint_panels) :]:
        axes.set_axis_off()
    handles = [
        *panels.unobservable_handles(unobservable),
        *panels.singular_handles(singular, "y near ±90°: x and z mix"),
    ]
    return panels.add_legend(figure, motion, [panels.band_handle("± 2 standard deviations"), *handles])


def _joint_panels(joints: Sequence[str]) -> list[tuple[str, str, float]]:
    """Choose the joints to draw: segment, label and sign of the x angle."""
    person = [
        (f"{segment}_{side}", f"{joint} {side}", sign)
        for segment, (joint, sign) in _FLEXION.items()
        for side in ("left", "right")
    ]
    present = [panel for panel in person if panel[0] in joints]
    return present or [(segment, f"{segment}, x", 1.0) for segment in joints[:_MOST_JOINTS]]


def write_flight_figure(path: Path, motion: Motion, model: BodyModel) -> None:
    """Write `flight_figure` as a PNG."""
    flight_figure(motion, model).savefig(path)


def flight_figure(motion: Motion, model: BodyModel) -> Figure:
    """Draw the height of the centre of mass [m] and the angular momentum [kg m^2/s] over time, with bands of two sd.

    Raises BodyError where a segment has no inertia, ResultError where the motion is another body's.
    """
    table = measure_flight(motion, model)
    com, momentum = (
        [table[name].sel(space=axis).to_numpy() for name in (quantity, f"{quantity}_sd")]
        for quantity, axis in (("com", "z"), ("angular_momentum", list("xyz")))
    )
    curves = [("height of centre of mass [m]", *com)]
    curves += [(f"L about {axis} [kg m²/s]", momentum[0][:, k], momentum[1][:, k]) for k, axis in enumerate("xyz")]
    figure, grid = panels.panel_figure(2, 2, row_in=2.1)
    cells = [axes for row in grid for axes in row]
    for axes, (label, values, sd) in zip(cells, curves, strict=True):
        panels.draw_band(axes, motion.time_s, values, sd)
        panels.draw_estimate(axes, motion, values)
        panels.shade_spans(axes, motion.time_s, np.isinf(sd), panels.UNOBSERVABLE_STYLE)
        panels.label_panel(axes, label)
    momenta = cells[1:]
    low, high = zip(*(axes.get_ylim() for axes in momenta), strict=True)
    for axes in momenta:  # one scale, so that the components can be compared
        axes.set_ylim(min(low), max(high))
    return panels.add_legend(figure, motion, [panels.band_handle("± 2 standard deviations")])


def write_errors(path: Path, motion: Motion, truth: Truth, symmetries: Sequence[Array]) -> None:
    """Draw estimate minus truth, position [mm] and angles [deg], with bands of two standard deviations about zero.

    A frame is matched with the true pose nearest in time, if within half a frame. `symmetries` (3, 3) as in
    `evaluation.compare`: the motion is aligned by the one that suits the whole run best.
    """
    rows, truth_rows = _nearest(motion.time_s, truth.time_s)
    reference = _align_rows(motion, rows, truth.position[truth_rows], truth.R[truth_rows])
    motion = _align_by_symmetry(motion, reference, symmetries)
    table, singular = root_angles(motion), _singular(motion)
    position_mm, angle_deg = _differences(motion, reference)
    zero, unobservable = np.zeros(len(motion)), _unobservable_frames(motion)
    figure, grid = panels.panel_figure(2, 3, row_in=2.1)
    for k, (axis, angle) in enumerate(zip("xyz", panels.ANGLES, strict=True)):
        above, below = grid[0][k], grid[1][k]
        panels.draw_band(above, motion.time_s, zero, 1e3 * motion.position_sd[:, k])
        panels.draw_band(below, motion.time_s, zero, table[f"{angle}_sd"].to_numpy())
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
    table, singular = root_angles(motion), _singular(motion)
    tracked_deg = np.stack([table[name].to_numpy() for name in panels.ANGLES], axis=1)
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


def _singular(motion: Motion) -> Mask:
    return root_angles(motion)["is_singular"].to_numpy() & motion.has_pose


def _unobservable_frames(motion: Motion) -> tuple[Mask, Mask]:
    """Say in which frames some direction of the position, and of the rotation, is unobservable: (n,) each."""
    return _is_unobservable(motion.position_sd), _is_unobservable(motion.rotation_sd)


def _is_unobservable(sd: Array) -> Mask:
    return np.asarray(np.isinf(sd).any(axis=1))


def _draw_error(axes: Axes, motion: Motion, error: Array) -> None:
    axes.axhline(0, color=panels.TEXT, linewidth=0.6)
    panels.draw_estimate(axes, motion, error)
