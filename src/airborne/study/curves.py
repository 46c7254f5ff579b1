"""Curves of runs on one time: real, or normalised between events."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from airborne.errors import ResultError, require_choice
from airborne.motion.run_folder import JOINTS
from airborne.study.trials import StudyTrial
from airborne.types import Array

NODES = 100  # of a curve between two events: one a percent
EVENTS = ("start", "end", "take-off", "landing", "turn-1")  # turn-2, ... too
_TURN = re.compile(r"turn-([1-9]\d?)")
_OF_THE_ROW = {"take-off": "takeoff_s", "landing": "landing_s"}
_WIDE = ("tables/angles.csv", "tables/flight.csv")
_LONG = {JOINTS: ("m", "sd_m"), "tables/joint_angles.csv": ("deg", "{axis}_deg_sd")}  # unit and sd of x_m, x_deg
_FEWEST = 3  # known frames of a curve


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """A variable of one run over its known frames."""

    time_s: Array  # (n,)
    values: Array  # (n,)
    sd: Array  # (n,), NaN where the run states none


def read_curve(trial: StudyTrial, variable: str) -> Curve:
    """Read a variable of a trial's run: a column of angles.csv or flight.csv, or `<joint>_x_m`, `<joint>_x_deg`.

    Raises ResultError where the run has none, or hardly any frames of it.
    """
    for name in _WIDE:
        table = _read(trial.folder / name)
        if table is not None and variable in table:
            sd = table[f"{variable}_sd"] if f"{variable}_sd" in table else np.full(len(table), np.nan)
            return _known(trial, variable, table["time_s"], table[variable], sd)
    named = re.fullmatch(r"(.+)_([xyz])_(m|deg)", variable)
    for name, (unit, sd_column) in _LONG.items():
        table = _read(trial.folder / name)
        if table is None or named is None or named[3] != unit:
            continue
        table = table[table["joint"] == named[1]]
        if "player" in table:
            table = table[table["player"] == trial.athlete]
        if len(table):
            sd = table[sd_column.format(axis=named[2])]
            return _known(trial, variable, table["time_s"], table[f"{named[2]}_{unit}"], sd)
    raise ResultError(f"{trial.name}: its run has no {variable}; it has: {', '.join(list_curves(trial)[:40])}")


def list_curves(trial: StudyTrial) -> list[str]:
    """Return the names of all curves of a trial's run."""
    names = []
    for name in _WIDE:
        table = _read(trial.folder / name)
        columns = [] if table is None else [each for each in table if not each.endswith("_sd")]
        names += [each for each in columns if each not in ("frame", "time_s", "is_singular")]
    for name, (unit, _) in _LONG.items():
        table = _read(trial.folder / name)
        joints = [] if table is None else list(dict.fromkeys(table["joint"]))
        names += [f"{joint}_{axis}_{unit}" for joint in joints for axis in "xyz"]
    return names


def event_times(trial: StudyTrial, curve: Curve, events: Sequence[str]) -> list[float]:
    """Return the times of events [s], in their order.

    `start` and `end` are the curve's; take-off and landing those of the trial's row; `turn-2` is when the body has
    turned twice, by the somersault, since the first event. Raises ResultError for one that the run has not.
    """
    times: list[float] = []
    for name in events:
        if name in ("start", "end"):
            time_s = float(curve.time_s[0 if name == "start" else -1])
        elif name in _OF_THE_ROW:
            stated = trial.number(_OF_THE_ROW[name])
            time_s = np.nan if stated is None else stated
        else:
            time_s = _turn_s(trial, int(name.removeprefix("turn-")), times[0] if times else float(curve.time_s[0]))
        if not np.isfinite(time_s) or (times and time_s <= times[-1]):
            raise ResultError(f"{trial.name}: no {name}{f' after {events[len(times) - 1]}' if times else ''}")
        times.append(time_s)
    if times[0] < curve.time_s[0] or times[-1] > curve.time_s[-1]:
        raise ResultError(f"{trial.name}: the curve does not reach from {events[0]} to {events[-1]}")
    return times


def require_events(events: Sequence[str]) -> None:
    """Raise AirborneError where one of the events is none, or there are fewer than two."""
    for name in events:
        if not _TURN.fullmatch(name):
            require_choice(name, EVENTS, "event")
    if len(events) < 2:
        raise ResultError(f"events {', '.join(events) or 'none'}: give two or more, such as take-off,landing")


def normalise(curve: Curve, times: Sequence[float]) -> tuple[Array, Array]:
    """Return a curve and its variance at 101 nodes between each two events, ends shared: (nodes,) each."""
    share = np.linspace(0, len(times) - 1, NODES * (len(times) - 1) + 1)
    return sample(curve, np.interp(share, np.arange(len(times)), times))


def sample(curve: Curve, time_s: Array) -> tuple[Array, Array]:
    """Return a curve and its variance at some times, linear between the known frames; 0 where none is stated."""
    sd = np.interp(time_s, curve.time_s, np.where(np.isfinite(curve.sd), curve.sd, 0.0))
    return np.interp(time_s, curve.time_s, curve.values), sd**2


def _turn_s(trial: StudyTrial, n: int, since_s: float) -> float:
    angle = read_curve(trial, "somersault_deg")
    turned = np.abs(angle.values - np.interp(since_s, angle.time_s, angle.values)) / 360
    after = np.flatnonzero((angle.time_s > since_s) & (turned >= n))
    if not len(after):
        return np.nan
    k = after[0]
    if k == 0 or turned[k - 1] >= n:
        return float(angle.time_s[k])
    return float(np.interp(n, turned[k - 1 : k + 1], angle.time_s[k - 1 : k + 1]))


def _read(path: Path) -> pd.DataFrame | None:
    return pd.read_csv(path) if path.is_file() else None


def _known(trial: StudyTrial, variable: str, time_s: pd.Series, values: pd.Series, sd: pd.Series | Array) -> Curve:
    columns = [np.asarray(each, float) for each in (time_s, values, sd)]
    is_known = np.isfinite(columns[1])
    if is_known.sum() < _FEWEST:
        raise ResultError(
            f"{trial.name}: {variable} is known in {is_known.sum()} frames, {_FEWEST} at least are needed"
        )
    return Curve(*(column[is_known] for column in columns))
