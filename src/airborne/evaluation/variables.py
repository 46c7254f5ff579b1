"""The variables that are compared: coordinates in mm, angles in degrees, each over time and of one individual."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel
from airborne.errors import ResultError
from airborne.evaluation.agreement import Series
from airborne.evaluation.compare import matched, span
from airborne.evaluation.joint_files import JointPaths, landmark_of
from airborne.evaluation.jump_errors import HEIGHTS
from airborne.evaluation.table import read_table
from airborne.geometry.rotations import angles_from_matrix, geodesic, is_near_singular, matrix_from_angles, wrapped
from airborne.motion import Motion, PlayersMotion, landmarks
from airborne.motion.angles import ANGLES
from airborne.motion.jumps.jump import Jump

Array = NDArray[np.floating]
Key = tuple[str, str]  # name of the variable, and the individual

BODY = "body"
_POOLED = {"mm": "all joints", "deg": "all turns"}
_EXPECTED = "a table of joint angles with the columns time_s, <joint>_x_rad, <joint>_y_rad, <joint>_z_rad, ..."


@dataclass(frozen=True, slots=True, eq=False)
class Variables:
    """Variables of one source at its times; NaN where unknown."""

    time_s: Array  # (n,)
    columns: dict[Key, Array]  # (n,) each, coordinates [mm] and angles [deg]
    angles: frozenset[str]  # names of those that are angles and repeat every 360 degrees

    def __or__(self, other: Variables) -> Variables:
        """Join the variables of one source at the same times."""
        return Variables(self.time_s, self.columns | other.columns, self.angles | other.angles)


def of_root(time_s: Array, position: Array, R: Array) -> Variables:
    """Take positions (n, 3) [m] and orientations (n, 3, 3) of a root; somersault and twist unknown where singular."""
    radians = angles_from_matrix(R)
    singular = is_near_singular(radians)
    columns = {(axis, BODY): 1e3 * position[:, k] for k, axis in enumerate("xyz")}
    for k, name in enumerate(ANGLES):
        columns[name, BODY] = np.rad2deg(np.where(singular & (name != "tilt"), np.nan, radians[:, k]))
    return Variables(time_s, columns, frozenset(ANGLES))


def of_points(time_s: Array, points: Array, names: Sequence[str], individual: str = BODY) -> Variables:
    """Take points (n, names, 3) [m] as variables such as `hip_left x`."""
    columns = {
        (f"{name} {axis}", individual): 1e3 * points[:, k, i]
        for k, name in enumerate(names)
        for i, axis in enumerate("xyz")
    }
    return Variables(time_s, columns, frozenset())


def of_joint_angles(time_s: Array, radians: Array, names: Sequence[str]) -> Variables:
    """Take joint angles (n, joints, 3) [rad], as successive turns with y within a right angle; see `joint_angles`.

    x and z are unknown where they cannot be told apart.
    """
    principal = angles_from_matrix(matrix_from_angles(radians))
    singular = is_near_singular(principal)
    columns = {}
    for k, name in enumerate(names):
        for i, axis in enumerate("xyz"):
            hidden = singular[:, k] & (axis != "y")
            columns[f"{name} turn {axis}", BODY] = np.rad2deg(np.where(hidden, np.nan, principal[:, k, i]))
    return Variables(time_s, columns, frozenset(name for name, _ in columns))


def of_motion(motion: Motion, model: BodyModel) -> Variables:
    """Take everything of one body: its root, its landmarks, and how its joints are turned."""
    points, _ = landmarks(motion, model)
    found = of_root(motion.time_s, motion.position, motion.R)
    found |= of_points(motion.time_s, points, [landmark.name for landmark in model.landmarks])
    return found | of_joint_angles(motion.time_s, motion.joint_angles, motion.joints) if motion.joints else found


def of_players(motion: PlayersMotion) -> Variables:
    """Take the joints of every player."""
    found = Variables(motion.time_s, {}, frozenset())
    for k, player in enumerate(motion.players):
        found |= of_points(motion.time_s, motion.points[:, k], motion.joints, player)
    return found


def of_joint_paths(paths: JointPaths, model: BodyModel) -> Variables:
    """Take paths of joints, by the names of a body's landmarks; others are left out."""
    known = {landmark.name for landmark in model.landmarks}
    column = {name if name in known else landmark_of(name): k for k, name in reversed(list(enumerate(paths.names)))}
    names = [name for name in column if name in known]
    return of_points(paths.time_s, paths.points[:, [column[name] for name in names]], [str(name) for name in names])


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
    return of_joint_angles(values[:, 0], values[:, 1:].reshape(len(values), len(joints), 3), joints)


def turned_alike(motion: Motion, R: Array, time_s: Array, symmetries: Sequence[Array]) -> Array:
    """Return a motion's orientations (n, 3, 3) turned by the one symmetry that suits another's `R` (m, 3, 3) best."""
    frames, rows, _ = matched(motion.time_s, time_s)
    alike = motion.R[:, None] @ np.stack(list(symmetries))
    angle = geodesic(alike[frames], R[rows][:, None])
    return alike[:, int(np.argmin(np.nansum(angle**2, axis=0)))]


def side_by_side(sources: Sequence[Variables], what: str) -> list[Series]:
    """Put the variables that all sources have beside one another, at the times of the first that all have.

    Angles lie within half a turn of the last source's. A variable of several players becomes one series. The
    coordinates of all joints together, and their turns, become three more each, with the joints as individuals. Raises
    ResultError where there is no time or no variable in common; `what` names the sources in it.
    """
    first, rows = sources[0], [np.arange(len(sources[0].time_s))]
    for source in sources[1:]:
        frames, theirs, _ = matched(first.time_s, source.time_s)
        kept = np.isin(rows[0], frames)
        rows = [each[kept] for each in rows] + [theirs[np.isin(frames, rows[0])]]
    keys = [key for key in first.columns if all(key in source.columns for source in sources[1:])]
    if not len(rows[0]) or not keys:
        missing, spans = "time" if keys else "variable", ", ".join(span(source.time_s) for source in sources)
        raise ResultError(f"{what} have no {missing} in common ({spans}); give those of one recording")
    found: dict[str, list[Series]] = {}
    for name, individual in keys:
        columns = [source.columns[name, individual][at] for source, at in zip(sources, rows, strict=True)]
        if name in first.angles:
            last = columns[-1]
            columns = [last + np.rad2deg(wrapped(np.deg2rad(column - last))) for column in columns]
        unit = "deg" if name in first.angles else "mm"
        values = np.stack(columns, axis=1)
        found.setdefault(name, []).append(Series(name, unit, values, np.full(len(values), individual)))
        joint, _, axis = name.rpartition(" ")
        if joint:
            whose = joint if individual == BODY else f"{individual}, {joint}"
            pooled = Series(f"{_POOLED[unit]} {axis}", unit, values, np.full(len(values), whose))
            found.setdefault(pooled.name, []).append(pooled)
    return [_together(parts) for parts in found.values()]


def _together(parts: Sequence[Series]) -> Series:
    return Series(
        parts[0].name,
        parts[0].unit,
        np.concatenate([part.values for part in parts]),
        np.concatenate([part.individual for part in parts]),
    )


def of_jumps(pairs: Sequence[tuple[Jump, Jump | None]]) -> list[Series]:
    """Put measured and true jumps beside one another: heights [mm], times [ms]; each jump is an individual."""
    found = []
    for name in (*HEIGHTS, "takeoff_s", "landing_s", "flight_s"):
        values = [
            [math.nan if got is None else getattr(got, name).value, getattr(true, name).value] for true, got in pairs
        ]
        stem, _, unit = name.rpartition("_")
        who = np.array([f"{true.player} jump {true.number}" for true, _ in pairs], np.str_)
        found.append(Series(f"jump {stem}", f"m{unit}", 1e3 * np.array(values).reshape(-1, 2), who))
    return found


def headline(series: Sequence[Series]) -> list[Series]:
    """Return the variables that stand first: the root's and the pooled ones, and jumps."""
    starts = (*"xyz", *ANGLES)
    return [one for one in series if one.name in starts or one.name.startswith((*_POOLED.values(), "jump "))]
