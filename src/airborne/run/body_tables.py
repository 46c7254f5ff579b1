"""The tables that are made of a body's motion."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from airborne.body import BodyModel
from airborne.motion import (
    Motion,
    has_inertias,
    state_flight,
    write_angles,
    write_flight,
    write_joint_angles,
    write_joints,
    write_motion_parquet,
)
from airborne.motion.joints import count_statuses
from airborne.motion.run_folder import ANGLES, FLIGHT, JOINT_ANGLES, JOINTS, tables_of
from airborne.tracking.self_check.free_flight import WrongFall

if TYPE_CHECKING:
    import xarray as xr


class Measured(NamedTuple):
    """What a summary takes from the tables."""

    joint_statuses: dict[str, dict[str, int]] | None  # of `count_statuses`; None of a body without joints
    flight: xr.Dataset | None  # of `state_flight`; None without joints or masses
    wrong_fall: WrongFall | None = None  # what the flight says against the calibration or the frame rate


def write_tables(folder: Path, motion: Motion, model: BodyModel) -> Measured:
    """Write what is made of a motion: the same as parquet, angles, joints, the flight."""
    tables = tables_of(folder)
    status = write_joints(folder / JOINTS, motion, model)
    write_motion_parquet(tables / "motion.parquet", motion)
    write_angles(folder / ANGLES, motion)
    if not motion.joints:
        return Measured(None, None)
    write_joint_angles(folder / JOINT_ANGLES, motion, model)
    statuses = count_statuses(status, model)
    if not has_inertias(model):
        return Measured(statuses, None)
    flight, wrong = state_flight(motion, model)
    write_flight(folder / FLIGHT, motion, flight)
    return Measured(statuses, flight, wrong)


def missing_masses(model: BodyModel) -> list[str]:
    """Return, as a sentence, that a body with joints lacks masses, and what is not measured for that."""
    missing = [segment.name for segment in model.segments if segment.inertia is None]
    if not model.has_joints or not missing:
        return []
    which = "its segments" if len(missing) == len(model.segments) else ", ".join(missing[:3])
    return [
        f"the body has no mass of {which}, so that there is no {Path(FLIGHT).name}: no centre of mass and no angular "
        "momentum; give each segment a [segment.inertia], or fit the preset human18 by `airborne fit-body`"
    ]
