"""report.html: a run's numbers, warnings, pictures and method on one self-contained page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from airborne.errors import ResultError
from airborne.export import page
from airborne.export.palette import STATUS_RGB, web
from airborne.export.summary import plain
from airborne.tracking import Status

CAPTIONS = {
    "pose.png": "Position of the body's root in the world and its somersault, tilt and twist over time.",
    "through_mask.png": (
        "What the cameras saw where the tracked body is drawn, all at one scale. Where the scene shows through, or the "
        "body is cut off, the pose is off. Times in amber are uncertain."
    ),
    "score.png": "Score, and the standard deviations of position and rotation, over time.",
    "digitised.png": "Tracked poses and those from points clicked by hand, with their difference below.",
    "errors.png": "Tracked minus true pose; about two thirds of the points should lie within half of the band.",
}

DEFINITIONS = {
    "World": "Metres, z up; its origin and axes are those of the calibration. Times are in seconds on the first camera's clock.",
    "Body axes": (
        "x to the subject's left, y to the back, z to the head, from the origin of the body's first segment (the root). "
        "The position is that of the root's origin."
    ),
    "Somersault, tilt, twist": (
        "Successive turns about the body's x, then y, then z axis: R = Rx(somersault) Ry(tilt) Rz(twist) maps body "
        "axes to world axes; forward somersault is positive. Somersault and twist are unwrapped over time. Near ±90° "
        "of tilt they cannot be told apart, and small errors of the orientation make large ones in both."
    ),
    "Score": "Root mean square colour difference between the pictures and the drawn body inside its outline, in grey levels (0 to 255).",
    "Status": (
        "Tracked: the pictures support the pose. Uncertain: the pose is a candidate that needs to be looked at. "
        "Lost: nothing is claimed, and the frame holds no numbers."
    ),
}


def write_report(folder: Path, summary: Mapping[str, Any]) -> Path:
    """Write report.html into the folder of a run, and return its path.

    `summary` is what `write_json` puts into summary.json. Its keys, of which the first four are required:

    - `name`: of the trial; `headline`: see `summary.headline`
    - `uncertainty`: in one or two sentences, which errors the standard deviations contain and which they do not
    - `method`: how it was tracked, a dictionary of names and values
    - `warnings`: sentences on what may be wrong with the result, beside those that the headline gives
    - `events`: sentences on what happened to the recording
    - `cameras`: one dictionary for each camera, with `name` first
    - `truth`: `Comparison.to_dict()`; `digitised`: `DigitisedComparison.to_dict()`
    - `versions`: of the software; `inputs`: SHA-256 by file name; `timings_s`: seconds by stage
    - `pictures`: names of PNG files in the folder, in the order of the page

    Units stand at the ends of keys (`_s`, `_px`, ...) and are shown as such. All text is escaped. Raises ResultError
    where a key is missing or a picture is not in the folder.
    """
    summary = plain(summary)
    missing = [key for key in ("name", "headline", "uncertainty", "method") if key not in summary]
    if missing:
        raise ResultError(f"the summary of {folder} has no {', '.join(missing)}; track again")
    path = folder / "report.html"
    path.write_text(page.page(summary["name"], _sections(folder, summary)), encoding="utf-8")
    return path


def _sections(folder: Path, summary: Mapping[str, Any]) -> Iterator[str]:
    head = summary["headline"]
    yield page.heading(summary["name"], 1)
    yield _status_bar(head)
    yield page.box("tiles", "".join(page.tile(value, name) for value, name in _tiles(head)))
    warnings = [*_warnings(head), *summary.get("warnings", [])]
    if warnings:
        yield page.box("warnings", "<b>Read this first</b>" + page.bullets(warnings))
    else:
        yield page.box("fine", "Every frame was tracked, and every direction could be seen.")
    if summary.get("events"):
        yield page.heading("The recording") + page.bullets(summary["events"])
    for title, key in (("Against the truth", "truth"), ("Against digitising by hand", "digitised")):
        if summary.get(key):
            yield page.heading(title) + _comparison(summary[key])
    if summary.get("pictures"):
        yield page.heading("Pictures")
        yield from (_picture(folder, name) for name in summary["pictures"])
    yield page.heading("Method") + _pairs(summary["method"])
    if summary.get("cameras"):
        yield page.heading("Cameras") + _records(summary["cameras"])
    yield page.heading("What the numbers mean")
    yield page.definitions({**DEFINITIONS, "Uncertainty": _uncertainty(summary["uncertainty"])})
    for title, key in (("Time taken [s]", "timings_s"), ("Versions", "versions"), ("Inputs (SHA-256)", "inputs")):
        if summary.get(key):
            yield page.heading(title) + _pairs(summary[key])


def _status_bar(head: Mapping[str, Any]) -> str:
    shares = [(head[f"n_{status}"], web(STATUS_RGB[status])) for status in Status]
    return page.box("bar", "".join(f'<div style="flex: {n} 0 0; background: {colour}"></div>' for n, colour in shares))


def _tiles(head: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    counts = ", ".join(f"{head[f'n_{status}']} {status}" for status in Status)
    yield f"{head['n_frames']} frames", counts
    yield _with_unit(head["duration_s"], "{:.3g} s"), f"at {_with_unit(head['rate_hz'], '{:.5g}')} frames a second"
    yield _spread(head, "position", "mm"), "position, median standard deviation of an axis"
    yield _spread(head, "rotation", "deg"), "orientation, median standard deviation about an axis"
    yield _with_unit(head["somersault_rev"], "{:.2f} turns"), "somersault, first to last pose"
    yield _with_unit(head["twist_rev"], "{:.2f} turns"), "twist, first to last pose"
    low, high = head["tilt_range_deg"]
    yield "not known" if low is None else f"{low:.0f}° to {high:.0f}°", "tilt"
    ranges = head["range_m"]
    yield (
        "not known" if ranges[0] is None else " · ".join(f"{r:.2f}" for r in ranges) + " m",
        "range of motion in x, y, z",
    )
    yield _with_unit(head["median_score"], "{:.1f}"), "median score in grey levels"


def _spread(head: Mapping[str, Any], what: str, unit: str) -> str:
    value = head[f"median_{what}_sd_{unit}"]
    if value is None:
        return "cannot be seen" if head[f"n_{what}_unobservable"] else "not known"
    return f"± {value:.2g} mm" if unit == "mm" else f"± {value:.2g}°"


def _with_unit(value: float | None, form: str) -> str:
    return "not known" if value is None else form.format(value)


def _warnings(head: Mapping[str, Any]) -> Iterator[str]:
    n, n_posed = head["n_frames"], head["n_tracked"] + head["n_uncertain"]
    if not n_posed:
        yield "The body was found in no frame: this run measured nothing."
    elif head["n_lost"]:
        yield f"{head['n_lost']} of {n} frames are lost; they hold no numbers."
    if head["n_uncertain"]:
        yield f"{head['n_uncertain']} of {n} frames are uncertain; look at them in the overlay videos before using them."
    for what in ("position", "rotation"):
        if head[f"n_{what}_unobservable"]:
            yield (
                f"In {head[f'n_{what}_unobservable']} of {n_posed} frames with a pose, some direction of the {what} cannot "
                "be seen in the pictures: its standard deviation is infinite, and the number there is only a guess."
            )
        elif n_posed and head[f"median_{what}_sd_{'mm' if what == 'position' else 'deg'}"] is None:
            yield f"The uncertainty of the {what} is not known."
    if head["n_near_singular"]:
        yield (
            f"In {head['n_near_singular']} frames tilt is within 5° of ±90°: somersault and twist mean little there, "
            "and their numbers of turns may be miscounted. The quaternions are sound."
        )
    if head["has_gap"]:
        yield "Whole turns were counted across lost frames, at the rate before them: somersault and twist may be off by turns."


def _uncertainty(contents: str) -> str:
    return (
        f"{contents} Given as one standard deviation for each axis; bands in the figures are two. If errors are normal, "
        "68 % of them lie within one and 95 % within two. Infinite means that the pictures do not show that direction."
    )


def _comparison(comparison: Mapping[str, Any]) -> str:
    errors = comparison.get("tracked_minus_digitised", comparison)
    position, orientation = errors["position"], errors["modulo_run"]
    rows: list[tuple[Any, ...]] = [
        (f"{axis} [mm]", position["rms_mm"][k], position["largest_mm"][k]) for k, axis in enumerate("xyz")
    ]
    rows.append(("distance [mm]", position["rms_3d_mm"], position["largest_3d_mm"]))
    for k, angle in enumerate(("somersault", "tilt", "twist")):
        rows.append((f"{angle} [°]", orientation["rms_deg"][k], orientation["largest_deg"][k]))
    rows.append(("whole orientation [°]", orientation["geodesic_rms_deg"], orientation["geodesic_largest_deg"]))
    lines = [f"{errors['n_matched']} of {errors['n_truth']} reference times matched."]
    if errors["n_symmetries"] > 1:
        lines.append("Orientation up to the one symmetry of the body that suits the whole run best.")
    if errors["n_flips"]:
        lines.append(f"{errors['n_flips']} jumps between orientations that look the same.")
    if "rigid_fit_residual_rms_mm" in comparison:
        lines.append(f"The clicked points fit a rigid body to {comparison['rigid_fit_residual_rms_mm']:.1f} mm RMS.")
    for what in ("position", "rotation"):
        share = errors[f"{what}_calibration"]
        if share["n"]:
            lines.append(
                f"Of the {what} errors, {share['within_1sd']:.0%} lie within one standard deviation (normal: 68%) "
                f"and {share['within_2sd']:.0%} within two (95%)."
            )
    return page.table(rows, ("", "RMS", "largest")) + page.bullets(lines)


def _picture(folder: Path, name: str) -> str:
    if not (folder / name).is_file():
        raise ResultError(f"{folder / name} not found, which the report shows; track again")
    return page.picture(folder / name, CAPTIONS.get(name, name))


def _pairs(values: Mapping[str, Any]) -> str:
    return page.table((page.label(key), value) for key, value in values.items())


def _records(records: list[Mapping[str, Any]]) -> str:
    keys = list(dict.fromkeys(key for record in records for key in record))
    rows = [[record.get(key, "") for key in keys] for record in records]
    return page.table(rows, [page.label(key) for key in keys])
