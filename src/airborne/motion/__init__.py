"""Motion: in come `Estimate`s, out come `Motion` and its tables.

Writes and reads motion.csv as a run goes; at its end motion.parquet, angles.csv and joints.csv.
Knows no camera, no image and no truth.
"""

from airborne.motion.files import MotionWriter, read_estimates, read_motion
from airborne.motion.motion import Motion, dataset
from airborne.motion.tables import angles, write_angles, write_joints, write_motion_parquet

__all__ = [
    "Motion",
    "MotionWriter",
    "angles",
    "dataset",
    "read_estimates",
    "read_motion",
    "write_angles",
    "write_joints",
    "write_motion_parquet",
]
