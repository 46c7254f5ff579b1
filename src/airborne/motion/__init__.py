"""Motion: in come `Estimate`s, out come `Motion` and its tables.

Writes and reads motion.csv as a run goes; at its end motion.parquet, angles.csv and joints.csv, and of bodies with
joints and masses joint_angles.csv and flight.csv. Knows no camera, no image and no truth.
"""

from airborne.motion.angles import angles
from airborne.motion.files import MotionWriter, read_estimates, read_motion
from airborne.motion.flight import FlightSummary, flight, flight_summary, has_inertias
from airborne.motion.joints import joint_angles, landmarks
from airborne.motion.motion import Motion, dataset
from airborne.motion.tables import (
    write_angles,
    write_flight,
    write_joint_angles,
    write_joints,
    write_motion_parquet,
)

__all__ = [
    "FlightSummary",
    "Motion",
    "MotionWriter",
    "angles",
    "dataset",
    "flight",
    "flight_summary",
    "has_inertias",
    "joint_angles",
    "landmarks",
    "read_estimates",
    "read_motion",
    "write_angles",
    "write_flight",
    "write_joint_angles",
    "write_joints",
    "write_motion_parquet",
]
