"""Curves of runs on one time: real, or normalised between events."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airborne.errors import ResultError, count, require_choice
from airborne.io.text import read_csv
from airborne.motion.run_folder import ANGLES, FLIGHT, JOINT_ANGLES, JOINTS
from airborne.study.trials import LARGEST, StudyTrial
from airborne.types import Array

NODES = 100  # of a curve between two events: one a percent
CURVE_EVENTS = ("start", "end", "take-off", "landing", "turn-1")  # turn-2, ... too
_TURN = re.compile(r"turn-([1-9]\d?)")
_OF_THE_ROW = {"take-off": "takeoff_s", "landing": "landing_s"}
_WIDE = (ANGLES, FLIGHT)
_NO_CURVES = ("frame", "time_s", "status", "is_singular")
_LONG = {JOINTS: ("m", "sd_m"), JOINT_ANGLES: ("deg", "{axis}_deg_sd")}  # unit and sd of x_m, x_deg
_JOINT_TABLES = [Path(name).name for name in _LONG]
_FORM = "a run's table has a line of names, time_s among them, and as many cells in each line"
_FEWEST = 3  # known frames of a curve


@dataclass(frozen=True, slots=True, eq=False)
class RunCurve:
    """A variable of one run over its known frames."""

    time_s: Array  # (n,)
    values: Array  # (n,)
    sd: Array  # (n,), NaN where the run states none


def read_curve(trial: StudyTrial, variable: str) -> RunCurve:
    """Read a variable of a trial's run: a column of angles.csv or flight.csv, or `<joint>_x_m`, `<joint>_x_deg`.

    Raises ResultError where the run has none, or hardly any frames of it.
    """
    for name in _WIDE:
        table = _read(trial.folder / name)
        if variable in table:
            return _drop_unknown(trial, variable, table["time_s"], table[variable], sd=table.get(f"{variable}_sd"))
    named = re.fullmatch(r"(.+)_([xyz])_(m|deg)", variable)
    for name, (unit, sd) in _LONG.items():
        table = _read(trial.folder / name)
        if not table or named is None or named[3] != unit:
            continue
        mask = table["joint"] == named[1]
        if "player" in table:
            mask &= table["player"] == trial.athlete
        column = table.get(f"{named[2]}_{unit}")
        if mask.any() and column is not None:
            stated = table.get(sd.format(axis=named[2]), np.full(len(mask), ""))
            return _drop_unknown(trial, variable, table["time_s"][mask], column[mask], sd=stated[mask])
    listed = list_curves(trial)
    if variable in listed:  # of players, and none of them is this athlete
        raise ResultError(f"{trial.name}: its run has no player '{trial.athlete}'; name players as their athletes")
    raise ResultError(f"{trial.name}: its run has no variable '{variable}'")


def list_curves(trial: StudyTrial) -> list[str]:
    """Return the names of all curves of a trial's run."""
    of_joints = [
        f"{joint}_{axis}_{unit}"
        for name, (unit, _) in _LONG.items()
        for joint in _list_joints(trial, name)
        for axis in "xyz"
    ]
    return _list_columns(trial) + of_joints


def describe_curves(trial: StudyTrial) -> str:
    """Say which curves a trial's run has, each joint once."""
    of_joints = [
        f"; <joint>_x_{unit} of {', '.join(joints)}"
        for name, (unit, _) in _LONG.items()
        if (joints := _list_joints(trial, name))
    ]
    return f"curves: {', '.join(_list_columns(trial)) or 'none'}{''.join(of_joints)}"


def _list_columns(trial: StudyTrial) -> list[str]:
    wide = [column for name in _WIDE for column in _read(trial.folder / name)]
    return [each for each in wide if not each.endswith(("_sd", "_sd_frame")) and each not in _NO_CURVES]


def _list_joints(trial: StudyTrial, table: str) -> list[str]:
    return list(dict.fromkeys(_read(trial.folder / table).get("joint", np.array([])).tolist()))


def event_times(trial: StudyTrial, curve: RunCurve, events: Sequence[str]) -> list[float]:
    """Return the times of events [s], in their order.

    `start` and `end` are the curve's; take-off and landing those of the trial's row; `turn-2` is when the body has
    turned twice, by the somersault, since the first event. Raises ResultError for one that the run has not.
    """
    times: list[float] = []
    for name in events:
        if name in ("start", "end"):
            time_s = float(curve.time_s[0 if name == "start" else -1])
        elif name in _OF_THE_ROW:
            stated = trial.require_number(_OF_THE_ROW[name])
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
            require_choice(name, CURVE_EVENTS, "event")
    if len(events) < 2:
        raise ResultError(f"events {', '.join(events) or 'none'}: give two or more, such as take-off,landing")


def normalise_time(curve: RunCurve, times: Sequence[float]) -> tuple[Array, Array]:
    """Return a curve and its variance at 101 nodes between each two events, ends shared: (nodes,) each."""
    share = np.linspace(0, len(times) - 1, NODES * (len(times) - 1) + 1)
    return sample(curve, np.interp(share, np.arange(len(times)), times))


def sample(curve: RunCurve, time_s: Array) -> tuple[Array, Array]:
    """Return a curve and its variance at some times, linear between the known frames; 0 where none is stated."""
    sd = np.interp(time_s, curve.time_s, np.where(np.abs(curve.sd) < LARGEST, curve.sd, 0.0))
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


def _read(path: Path) -> dict[str, NDArray[np.str_]]:
    """Read the columns of a run's table; none where there is no table. Raises ResultError where it is damaged."""
    if not path.is_file():
        return {}
    (_, names), *rows = read_csv(path, _FORM, ResultError) or [(1, [""])]
    cells = [row for _, row in rows if len(row) == len(names)]
    needed = {"time_s", "joint"} if path.name in _JOINT_TABLES else {"time_s"}
    if not needed <= set(names) or len(cells) < len(rows):
        raise ResultError(f"{path} is damaged; {_FORM}; track the trial again")
    return dict(zip(names, np.array(cells, str).reshape(len(cells), len(names)).T, strict=True))


def _drop_unknown(
    trial: StudyTrial,
    variable: str,
    time_s: NDArray[np.str_],
    values: NDArray[np.str_],
    *,
    sd: NDArray[np.str_] | None,
) -> RunCurve:
    """Return the curve of three columns where its values are known."""
    texts = (time_s, values, np.full(len(values), "") if sd is None else sd)
    try:
        numbers = [np.where(each == "", "nan", each).astype(float) for each in texts]
    except ValueError as error:
        raise ResultError(f"{trial.name}: {variable} is damaged ({str(error)[:60]}); track the trial again") from None
    is_known = np.isfinite(numbers[0]) & (np.abs(numbers[1]) < LARGEST)
    if is_known.sum() < _FEWEST or (np.diff(numbers[0][is_known]) <= 0).any():
        raise ResultError(
            f"{trial.name}: {variable} is known in {count(is_known.sum(), 'frame')}, {_FEWEST} at least are needed"
        )
    return RunCurve(*(column[is_known] for column in numbers))
