"""Errors of a flight: centre of mass, angular momentum and rotation against the truth or another system."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from itertools import chain
from pathlib import Path

import numpy as np

from airborne.body import BodyModel
from airborne.errors import ResultError
from airborne.evaluation.columns import align_columns
from airborne.evaluation.compare import nan_to_none, or_dash, sd_calibration
from airborne.evaluation.table import read_table
from airborne.evaluation.times import CLEARLY_BETTER, ELSEWHERE_MM, best_time_shift, match_times, question_shift, span
from airborne.motion import Motion, state_flight
from airborne.types import Array

_COM, _MOMENTUM = ([f"{name}_{axis}_{unit}" for axis in "xyz"] for name, unit in (("com", "m"), ("L", "kg_m2_s")))
_ROTATION = ("somersault", "tilt", "twist")
_DEG_OF = {"deg": 1.0, "rev": 360.0}
_EXPECTED = (
    "a table with the column time_s and com_x_m, com_y_m, com_z_m, or L_x_kg_m2_s, L_y_kg_m2_s, L_z_kg_m2_s, or "
    "somersault_deg, tilt_deg or twist_deg (also somersault_rev, twist_rev), as flight.csv has them"
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FlightPaths:
    """A flight over time; NaN where not known."""

    time_s: Array  # (n,) increasing [s]
    com: Array | None  # (n, 3) world [m]; None: the file has none, as of the next two
    angular_momentum: Array | None  # (n, 3) about it, world axes [kg m2/s]
    rotation_deg: Mapping[str, Array]  # (n,) by name, of the root: somersault, tilt, twist


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightErrors:
    """Errors of one quantity, measured minus reference, in its unit."""

    unit: str
    n: int
    rms: float
    largest: float
    bias: float  # their mean
    rms_without_bias: float
    within_2sd: float  # share of them within two stated standard deviations; NaN where none is stated


@dataclass(frozen=True, slots=True, kw_only=True)
class Turns:
    """By how much the root turned between the first and the last matched frame [rev]."""

    measured_rev: float
    reference_rev: float


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightComparison:
    """A motion's flight against a reference, over the frames whose times match and that have a pose."""

    n_frames: int  # of the motion
    n_reference: int
    n_matched: int
    quantities: dict[str, FlightErrors]  # centre of mass x, y, z; angular momentum x, y, z; somersault, tilt, twist
    turns: dict[str, Turns]  # somersault, twist
    better_shift_s: float  # added to the reference's times, its centre of mass would clearly agree better, or 0
    better_com_mm: float  # mean distance with that shift
    com_mm: float  # mean distance of the centres of mass; NaN where the reference has none

    def to_dict(self) -> dict:
        """Return the numbers for a JSON file; what is unknown is None."""
        return nan_to_none(asdict(self) | {"questions": list(self.questions)})

    @property
    def questions(self) -> tuple[str, ...]:
        """What is asked about the reference where its centre of mass is far away, one line each."""
        if self.better_shift_s:
            then = f"the centres of mass would be {self.better_com_mm:.1f} mm apart"
            return (question_shift(self.better_shift_s, "reference", then),)
        if self.com_mm > ELSEWHERE_MM:
            return (
                f"the centres of mass are {self.com_mm:.0f} mm apart: is the reference of this recording, in metres, "
                "and in the run's world?",
            )
        return ()

    def describe(self) -> str:
        """Return the numbers as a short plain table."""
        table: list[tuple[str, ...]] = [("flight", "RMS", "max", "bias", "no bias", "2 sd")]
        for name, e in self.quantities.items():
            numbers = (or_dash(value, ".2f") for value in (e.rms, e.largest, e.bias, e.rms_without_bias))
            table.append((f"  {name} [{e.unit}]", *numbers, or_dash(e.within_2sd, ".0%")))
        return "\n".join(
            [
                f"{self.n_matched} of {self.n_reference} reference times matched",
                *align_columns(table, (34, 9, 9, 9, 9, 7)),
                "no bias: the RMS without the mean; 2 sd: errors within two stated standard deviations (normal: 95%)",
                *(
                    f"{name}: {each.measured_rev:.3f} turns, reference {each.reference_rev:.3f}"
                    for name, each in self.turns.items()
                ),
                *self.questions,
            ]
        )


def read_flight_paths(path: Path) -> FlightPaths:
    """Read a flight: `time_s` and what it has of centre of mass, angular momentum and rotation, as in flight.csv.

    Raises ResultError in one line.
    """
    table = read_table(path, _EXPECTED)
    angles = {
        name: (f"{name}_{unit}", of_unit)
        for name in _ROTATION
        for unit, of_unit in reversed(_DEG_OF.items())
        if f"{name}_{unit}" in table.names
    }
    groups = [group for group in (_COM, _MOMENTUM) if set(group) & set(table.names)]
    missing = [name for name in ("time_s", *chain(*groups)) if name not in table.names]
    if missing or not (groups or angles):
        raise ResultError(f"{path} has no column {missing[0] if missing else _COM[0]}; expected {_EXPECTED}")
    time_s = table.times_s()
    if not (np.diff(time_s) > 0).all():
        raise ResultError(f"{path}: time_s must grow from line to line; sort by time")
    return FlightPaths(
        time_s=time_s,
        com=table.numbers(_COM) if _COM in groups else None,
        angular_momentum=table.numbers(_MOMENTUM) if _MOMENTUM in groups else None,
        rotation_deg={name: of_unit * table.numbers([column])[:, 0] for name, (column, of_unit) in angles.items()},
    )


def compare_flight(motion: Motion, model: BodyModel, reference: FlightPaths) -> FlightComparison:
    """Compare a motion's flight, as in flight.csv, with a reference, frame by frame, matched as in `compare_motion`.

    Rotations may differ by whole turns. Raises BodyError where a segment has no inertia, ResultError where no frame
    with a pose has a reference.
    """
    flight = state_flight(motion, model)[0]
    com, com_sd, momentum, momentum_sd = (
        flight[name].to_numpy() for name in ("com", "com_sd", "angular_momentum", "angular_momentum_sd")
    )
    rows, at, _ = match_times(motion.time_s, reference.time_s)
    has_pose = motion.has_pose[rows]
    rows, at = rows[has_pose], at[has_pose]
    if not len(rows):
        raise ResultError(
            f"no pose to compare: motion {span(motion.time_s)} with {int(motion.has_pose.sum())} poses, "
            f"reference {span(reference.time_s)}; give the flight of this recording"
        )
    quantities = {
        f"{name} {axis}": _errors(scale * (measured[rows, k] - true[at, k]), scale * sd[rows, k], unit)
        for name, scale, unit, measured, sd, true in (
            ("centre of mass", 1e3, "mm", com, com_sd, reference.com),
            ("angular momentum", 1.0, "kg m2/s", momentum, momentum_sd, reference.angular_momentum),
        )
        if true is not None
        for k, axis in enumerate("xyz")
    }
    turns = {}
    for name, true in reference.rotation_deg.items():
        measured = flight[name].to_numpy()[rows] * (1.0 if name == "tilt" else 360.0)
        error = measured - true[at]
        error = error - 360 * np.round(np.nanmedian(error) / 360) if np.isfinite(error).any() else error
        quantities[name] = _errors(error, np.full(len(error), np.nan), "deg")
        if name != "tilt":
            turns[name] = Turns(measured_rev=_revolutions(measured), reference_rev=_revolutions(true[at]))
    if not any(each.n for each in quantities.values()):
        raise ResultError("the reference has no number where the motion has a pose; give the flight of this recording")
    com_mm, shift_s, shifted_mm = _com_distances(motion.time_s, com, reference)
    return FlightComparison(
        n_frames=len(motion),
        n_reference=len(reference.time_s),
        n_matched=len(rows),
        quantities=quantities,
        turns=turns,
        better_shift_s=shift_s,
        better_com_mm=shifted_mm,
        com_mm=com_mm,
    )


def _com_distances(time_s: Array, com: Array, reference: FlightPaths) -> tuple[float, float, float]:
    """Return how far apart centres of mass (n, 3) are [mm, mean], the reference's best shift [s], how far with it."""
    true_com = reference.com
    if true_com is None:
        return np.nan, 0.0, np.nan

    def distance_at(shift_s: float) -> tuple[float, int]:
        rows, at, _ = match_times(time_s, reference.time_s + shift_s)
        apart = np.linalg.norm(com[rows] - true_com[at], axis=1)
        known = apart[np.isfinite(apart)]
        return (float(1e3 * known.mean()), len(known)) if len(known) else (np.nan, 0)

    com_mm, _ = distance_at(0.0)
    return com_mm, *best_time_shift(reference.time_s, com_mm, distance_at, CLEARLY_BETTER)


def _errors(error: Array, sd: Array, unit: str) -> FlightErrors:
    """Reduce errors (n,) with their stated sds (n,), NaN where not known."""
    sd, error = sd[np.isfinite(error)], error[np.isfinite(error)]
    if not len(error):
        return FlightErrors(
            unit=unit, n=0, rms=np.nan, largest=np.nan, bias=np.nan, rms_without_bias=np.nan, within_2sd=np.nan
        )
    return FlightErrors(
        unit=unit,
        n=len(error),
        rms=float(np.sqrt(np.mean(error**2))),
        largest=float(np.abs(error).max()),
        bias=float(error.mean()),
        rms_without_bias=float(error.std()),
        within_2sd=sd_calibration(error, sd).within_2sd,
    )


def _revolutions(angle_deg: Array) -> float:
    known = angle_deg[np.isfinite(angle_deg)]
    return float((known[-1] - known[0]) / 360) if len(known) else np.nan
