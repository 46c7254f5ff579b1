"""The tables that are made of a body's motion."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from airborne.body import BodyModel
from airborne.motion import (
    Motion,
    has_inertias,
    measure_flight,
    write_angles,
    write_flight,
    write_joint_angles,
    write_joints,
    write_motion_parquet,
)
from airborne.motion.joints import count_statuses
from airborne.motion.run_folder import ANGLES, FLIGHT, JOINT_ANGLES, JOINTS, tables_of

if TYPE_CHECKING:
    import xarray as xr


class Measured(NamedTuple):
    """What a summary takes from the tables."""

    joint_statuses: dict[str, dict[str, int]] | None  # of `count_statuses`; None of a body without joints
    flight: xr.Dataset | None  # of `measure_flight`; None without joints or masses


def write_tables(folder: Path, motion: Motion, model: BodyModel) -> Measured:
    """Write what is made of a motion: the same as parquet, angles, joints, the flight."""
    tables = tables_of(folder)
    status = write_joints(folder / JOINTS, motion, model)
    write_motion_parquet(tables / "motion.parquet", motion)
    write_angles(folder / ANGLES, motion)
    if not motion.joints:
        return Measured(None, None)
    write_joint_angles(folder / JOINT_ANGLES, motion, model)
    flight = measure_flight(motion, model) if has_inertias(model) else None
    if flight is not None:
        write_flight(folder / FLIGHT, motion, flight)
    return Measured(count_statuses(status, model), flight)
