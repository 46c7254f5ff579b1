"""The tables that are made of a body's motion."""

from __future__ import annotations

from pathlib import Path

from airborne.body import BodyModel
from airborne.motion import (
    Motion,
    has_inertias,
    write_angles,
    write_flight,
    write_joint_angles,
    write_joints,
    write_motion_parquet,
)
from airborne.motion.run_folder import ANGLES, FLIGHT, JOINT_ANGLES, JOINTS, tables_of


def write_tables(folder: Path, motion: Motion, model: BodyModel) -> None:
    """Write what is made of a motion: the same as parquet, angles, joints, the flight."""
    tables = tables_of(folder)
    write_joints(folder / JOINTS, motion, model)
    write_motion_parquet(tables / "motion.parquet", motion)
    write_angles(folder / ANGLES, motion)
    if motion.joints:
        write_joint_angles(folder / JOINT_ANGLES, motion, model)
    if has_flight(motion, model):
        write_flight(folder / FLIGHT, motion, model)


def has_flight(motion: Motion, model: BodyModel) -> bool:
    """Say whether a flight is measured: of a body with joints whose masses are known."""
    return bool(motion.joints) and has_inertias(model)
