"""The table of jumps: jumps.csv, and a short text for the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from airborne.motion.jumps.jump import Jump, Measured
from airborne.motion.tables import cell

_MEASURED = (
    "takeoff_s",
    "landing_s",
    "takeoff_frame",
    "landing_frame",
    "flight_s",
    "foot_height_m",
    "hip_height_m",
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
_PLACES = ("takeoff_place_m", "landing_place_m")
_HEIGHTS = {
    "foot_height_m": "feet over standing",
    "hip_height_m": "hips over standing",
    "flight_time_height_m": "by flight time",
    "takeoff_speed_height_m": "by take-off speed",
    "hip_rise_m": "hips from take-off",
}


def _names() -> tuple[str, ...]:
    measured = [*_MEASURED, *(f"{place.removesuffix('_place_m')}_{axis}_m" for place in _PLACES for axis in "xy")]
    measured += ["standing_hips_m", "standing_ankles_m"]
    numbers = [column for name in measured for column in (name, f"{name}_low", f"{name}_high")]
    stand = ["standing_source", "standing_first_frame", "standing_last_frame"]
    return ("player", "jump", "status", *numbers, *stand, "block_level_m", "noise_scale", "n_lost", "n_uncertain")


COLUMNS = _names()


def columns_of(jump: Jump) -> dict[str, str | int | float]:
    """Return one row of jumps.csv: every number with the ends of its 95 % interval; NaN where unknown."""
    row: dict[str, str | int | float] = {"player": jump.player, "jump": jump.number, "status": jump.status}
    for name in _MEASURED:
        row |= _three(name, getattr(jump, name))
    for name in _PLACES:
        stem = name.removesuffix("_place_m")
        for axis, measured in zip("xy", getattr(jump, name), strict=True):
            row |= _three(f"{stem}_{axis}_m", measured)
    stand = jump.standing
    row |= _three("standing_hips_m", stand.hips_m) | _three("standing_ankles_m", stand.ankles_m)
    first, last = stand.frames or (np.nan, np.nan)
    row |= {"standing_source": stand.source, "standing_first_frame": first, "standing_last_frame": last}
    row |= {"block_level_m": jump.block_level_m, "noise_scale": jump.noise_scale}
    return row | {"n_lost": jump.n_lost, "n_uncertain": jump.n_uncertain}


def write_jumps(path: Path, jumps: Sequence[Jump]) -> None:
    """Write jumps.csv, one row a jump: each number with `_low` and `_high`, its 95 % interval; empty where unknown.

    Without jumps the file holds its first line alone.
    """
    lines = [",".join(COLUMNS)]
    lines += [",".join(_text(value) for value in columns_of(jump).values()) for jump in jumps]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def describe(jumps: Sequence[Jump]) -> str:
    """Return the jumps as a short plain table: heights in cm with half their 95 % intervals."""
    if not jumps:
        return "no jump found"
    names = [f"{jump.player} {jump.number}" for jump in jumps]
    width = max(14, *(len(name) + 2 for name in names))
    lines = [f"{'jump height [cm]':<22}" + "".join(f"{name:>{width}}" for name in names)]
    for field, title in _HEIGHTS.items():
        lines.append(_line(title, [_plus_minus(getattr(jump, field), 100.0, 1) for jump in jumps], width))
    lines.append(_line("take-off [frame]", [_plus_minus(jump.takeoff_frame, 1.0, 1) for jump in jumps], width))
    lines.append(_line("landing [frame]", [_plus_minus(jump.landing_frame, 1.0, 1) for jump in jumps], width))
    lines.append(_line("flight [ms]", [_plus_minus(jump.flight_s, 1e3, 0) for jump in jumps], width))
    lines.append(_line("standing from", [jump.standing.source for jump in jumps], width))
    for jump, name in zip(jumps, names, strict=True):
        if jump.status != "whole":
            lines.append(f"{name}: {_WHY[jump.status]}; numbers that need it are left out")
        if jump.n_lost:
            lines.append(f"{name}: hips or ankles unknown in {jump.n_lost} frames of the flight")
        if jump.n_uncertain:
            lines.append(f"{name}: {jump.n_uncertain} frames of the flight are uncertain; look at them before use")
    lines.append("after +-: half of the 95 % interval")
    return "\n".join(lines)


_WHY = {
    "no take-off": "the take-off is not seen",
    "no landing": "the landing is not seen",
    "neither": "neither take-off nor landing is seen",
}


def _three(name: str, measured: Measured) -> dict[str, str | int | float]:
    return {name: measured.value, f"{name}_low": measured.low, f"{name}_high": measured.high}


def _text(value: str | int | float) -> str:
    return cell(value) if isinstance(value, float) else str(value)


def _line(title: str, cells: Sequence[str], width: int) -> str:
    return f"  {title:<20}" + "".join(f"{text:>{width}}" for text in cells)


def _plus_minus(measured: Measured, scale: float, digits: int) -> str:
    if not np.isfinite(measured.value):
        return "-"
    half = scale * (measured.high - measured.low) / 2
    return f"{scale * measured.value:.{digits}f} +-{half:.{digits}f}"
