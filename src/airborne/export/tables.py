"""Wide tables for spreadsheets and data frames: one row per frame, units in the column names, standard deviations."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel
from airborne.io import parquet
from airborne.motion import Motion, PlayersMotion, joint_angles, joint_statuses, root_angles
from airborne.motion.angles import ROOT_ANGLES
from airborne.motion.tables import cell

_CONVENTIONS = {"world": "metres, z up", "angles": "successive turns about moving x, y, z, running on over time"}


class Column(NamedTuple):
    """One column: its values (rows,) and their unit."""

    values: NDArray
    unit: str = "1"


Columns = Mapping[str, Column]


def body_columns(
    motion: Motion, model: BodyModel, points: NDArray, sd: NDArray, *, com: tuple[NDArray, NDArray] | None
) -> Columns:
    """Return the columns of one body: the root's angles, its landmarks, its joints' angles, its centre of mass.

    Each landmark has a status of its own, of `joint_statuses`. points (n, landmarks, 3) and sd (n, landmarks) [m] as
    `landmarks` gives them; com, both (n, 3) [m], position and standard deviations, None where masses are unknown.
    Raises ResultError for another body's motion.
    """
    columns = {"frame": Column(motion.index), "time_s": Column(motion.time_s, "s"), "status": Column(motion.status)}
    root = root_angles(motion)
    for k, name in enumerate(ROOT_ANGLES):
        columns[f"{name}_deg"] = Column(root.deg[:, k], "deg")
        columns[f"{name}_deg_sd"] = Column(root.sd_deg[:, k], "deg")
    names, of_joints = [landmark.name for landmark in model.landmarks], joint_statuses(motion, model, sd)
    columns |= _point_columns(names, points, sd, of_joints)
    if motion.joints:
        angles_of = joint_angles(motion, model)
        for j, joint in enumerate(motion.joints):
            for k, axis in enumerate("xyz"):
                columns[f"{joint}_{axis}_deg"] = Column(angles_of["angle"].to_numpy()[:, j, k], "deg")
                columns[f"{joint}_{axis}_deg_sd"] = Column(angles_of["angle_sd"].to_numpy()[:, j, k], "deg")
    if com is not None:
        for k, axis in enumerate("xyz"):
            columns[f"com_{axis}_m"] = Column(com[0][:, k], "m")
            columns[f"com_{axis}_m_sd"] = Column(com[1][:, k], "m")
    return columns


def players_columns(motion: PlayersMotion) -> Columns:
    """Return the columns of players: one row per frame and player, all joints side by side."""
    n, k = len(motion), len(motion.players)
    columns = {
        "player": Column(np.tile(motion.players, n)),
        "frame": Column(np.repeat(motion.index, k)),
        "time_s": Column(np.repeat(motion.time_s, k), "s"),
        "status": Column(motion.status.ravel()),
    }
    points, sd = motion.points.reshape(n * k, -1, 3), motion.sd.reshape(n * k, -1)
    return columns | _point_columns(motion.joints, points, sd, motion.joint_status.reshape(n * k, -1))


def write_csv(path: Path, columns: Columns) -> None:
    """Write columns as CSV; floats read back to the last bit, NaN is an empty cell."""
    rows = zip(*(map(cell, column.values.tolist()) for column in columns.values()), strict=True)
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([list(columns), *rows])


def write_wide_parquet(path: Path, columns: Columns) -> None:
    """Write columns as Parquet, units in the metadata; NaN is null. Needs *pyarrow*."""
    values = {name: column.values for name, column in columns.items()}
    units = {name: column.unit for name, column in columns.items()}
    parquet.write_parquet(path, values, units, _CONVENTIONS)


def _point_columns(names: Sequence[str], points: NDArray, sd: NDArray, status: NDArray) -> dict[str, Column]:
    columns = {}
    for j, name in enumerate(names):
        columns |= {f"{name}_{axis}_m": Column(points[:, j, k], "m") for k, axis in enumerate("xyz")}
        columns |= {f"{name}_m_sd": Column(sd[:, j], "m"), f"{name}_status": Column(status[:, j])}
    return columns
