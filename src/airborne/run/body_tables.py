"""The tables that are made of a body's motion."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

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
from airborne.motion.run_folder import ANGLES, FLIGHT, JOINT_ANGLES, JOINTS, tables_of

if TYPE_CHECKING:
    import xarray as xr


def write_tables(folder: Path, motion: Motion, model: BodyModel) -> xr.Dataset | None:
    """Write what is made of a motion: the same as parquet, angles, joints, the flight; return the flight's table.

    A flight is measured of a body with joints whose masses are known.
    """
    tables = tables_of(folder)
    write_joints(folder / JOINTS, motion, model)
    write_motion_parquet(tables / "motion.parquet", motion)
    write_angles(folder / ANGLES, motion)
    if motion.joints:
        write_joint_angles(folder / JOINT_ANGLES, motion, model)
    if not (motion.joints and has_inertias(model)):
        return None
    flight = measure_flight(motion, model)
    write_flight(folder / FLIGHT, motion, flight)
    return flight
