"""The row of one finished run in a batch's table: its headline numbers, what it found wrong, what it was made by."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from airborne.constants import NORMAL_QUANTILE_975
from airborne.errors import ResultError, count_of
from airborne.export.summary import is_mostly_untracked
from airborne.io.text import read_csv
from airborne.motion.flight.phases import find_flight_events
from airborne.motion.run_folder import FLIGHT, SUMMARY, read_summary

TableRow = dict[str, Any]
_HIGHEST_M = 1e6  # of a centre of mass: no height beyond it
_STATUSES = ("tracked", "uncertain", "lost")
_OF_A_BODY = (
    "median_position_sd_mm",
    "median_rotation_sd_deg",
    "somersault_rev",
    "somersault_rev_sd",
    "twist_rev",
    "twist_rev_sd",
)
_OF_A_FLIGHT = ("fitted_gravity_m_s2", "ballistic_rms_mm")
_OF_A_JUMP = (
    "hip_height_m",
    "foot_height_m",
    "takeoff_s",
    "landing_s",
    "flight_s",
)  # of the highest of a trial's jumps


def row_of(folder: Path) -> TableRow:
    """Return the columns of the finished run in a folder, in the order of the table; those that it lacks are left out.

    A number's standard deviation, where the run states one, is `<name>_sd`. Raises ResultError for a damaged run.
    """
    summary = read_summary(folder)
    try:
        return _columns(folder, summary)
    except (LookupError, TypeError, ValueError, AttributeError, ZeroDivisionError, OverflowError) as error:
        raise ResultError(
            f"{folder}: its tables or {SUMMARY} are damaged ({type(error).__name__}: {str(error)[:80]}); remove it"
        ) from None


def _columns(folder: Path, summary: Mapping[str, Any]) -> TableRow:
    n = summary["n_frames"]
    row: dict[str, Any] = {"n_frames": n} | {f"share_{name}": summary[f"n_{name}"] / n for name in _STATUSES}
    if of_joints := summary.get("joint_statuses"):
        row["share_joints_tracked"] = float(np.mean([counts["tracked"] for counts in of_joints.values()])) / n
    row |= {name: summary[name] for name in ("duration_s", "rate_hz", *_OF_A_BODY) if name in summary}
    if "tilt_range_deg" in summary:
        row |= dict(zip(("tilt_least_deg", "tilt_most_deg"), summary["tilt_range_deg"], strict=True))
    row |= _flight(summary.get("flight", {})) | _jump(folder / FLIGHT)
    if "jumps" in summary:
        row |= _highest_jump(summary["jumps"])
    findings = summary.get("self_check") or []
    alarms = [each["sentence"] for each in findings if each["is_alarm"]]
    if is_mostly_untracked(summary):
        tracked = count_of(summary["n_tracked"], n, "frame") if summary["n_tracked"] else "no frame is"
        alarms.append(f"{tracked} tracked: look at the overlays and at what the report says of the recording")
    row |= {"n_alarms": len(alarms), "findings": "; ".join(alarms), "n_warnings": len(summary["warnings"])}
    return row | {"version": summary["versions"]["airborne"]}


def _flight(flight: Mapping[str, Any]) -> TableRow:
    """Return the angular momentum and how free the flight was."""
    momentum = flight.get("angular_momentum_kg_m2_s")
    if momentum is None or None in momentum:
        return {}
    named = dict(zip((f"L_{axis}_kg_m2_s" for axis in "xyz"), momentum, strict=True))
    return named | {"L_kg_m2_s": math.hypot(*momentum)} | {name: flight[name] for name in _OF_A_FLIGHT}


def _jump(path: Path) -> TableRow:
    """Return take-off, landing and rise of the first whole flight of a body with masses."""
    if not path.is_file():
        return {}
    (_, names), *rows = read_csv(path, "expected a flight's table", ResultError)
    # errors that last all run long move no take-off; tables of older versions hold those of single frames alone
    sd_name = "com_z_m_sd_frame" if "com_z_m_sd_frame" in names else "com_z_m_sd"
    columns = [names.index(name) for name in ("time_s", "com_z_m", sd_name)]
    values = np.array([[float(cells[k] or "nan") for k in columns] for _, cells in rows]).reshape(-1, 3)
    time_s, height_m, sd = values[np.isfinite(values[:, 1])].T
    if not ((np.diff(time_s) > 0).all() and (np.abs(height_m) < _HIGHEST_M).all()):
        raise ValueError(f"{FLIGHT}: times that do not increase, or heights that none can have")
    sd = np.where(np.abs(sd) < _HIGHEST_M, sd, np.inf)
    for start, end in pairwise(find_flight_events(time_s, height_m, sd**2)):
        inside = np.flatnonzero((time_s >= start.time_s) & (time_s <= end.time_s))
        if (start.name, end.name) == ("take-off", "landing") and len(inside):
            peak = inside[np.argmax(height_m[inside])]
            low, low_sd = (float(np.interp(start.time_s, time_s, values)) for values in (height_m, sd))
            return {
                "takeoff_s": start.time_s,
                "landing_s": end.time_s,
                "flight_s": end.time_s - start.time_s,
                "com_rise_m": float(height_m[peak]) - low,
                "com_rise_m_sd": math.hypot(float(sd[peak]), low_sd),
            }
    return {}


def _highest_jump(jumps: list[dict[str, Any]]) -> TableRow:
    """Return how many jumps players made, and the highest, its sd from its 95 % interval.

    The highest by the hips, or where no such height is known the longest.
    """
    row: dict[str, Any] = {"n_jumps": len(jumps)}
    measures = ("hip_height_m", "flight_s")
    known = {name: [jump for jump in jumps if isinstance(jump.get(name), float)] for name in measures}
    by = next((name for name in measures if known[name]), None)
    if by is None:
        return row
    highest = max(known[by], key=lambda jump: jump[by])
    row["player"] = highest["player"]
    for name in _OF_A_JUMP:
        low, high = highest.get(f"{name}_low"), highest.get(f"{name}_high")
        row[name] = highest.get(name)
        if low is not None and high is not None:
            row[f"{name}_sd"] = (high - low) / (2 * NORMAL_QUANTILE_975)
    return row
