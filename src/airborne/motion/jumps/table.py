"""The table of jumps: jumps.csv."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from airborne.io.writing import write_text
from airborne.motion.jumps.jump import Jump, Measurement
from airborne.motion.tables import cell

_MEASUREMENTS = (
    "takeoff_s",
    "landing_s",
    "takeoff_frame",
    "landing_frame",
    "flight_s",
    "foot_height_m",
    "hip_height_m",
    "tuck_m",
    "flight_time_height_m",
    "takeoff_speed_height_m",
    "hip_rise_m",
    "takeoff_speed_m_s",
    "block_s",
    "drift_m",
    "hip_peak_speed_m_s",
    "foot_peak_speed_m_s",
    "reach_m",
)
_POSITIONS = ("takeoff_position_m", "landing_position_m")


def _column_names() -> tuple[str, ...]:
    measured = [
        *_MEASUREMENTS,
        *(f"{name.removesuffix('_position_m')}_{axis}_m" for name in _POSITIONS for axis in "xy"),
    ]
    measured += ["standing_hips_m", "standing_ankles_m"]
    numbers = [column for name in measured for column in (name, f"{name}_low", f"{name}_high")]
    posture = ["standing_source", "standing_first_frame", "standing_last_frame"]
    counts = ["n_lost", "n_uncertain", "n_hips_uncertain"]
    return ("player", "jump", "status", *numbers, *posture, "block_level_m", "noise_scale", *counts)


JUMP_COLUMNS = _column_names()


def jump_row(jump: Jump) -> dict[str, str | int | float]:
    """Return one row of jumps.csv: every number with its 95 % interval; NaN where unknown."""
    row: dict[str, str | int | float] = {"player": jump.player, "jump": jump.number, "status": jump.status}
    for name in _MEASUREMENTS:
        row |= _with_interval(name, getattr(jump, name))
    for name in _POSITIONS:
        stem = name.removesuffix("_position_m")
        for axis, measured in zip("xy", getattr(jump, name), strict=True):
            row |= _with_interval(f"{stem}_{axis}_m", measured)
    posture = jump.standing
    row |= _with_interval("standing_hips_m", posture.hips_m) | _with_interval("standing_ankles_m", posture.ankles_m)
    first, last = posture.frames or (np.nan, np.nan)
    row |= {"standing_source": posture.source, "standing_first_frame": first, "standing_last_frame": last}
    row |= {"block_level_m": jump.block_level_m, "noise_scale": jump.noise_scale}
    counts = {"n_lost": jump.n_lost, "n_uncertain": jump.n_uncertain, "n_hips_uncertain": jump.n_hips_uncertain}
    return row | counts


def write_jumps(path: Path, jumps: Sequence[Jump]) -> None:
    """Write jumps.csv, one row a jump: each number with `_low` and `_high`, its 95 % interval; empty where unknown.

    Without jumps the file holds only its header.
    """
    lines = [",".join(JUMP_COLUMNS)]
    lines += [",".join(_text(value) for value in jump_row(jump).values()) for jump in jumps]
    write_text(path, "\n".join(lines) + "\n")


def _with_interval(name: str, measured: Measurement) -> dict[str, str | int | float]:
    return {name: measured.value, f"{name}_low": measured.low, f"{name}_high": measured.high}


def _text(value: str | int | float) -> str:
    return cell(value) if isinstance(value, float) else str(value)
