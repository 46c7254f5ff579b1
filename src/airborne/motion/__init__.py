"""Motion: `Estimate`s come in; `Motion` and its tables go out.

Writes and reads motion.csv during a run; at its end writes motion.parquet, angles.csv and joints.csv, and for bodies
with joints and masses joint_angles.csv and flight.csv. For several players it writes and reads joints.csv during the
run and measures their jumps: jumps.csv.
Independent of cameras, images and truth.
"""

from airborne.motion.angles import root_angles
from airborne.motion.files import MotionWriter, drop_rows, read_estimates, read_motion, revise_motion, sort_rows
from airborne.motion.flight.momentum_table import (
    FlightSummary,
    flight_summary,
    has_inertias,
    measure_flight,
    state_flight,
)
from airborne.motion.joints import JointStatus, joint_angles, joint_statuses, known_landmarks, landmarks
from airborne.motion.jumps.heights import measure_jumps
from airborne.motion.jumps.jump import Jump
from airborne.motion.jumps.table import write_jumps
from airborne.motion.motion import Motion
from airborne.motion.players import PlayersMotion, PlayersWriter, read_players, write_players_parquet
from airborne.motion.tables import write_angles, write_flight, write_joint_angles, write_joints, write_motion_parquet

__all__ = [
    "FlightSummary",
    "JointStatus",
    "Jump",
    "Motion",
    "MotionWriter",
    "PlayersMotion",
    "PlayersWriter",
    "drop_rows",
    "flight_summary",
    "has_inertias",
    "joint_angles",
    "joint_statuses",
    "known_landmarks",
    "landmarks",
    "measure_flight",
    "measure_jumps",
    "read_estimates",
    "read_motion",
    "read_players",
    "revise_motion",
    "root_angles",
    "sort_rows",
    "state_flight",
    "write_angles",
    "write_flight",
    "write_joint_angles",
    "write_joints",
    "write_jumps",
    "write_motion_parquet",
    "write_players_parquet",
]
