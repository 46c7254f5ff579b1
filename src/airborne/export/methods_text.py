"""A paragraph for a methods section, from the summary of a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from airborne.cameras.finding import join_names
from airborne.errors import count

_FITTED = "by fitting a coloured three-dimensional model of the body to the images of all cameras, frame by frame"
_COMPARED = "by moving a coloured three-dimensional model of the body until its pictures and the images differ least"
_WAYS = {
    **dict.fromkeys(("refined", "joint", "hierarchical"), _FITTED),
    **dict.fromkeys(("stepping", "simplex"), _COMPARED),
    "blocker": "by fitting a model of each player's legs to the images of all cameras, frame by frame",
}
SURFACES = {"skin": "a smooth skin of the body", "ellipsoids": "the same model"}  # of the fit of a whole run
_PARTICLES = "with particle filters on the colours of the players' legs"


def describe_methods(summary: Mapping[str, Any]) -> str:
    """Return what was done and how sure its results are, in sentences; what the summary does not hold is left out."""
    versions, method = summary.get("versions") or {}, (summary.get("method") or {}).get("method", "unknown")
    cameras, players = summary.get("cameras") or [], summary.get("players") or {}
    what = f"The motion of {count(len(players), 'player')}" if players else "The motion"
    text = [
        f"{what} was measured from the videos of {count(len(cameras), 'calibrated camera')}, without markers, with "
        f"Airborne {versions.get('airborne', '')} (method '{method}'), {_WAYS.get(method, _PARTICLES)}."
    ]
    if surface := SURFACES.get(summary.get("whole_run", "")):
        text.append(
            f"The poses of all frames were then fitted together to the images, by {surface}, with smooth accelerations "
            "and, in flight, a centre of mass that falls freely and a constant angular momentum."
        )
    errors = [each["calibration_rms_px"] for each in cameras if each.get("calibration_rms_px") is not None]
    if errors:
        text.append(f"The calibration left residuals of {_span(errors, '.2f')} px RMS in the cameras.")
    times = count(summary["n_frames"], "image time")
    rate = f" at {summary['rate_hz']:.5g} Hz" if summary.get("rate_hz") else ""
    tracked, unsure, lost = (summary[f"n_{status}"] for status in ("tracked", "uncertain", "lost"))
    text.append(f"At {times}{rate}, {count(tracked, 'pose')} were tracked, {unsure} were uncertain and {lost} lost.")
    text += describe_corrections(summary)
    sds = [
        f"{summary[key]:.1f} {unit} in {name}"
        for key, unit, name in (
            ("median_position_sd_mm", "mm", "position"),
            ("median_rotation_sd_deg", "°", "orientation"),
        )
        if isinstance(summary.get(key), float)
    ]
    joints = [each["median_sd_mm"] for each in players.values() if each.get("median_sd_mm") is not None]
    if joints:
        sds.append(f"{_span(joints, '.0f')} mm for a player's joints")
    if sds:
        text.append(f"Median standard deviations were {' and '.join(sds)}. {summary.get('uncertainty', '')}".strip())
    alarms = [each["sentence"] for each in summary.get("self_check") or [] if each["is_alarm"]]
    text += [f"The run's check of itself reported: {each.rstrip('.')}." for each in alarms]
    others = ", ".join(f"{name} {number}" for name, number in versions.items() if name != "airborne")
    return " ".join([*text, *([f"Versions: {others}."] if others else [])])


def describe_corrections(summary: Mapping[str, Any]) -> list[str]:
    """Return in which frames the pose was given beside the images, how surely, and which images were left out."""
    keys, masks, text = summary.get("keys") or [], summary.get("masks") or [], list[str]()
    if keys:
        by_form: dict[str, list[str]] = {}
        for key in keys:
            by_form.setdefault(_forms(key), []).append(str(key["frame"]))
        groups = ", ".join(f"{join_names(frames)} ({form})" for form, frames in by_form.items())
        text.append(f"The pose was corrected in {count(len(keys), 'frame')}: {groups}.")
    stretches: dict[str, list[str]] = {}
    for mask in masks:
        stretches.setdefault(mask["camera"], []).append(name_stretch(mask["first"], mask["last"]))
    left_out = "; ".join(f"{camera} of {join_names(frames)}" for camera, frames in stretches.items())
    return [*text, *([f"Cameras were left out of some frames: {left_out}."] if masks else [])]


def name_stretch(first: int, last: int) -> str:
    """Name frames by the first and the last of them."""
    return str(first) if first == last else f"{first} to {last}"


def _forms(key: Mapping[str, Any]) -> str:
    """Return what a key gives, and with which standard deviations."""
    units = {"sd_px": (1, "px"), "sd_m": (1000, "mm"), "sd_deg": (1, "°")}
    sds = [f"± {factor * key[name]:g} {unit}" for name, (factor, unit) in units.items() if name in key]
    return f"{' and '.join(key['gives'])}, {' and '.join(sds)}"


def _span(values: Sequence[float], form: str) -> str:
    low, high = format(min(values), form), format(max(values), form)
    return low if low == high else f"{low} to {high}"
