"""report.html: a run's numbers, warnings, pictures and method on one self-contained page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from airborne.errors import ResultError, format_digits
from airborne.export.methods_text import SURFACES
from airborne.export.page import UNKNOWN_TEXT, HtmlTable, format_with_sd, render_report
from airborne.export.report_comparisons import list_comparisons
from airborne.export.summary import body_warnings, headline, json_ready
from airborne.export.viewer import Viewer
from airborne.io.writing import write_text
from airborne.motion import FlightSummary, Motion
from airborne.motion.flight.momentum_table import GRAVITY_M_S2
from airborne.motion.run_folder import REPORT, figures_of

_FIGURES = {  # titles and captions, in the order of the page
    "empty_scene.png": (
        "How the start was found",
        "For each camera the empty scene, the median of images spread over the recording; what stands out from it at "
        "the moment in which the body is seen well; and the outline of the body found there.",
    ),
    "pose.png": (
        "The motion",
        "Position of the body's root in the world, and its somersault, tilt and twist, over time.",
    ),
    "joints.png": (
        "Joints",
        "How the main joints are bent over time, amber where one of a joint's segments is not tracked. Of a person: "
        "flexion is positive, and zero is standing upright with hanging arms. Of another body: the x angles. Turns "
        "about the other axes are in joint_angles.csv.",
    ),
    "joint_status.png": (
        "How far each joint can be trusted",
        "The status of each joint over time. Tracked: its interval can be trusted. Uncertain: it may be elsewhere. "
        "Unknown: the images do not show it, and its position is a guess.",
    ),
    "flight.png": (
        "Centre of mass and angular momentum",
        "Height of the centre of mass, and the angular momentum about it in world axes. In free flight the height is a "
        "parabola and the momentum constant: how far they are from that checks the measurement where no whole run was "
        "fitted, which takes both as known.",
    ),
    "through_mask.png": (
        "Through the mask",
        "What the cameras saw where the tracked body is drawn, all at one scale. Where the scene shows through, or the "
        "body is cut off, the pose is off. Times in amber are uncertain.",
    ),
    "matching.png": (
        "How image and body are compared",
        "The first tracked frame: what a camera saw, the body as drawn in flat colours, its mask, the image through "
        "the mask, and their agreement, the brighter the better.",
    ),
    "score.png": ("Score and spread", "Score, and standard deviations of position and rotation, over time."),
    "digitised.png": (
        "Beside points digitised by hand",
        "Tracked poses and those from points clicked by hand, each with their difference below.",
    ),
    "errors.png": (
        "Errors",
        "Tracked minus true pose. If the uncertainty is honest, two thirds of the points lie within half of the band.",
    ),
}

DEFINITIONS = {
    "World": (
        "Metres, z up; its origin and axes are those of the calibration. Times are in seconds on the first camera's "
        "clock."
    ),
    "Body axes": (
        "A person's: x to the left, y to the back, z to the head; a thing's: those of its file. They begin at the "
        "origin of the body's first segment (the root), whose position is the body's."
    ),
    "Somersault, tilt, twist": (
        "Successive turns about the body's x, then y, then z axis: R = Rx(somersault) Ry(tilt) Rz(twist) maps body "
        "axes to world axes; forward somersault is positive. Somersault and twist are unwrapped over time. Near ±90° "
        "of tilt they cannot be told apart, and small errors of the orientation make large ones in both."
    ),
    "Score": (
        "Root mean square colour difference between the images and the drawn body inside its outline, in grey levels "
        "(0 to 255), as tracked frame by frame."
    ),
    "Status": (
        "Tracked: the images support the pose. Uncertain: the pose is a candidate that needs to be looked at. "
        "Lost: nothing is claimed, and the frame holds no numbers."
    ),
}

_JOINT_ANGLES = (
    "Successive turns about the moving x, y and z axes, parent from segment; a joint bears the name of the segment it "
    "turns. All are zero in a person standing upright, arms hanging, feet forward. What no image shows, such as a "
    "round limb's turn about its own axis, stays as it was and has an infinite standard deviation."
)

_UNCERTAINTY = (
    "Given as one standard deviation for each axis; bands in the figures are two. If errors are normal, 68% of them "
    "lie within one and 95% within two. Infinite means that the images do not show that direction."
)


def write_report(folder: Path, summary: Mapping[str, Any], viewer: Viewer | None = None) -> Path:
    """Write report.html into the folder of a run, and return its path.

    `viewer` is what `body_viewer` returns. `summary` is what `write_json` writes into summary.json: `name`, the numbers
    of `headline`, and where known

    - `uncertainty`: in one or two sentences, which errors the standard deviations contain and which they do not
    - `warnings`: sentences on what may be wrong with the result, beside those of the headline
    - `events`: sentences on what happened to the recording
    - `method`, `timings_s` [s], `versions`, `inputs` (SHA-256 by file name): dictionaries of names and values
    - `cameras`: one dictionary for each camera, with `name` first
    - `truth`: `MotionComparison.to_dict()`; `digitised`: `DigitisedComparison.to_dict()`; `joints` and
      `smooth_joints`: `JointComparison.to_dict()`; `reference_flight`: `FlightComparison.to_dict()`
    - `joint_statuses`: by landmark, then by status, in how many frames; see `count_statuses`
    - `self_check`: what the pictures say against the files, see `Finding.to_dict`
    - `flight`: `FlightSummary.to_dict()`

    Units stand at the ends of keys (`_s`, `_px`, ...) and are shown as such. All text is escaped. Of the figures and
    the contact sheet, those in the folder are shown. Raises ResultError where a number of the headline or the
    flight is missing.
    """
    summary = json_ready(summary)
    missing = {"name", *headline(Motion.collect([]))} - set(summary)
    if summary.get("flight"):
        missing |= {each.name for each in fields(FlightSummary)} - set(summary["flight"])
    if missing:
        named = ", ".join(sorted(missing)[:3])
        raise ResultError(f"the summary of {folder} has no {named}, as of an older version; track again")
    if "method" in summary:
        whole_run = f"fitted by {SURFACES[summary['whole_run']]}" if "whole_run" in summary else None
        summary = {**summary, "method": {**summary["method"], "whole_run": whole_run}}
    path = folder / REPORT
    of_joints = {"Joint angles": _JOINT_ANGLES} if (figures_of(folder) / "joints.png").is_file() else {}
    uncertainty = {"Uncertainty": f"{_UNCERTAINTY} {summary.get('uncertainty', '')}"}
    html = render_report(
        "report.html.j2",
        summary,
        alarms=[*body_warnings(summary), *summary.get("warnings", [])],
        fine_text="Every frame was tracked, and every direction could be seen.",
        definitions={**DEFINITIONS, **of_joints, **uncertainty},
        tiles=list(_tiles(summary)),
        comparisons=list(list_comparisons(summary)),
        figures=[(name, *texts) for name, texts in _FIGURES.items()],
        folder=figures_of(folder),
        self_check=_self_check_table(summary.get("self_check", [])),
        viewer=viewer,
        flight_table=_flight_table(summary["flight"]) if summary.get("flight") else None,
    )
    write_text(path, html)
    return path


def _tiles(head: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    if head["rate_hz"] is not None:
        yield _with_unit(head["duration_s"], "{:.3g} s"), f"at {_with_unit(head['rate_hz'], '{:.5g}')} frames a second"
    yield _median_sd(head, "position", "mm"), "position, median standard deviation of an axis"
    yield _median_sd(head, "rotation", "deg"), "orientation, median standard deviation about an axis"
    if head["n_rotation_unobservable"] == head["n_tracked"] + head["n_uncertain"] > 0:
        yield "cannot be seen", "turns: in every frame some direction of the orientation is hidden"
    else:
        for turn in ("somersault", "twist"):
            turns, sd = head[f"{turn}_rev"], head[f"{turn}_rev_sd"]
            text = format_with_sd(turns, sd) + (" turns" if turns is not None else "")
            yield text, f"{turn}, first to last pose that shows it"
        low, high = head["tilt_range_deg"]
        yield UNKNOWN_TEXT if low is None else f"{round(low)}° to {round(high)}°".replace("-", "−"), "tilt"
    ranges = head["range_m"]
    yield (
        UNKNOWN_TEXT if ranges[0] is None else " · ".join(f"{r:.2f}" for r in ranges) + " m",
        "range of motion in x, y, z",
    )
    yield _with_unit(head["median_score"], "{:.1f}"), "median score in grey levels"


def _median_sd(head: Mapping[str, Any], what: str, unit: str) -> str:
    value = head[f"median_{what}_sd_{unit}"]
    if value is None:
        return "cannot be seen" if head[f"n_{what}_unobservable"] else UNKNOWN_TEXT
    return f"± {format_digits(value, 2)}{' mm' if unit == 'mm' else '°'}"


def _with_unit(value: float | None, form: str) -> str:
    return UNKNOWN_TEXT if value is None else form.format(value).replace("-", "−")


def _self_check_table(findings: Sequence[Mapping[str, Any]]) -> HtmlTable | None:
    """Return the sentences of the self-check; those that are alarms in words too."""
    rows = [(each["sentence"], "wrong" if each["is_alarm"] else "nothing unusual") for each in findings]
    return HtmlTable(rows) if rows else None


def _flight_table(flight: Mapping[str, Any]) -> HtmlTable:
    names = ("angular_momentum_kg_m2_s", "angular_momentum_sd_kg_m2_s", "angular_momentum_spread_kg_m2_s")
    mean, sd, scatter = (flight[name] for name in names)
    rows = [
        (f"angular momentum about {axis} [kg m²/s]: mean over the frames, standard deviation of one", *pair)
        for axis, *pair in zip("xyz", mean, sd, strict=True)
    ]
    rows += [
        (f"scatter of the frames about {axis} [kg m²/s]: standard deviation", each, "")
        for axis, each in zip("xyz", scatter, strict=True)
    ]
    if flight["fitted_gravity_m_s2"] is None:
        return HtmlTable([*rows, ("free fall", "none found", "")])
    rows.append(
        (
            "downward acceleration of the centre of mass [m/s²]: fitted, free fall",
            flight["fitted_gravity_m_s2"],
            GRAVITY_M_S2,
        )
    )
    rows.append(("standard deviation of the fitted one [m/s²]", flight["fitted_gravity_sd_m_s2"], ""))
    rows.append(("distance of the centre of mass from a free fall [mm], RMS", flight["ballistic_rms_mm"], ""))
    return HtmlTable(rows)
