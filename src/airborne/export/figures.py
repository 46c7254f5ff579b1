"""The figures of a run over time: pose.png and score.png.

For a body with joints also joints.png and joint_status.png, and flight.png where every segment has a mass.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from airborne.body import BodyModel
from airborne.errors import ResultError
from airborne.export import panels
from airborne.export.palette import BLUE, PURPLE, STATUS_RGB, UNKNOWN_RGB, hex_colour
from airborne.io.figures import save_png
from airborne.motion import (
    JointStatus,
    Motion,
    has_inertias,
    joint_angles,
    known_landmarks,
    root_angles,
    state_flight,
)
from airborne.motion.joints import doubtful_segments, main_joints
from airborne.tracking import Status

_AXIS_STYLES = (("x", "-", BLUE), ("y", "--", PURPLE), ("z", ":", "#333333"))
JOINT_COLOURS = {
    JointStatus.TRACKED: hex_colour(STATUS_RGB[Status.TRACKED]),
    JointStatus.UNCERTAIN: hex_colour(STATUS_RGB[Status.UNCERTAIN]),
    JointStatus.UNKNOWN: hex_colour(UNKNOWN_RGB),
    JointStatus.LOST: hex_colour(STATUS_RGB[Status.LOST]),
}
_TWO_SD = "± 2 standard deviations; unseen where thinner than the line"


def write_figures(folder: Path, motion: Motion, model: BodyModel) -> None:
    """Write every figure that the data allow into a run's folder; those against a reference are in `error_figures`.

    Always pose.png and score.png; joints.png and joint_status.png where the body has joints, flight.png where it has
    masses too. Raises ResultError where the motion is another body's.
    """
    write_pose(folder / "pose.png", motion)
    write_score(folder / "score.png", motion)
    if motion.joints:
        write_joints_figure(folder / "joints.png", motion, model)
        save_png(joint_status_figure(motion, model), folder / "joint_status.png")
    if motion.joints and has_inertias(model):
        write_flight_figure(folder / "flight.png", motion, model)


def write_pose(path: Path, motion: Motion) -> None:
    """Write `pose_figure` as a PNG."""
    save_png(pose_figure(motion), path)


def pose_figure(motion: Motion) -> Figure:
    """Draw x, y, z [m] and somersault, tilt, twist [deg] over time with bands of two standard deviations.

    Lost frames are gaps, shaded; frames in which some direction is unobservable are hatched.
    """
    angles, singular, unobservable = (
        root_angles(motion),
        panels.singular_frames(motion),
        panels.unobservable_frames(motion),
    )
    figure, grid = panels.panel_figure(3, 2, row_in=1.75)
    for k, (axis, angle) in enumerate(zip("xyz", panels.ANGLES, strict=True)):
        left, right = grid[k]
        for axes, label, values, sd, mask in (
            (left, f"{axis} [m]", motion.position[:, k], motion.position_sd[:, k], unobservable[0]),
            (right, f"{angle} [°]", angles.deg[:, k], angles.sd_deg[:, k], unobservable[1]),
        ):
            panels.draw_band(axes, motion.time_s, values, sd)
            panels.draw_estimate(axes, motion, values)
            panels.shade_spans(axes, motion.time_s, mask, panels.UNOBSERVABLE_STYLE)
            panels.label_panel(axes, label)
        if angle != "tilt":
            panels.shade_spans(right, motion.time_s, singular, panels.SINGULAR_STYLE)
    handles = [*panels.unobservable_handles(unobservable[0] | unobservable[1]), *panels.singular_handles(singular)]
    return panels.add_legend(figure, motion, [panels.band_handle(_TWO_SD), *handles])


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
        panels.shade_spans(axes, motion.time_s, panels.is_unobservable(sd), panels.UNOBSERVABLE_STYLE)
        panels.begin_at_zero(axes)
    position.legend(fontsize=panels.FONT_PT - 1, frameon=False, ncols=3, labelcolor=panels.TEXT)
    panels.save_figure(
        figure, path, motion, panels.unobservable_handles(np.logical_or(*panels.unobservable_frames(motion)))
    )


def write_joints_figure(path: Path, motion: Motion, model: BodyModel) -> None:
    """Write `joints_figure` as a PNG."""
    save_png(joints_figure(motion, model), path)


def joints_figure(motion: Motion, model: BodyModel) -> Figure:
    """Draw the angles of the main joints over time [deg], left beside right, with bands of two standard deviations.

    Where the images do not show an angle, it is unknown: left out, and counted for itself. Where either of its
    segments is not tracked, it is uncertain. Of a person shoulders, elbows, hips and knees: the x angle, flexion
    positive. Of another body the x angles of its first joints.

    Raises ResultError where the motion is another body's.
    """
    table, joint_panels = joint_angles(motion, model), main_joints(motion.joints)
    if not joint_panels:
        raise ResultError("this body has no joints, so there are no angles of joints to draw")
    doubtful, singular = doubtful_segments(motion, model), np.zeros(len(motion), bool)
    statuses, unknown = [], []
    figure, grid = panels.panel_figure(-(-len(joint_panels) // 2), 2, row_in=1.6)
    cells = [axes for row in grid for axes in row]
    for axes, (segment, label, sign) in zip(cells, joint_panels, strict=False):
        of_joint = table.sel(joint=segment)
        values, sd = (of_joint[name].sel(axis="x").to_numpy() for name in ("angle", "angle_sd"))
        is_unobservable, is_singular = np.isinf(sd), of_joint["is_singular"].to_numpy() & motion.has_pose
        values = np.where(is_unobservable, np.nan, values)
        panels.draw_band(axes, motion.time_s, sign * values, sd)
        at = model.index_of(segment)
        is_doubtful = doubtful[:, [at, model.parents[at]]].any(axis=1) & motion.has_pose
        status = np.where(is_doubtful, Status.UNCERTAIN.value, motion.status)
        statuses.append(status[~is_unobservable])
        unknown.append(is_unobservable)
        panels.draw_estimate(axes, motion, sign * values, status)
        panels.shade_spans(axes, motion.time_s, is_unobservable, panels.UNOBSERVABLE_STYLE)
        panels.shade_spans(axes, motion.time_s, is_singular, panels.SINGULAR_STYLE)
        panels.label_panel(axes, f"{label} [°]")
        singular |= is_singular
    for axes in cells[len(joint_panels) :]:
        axes.set_axis_off()
    handles = [
        *panels.unobservable_handles(np.array(unknown), f"unknown, in no image ({np.sum(unknown)})"),
        *panels.singular_handles(singular, "y near ±90°: x and z mix"),
    ]
    return panels.draw_legend(
        figure, [*panels.status_handles(np.concatenate(statuses)), panels.band_handle(_TWO_SD), *handles]
    )


def joint_status_figure(motion: Motion, model: BodyModel) -> Figure:
    """Draw the status of each landmark over time, see `joint_statuses`, a row for each.

    Raises ResultError where the motion is another body's.
    """
    *_, status = known_landmarks(motion, model)
    figure, ((axes,),) = panels.panel_figure(1, 1, row_in=0.16 * len(model.landmarks) + 0.5)
    for row, column in enumerate(status.T):
        for each, colour in JOINT_COLOURS.items():
            spans = [(a, b - a) for a, b in panels.intervals(motion.time_s, column == each.value)]
            axes.broken_barh(spans, (row - 0.4, 0.8), facecolors=colour)
    axes.set_yticks(range(len(model.landmarks)), [landmark.name for landmark in model.landmarks])
    axes.invert_yaxis()
    axes.grid(False)
    handles = [
        Patch(color=colour, label=f"{each} ({n})")
        for each, colour in JOINT_COLOURS.items()
        if (n := int(np.sum(status == each.value)))
    ]
    return panels.draw_legend(figure, handles)


def write_flight_figure(path: Path, motion: Motion, model: BodyModel) -> None:
    """Write `flight_figure` as a PNG."""
    save_png(flight_figure(motion, model), path)


def flight_figure(motion: Motion, model: BodyModel) -> Figure:
    """Draw the height of the centre of mass [m] and the angular momentum [kg m^2/s] over time, with bands of two sd.

    Raises BodyError where a segment has no inertia, ResultError where the motion is another body's.
    """
    table, _ = state_flight(motion, model)
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
    return panels.add_legend(figure, motion, [panels.band_handle(_TWO_SD)])
