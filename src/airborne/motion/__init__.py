"""Motion: in come `Estimate`s, out come `Motion` and its tables.

Writes and reads motion.csv as a run goes; at its end motion.parquet, angles.csv and joints.csv, and of bodies with
joints and masses joint_angles.csv and flight.csv. Of several players it writes and reads joints.csv as a run goes, and
measures their jumps: jumps.csv.
Knows no camera, no image and no truth.
"""

from airborne.motion.angles import angles
from airborne.motion.files import MotionWriter, read_estimates, read_motion
from airborne.motion.flight.momentum_table import FlightSummary, flight, flight_summary, has_inertias
from airborne.motion.joints import joint_angles, landmarks
from airborne.motion.jumps.heights import jumps
from airborne.motion.jumps.jump import Jump
from airborne.motion.jumps.table import write_jumps
from airborne.motion.motion import Motion, dataset
from airborne.motion.players import PlayersMotion, PlayersWriter, read_players, write_players_parquet
from airborne.motion.tables import write_angles, write_flight, write_joint_angles, write_joints, write_motion_parquet

__all__ = [
    "FlightSummary",
    "Jump",
    "Motion",
    "MotionWriter",
    "PlayersMotion",
    "PlayersWriter",
    "angles",
    "dataset",
    "flight",
    "flight_summary",
    "has_inertias",
    "joint_angles",
    "jumps",
    "landmarks",
    "read_estimates",
    "read_motion",
    "read_players",
    "write_angles",
    "write_flight",
    "write_joint_angles",
    "write_joints",
    "write_jumps",
    "write_motion_parquet",
    "write_players_parquet",
]
