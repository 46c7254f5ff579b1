"""The variables to compare: coordinates in mm, angles in degrees, each over time for one individual."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from airborne.body import BodyModel
from airborne.errors import ResultError
from airborne.evaluation.agreement import Series
from airborne.evaluation.joint_files import JointPaths, landmark_of
from airborne.evaluation.jump_errors import HEIGHTS
from airborne.evaluation.table import read_table
from airborne.evaluation.times import match_times, span
from airborne.geometry.rotations import (
    angles_from_matrix,
    geodesic,
    is_near_singular,
    matrix_from_angles,
    unwrap,
    wrap,
)
from airborne.motion import Motion, PlayersMotion, known_landmarks
from airborne.motion.angles import ROOT_ANGLES
from airborne.motion.jumps.jump import Jump
from airborne.types import Array

_Key = tuple[str, str]  # names of the variable and the individual

BODY = "body"
_POOLED = {"mm": "all joints", "deg": "all turns"}
_JUMP = "jump "  # begins the names of what is measured of jumps
_EXPECTED = "a table of joint angles with the columns time_s, <joint>_x_rad, <joint>_y_rad, <joint>_z_rad, ..."


@dataclass(frozen=True, slots=True, eq=False)
class Variables:
    """Variables of one source at its times; NaN where unknown."""

    time_s: Array  # (n,)
    columns: dict[_Key, Array]  # (n,) each, coordinates [mm] and angles [deg]
    angles: frozenset[str]  # names of the angles, periodic in 360 degrees

    def __or__(self, other: Variables) -> Variables:
        """Merge the variables of one source at the same times."""
        return Variables(self.time_s, self.columns | other.columns, self.angles | other.angles)


def root_variables(time_s: Array, position: Array, R: Array) -> Variables:
    """Return a root's position (n, 3) [m] and orientation (n, 3, 3) as variables, its angles unwrapped over time.

    Ambiguous angles are unknown.
    """
    radians = unwrap(angles_from_matrix(R), time_s)
    singular = is_near_singular(radians)
    columns = {(axis, BODY): 1e3 * position[:, k] for k, axis in enumerate("xyz")}
    for k, name in enumerate(ROOT_ANGLES):
        columns[name, BODY] = np.rad2deg(np.where(singular & (name != "tilt"), np.nan, radians[:, k]))
    return Variables(time_s, columns, frozenset(ROOT_ANGLES))


def point_variables(time_s: Array, points: Array, names: Sequence[str], individual: str = BODY) -> Variables:
    """Return points (n, names, 3) [m] as variables such as `hip_left x`."""
    columns = {
        (f"{name} {axis}", individual): 1e3 * points[:, k, i]
        for k, name in enumerate(names)
        for i, axis in enumerate("xyz")
    }
    return Variables(time_s, columns, frozenset())


def joint_angle_variables(time_s: Array, radians: Array, names: Sequence[str]) -> Variables:
    """Return joint angles (n, joints, 3) [rad] as variables, y within +-90 degrees; see `joint_angles`.

    x and z are unwrapped over time, and unknown where they are ambiguous.
    """
    principal = angles_from_matrix(matrix_from_angles(radians))
    singular = is_near_singular(principal)
    columns = {}
    for k, name in enumerate(names):
        continuous = unwrap(principal[:, k], time_s)
        for i, axis in enumerate("xyz"):
            is_ambiguous = singular[:, k] & (axis != "y")
            columns[f"{name} turn {axis}", BODY] = np.rad2deg(np.where(is_ambiguous, np.nan, continuous[:, i]))
    return Variables(time_s, columns, frozenset(name for name, _ in columns))


def motion_variables(motion: Motion, model: BodyModel) -> Variables:
    """Return all variables of one body: its root, joint angles, and landmarks, NaN where no image shows them."""
    points, *_ = known_landmarks(motion, model)
    variables = root_variables(motion.time_s, motion.position, motion.R)
    variables |= point_variables(motion.time_s, points, [landmark.name for landmark in model.landmarks])
    if motion.joints:
        variables |= joint_angle_variables(motion.time_s, motion.joint_angles, motion.joints)
    return variables


def players_variables(motion: PlayersMotion) -> Variables:
    """Return the joints of every player as variables."""
    variables = Variables(motion.time_s, {}, frozenset())
    for k, player in enumerate(motion.players):
        variables |= point_variables(motion.time_s, motion.points[:, k], motion.joints, player)
    return variables


def joint_path_variables(paths: JointPaths, model: BodyModel) -> Variables:
    """Return paths of joints as variables named by a body's landmarks; others are left out."""
    names = {landmark.name for landmark in model.landmarks}
    column = {name if name in names else landmark_of(name): k for k, name in reversed(list(enumerate(paths.names)))}
    matched = [name for name in column if name in names]
    return point_variables(
        paths.time_s, paths.points[:, [column[name] for name in matched]], [str(name) for name in matched]
    )


def unknown_markers(paths: JointPaths, model: BodyModel) -> list[str]:
    """Return the names of those paths for which a body has no landmark."""
    names = {landmark.name for landmark in model.landmarks}
    return [name for name in paths.names if not {name, landmark_of(name)} & names]


def read_joint_angles(path: Path) -> Variables:
    """Read joint angles: `time_s` and `<joint>_x_rad`, `_y_rad`, `_z_rad`. Raises ResultError in one line."""
    table = read_table(path, _EXPECTED)
    joints = [name.removesuffix("_x_rad") for name in table.names if name.endswith("_x_rad")]
    wanted = ["time_s", *(f"{joint}_{axis}_rad" for joint in joints for axis in "xyz")]
    missing = [name for name in wanted if name not in table.names]
    if missing or not joints:
        raise ResultError(f"{path} has no column {missing[0] if missing else '<joint>_x_rad'}; expected {_EXPECTED}")
    values = table.numbers(wanted)
    if not (np.diff(values[:, 0]) > 0).all():
        raise ResultError(f"{path}: time_s must grow from line to line; sort by time")
    return joint_angle_variables(values[:, 0], values[:, 1:].reshape(len(values), len(joints), 3), joints)


def align_symmetry(motion: Motion, R: Array, time_s: Array, symmetries: Sequence[Array]) -> Array:
    """Return a motion's orientations (n, 3, 3) under the one symmetry that best matches a reference R (m, 3, 3)."""
    frames, rows, _ = match_times(motion.time_s, time_s)
    equivalent_R = motion.R[:, None] @ np.stack(list(symmetries))
    angle = geodesic(equivalent_R[frames], R[rows][:, None])
    return equivalent_R[:, int(np.argmin(np.nansum(angle**2, axis=0)))]


def common_series(sources: Sequence[Variables], names_text: str) -> list[Series]:
    """Return the variables that all sources share as series, at the times of the first that all share.

    Angles of the others are brought by whole revolutions to within 180 degrees of the first's. A variable of several
    players becomes one series.
    The coordinates of all joints, and their angles, are also pooled: three more series each, with joints as
    individuals. Raises ResultError without a common time or variable; `names_text` names the sources in it.
    """
    first, rows = sources[0], [np.arange(len(sources[0].time_s))]
    for source in sources[1:]:
        frames, theirs, _ = match_times(first.time_s, source.time_s)
        is_common = np.isin(rows[0], frames)
        rows = [each[is_common] for each in rows] + [theirs[np.isin(frames, rows[0])]]
    keys = [key for key in first.columns if all(key in source.columns for source in sources[1:])]
    if not len(rows[0]) or not keys:
        missing, spans = "time" if keys else "variable", ", ".join(span(source.time_s) for source in sources)
        raise ResultError(f"{names_text} have no {missing} in common ({spans}); give those of one recording")
    series: dict[str, list[Series]] = {}
    for name, individual in keys:
        columns = [source.columns[name, individual][at] for source, at in zip(sources, rows, strict=True)]
        if name in first.angles:
            own, *others = columns
            columns = [own, *(own + np.rad2deg(wrap(np.deg2rad(column - own))) for column in others)]
        unit = "deg" if name in first.angles else "mm"
        values = np.stack(columns, axis=1)
        series.setdefault(name, []).append(Series(name, unit, values, np.full(len(values), individual)))
        joint, _, axis = name.rpartition(" ")
        if joint:
            owner = joint if individual == BODY else f"{individual}, {joint}"
            pooled = Series(f"{_POOLED[unit]} {axis}", unit, values, np.full(len(values), owner))
            series.setdefault(pooled.name, []).append(pooled)
    return [_concatenate(parts) for parts in series.values()]


def _concatenate(parts: Sequence[Series]) -> Series:
    return Series(
        parts[0].name,
        parts[0].unit,
        np.concatenate([part.values for part in parts]),
        np.concatenate([part.individual for part in parts]),
    )


def jump_series(pairs: Sequence[tuple[Jump, Jump | None]]) -> list[Series]:
    """Return measured and true jumps as series: heights [mm], times [ms]; each jump is an individual."""
    series = []
    for name in (*HEIGHTS, "takeoff_s", "landing_s", "flight_s"):
        values = [
            [math.nan if jump is None else getattr(jump, name).value, getattr(true, name).value] for true, jump in pairs
        ]
        stem, _, unit = name.rpartition("_")
        who = np.array([f"{true.player} jump {true.number}" for true, _ in pairs], np.str_)
        series.append(Series(f"{_JUMP}{stem}", f"m{unit}", 1e3 * np.array(values).reshape(-1, 2), who))
    return series


def individuals_of(name: str) -> str:
    """Say what the individuals of a series of this name are."""
    return "jumps" if name.startswith(_JUMP) else "joints" if name.startswith(tuple(_POOLED.values())) else "players"


def headline_series(series: Sequence[Series]) -> list[Series]:
    """Return the headline variables: the root's, the pooled ones, and jumps."""
    starts = (*"xyz", *ROOT_ANGLES)
    return [one for one in series if one.name in starts or one.name.startswith((*_POOLED.values(), _JUMP))]
