"""Cameras and how they are found.

In come control points, calibration files or detections; out go `Camera` and `Rig`, and a `Calibration` that says how
far to trust them. Knows no video, no body and no trial.
"""

from airborne.cameras.calibration import Calibration, CameraFit, calibrate
from airborne.cameras.camera import Camera, Rig, aimed
from airborne.cameras.control_points import ControlPoints, read_control_points
from airborne.cameras.detections import Detections, read_detections
from airborne.cameras.files import read_rig, write_pose2sim, write_rig
from airborne.cameras.formats.given import PixelCount
from airborne.cameras.report import describe, to_dict
from airborne.cameras.resection import Mending, mend

__all__ = [
    "Calibration",
    "Camera",
    "CameraFit",
    "ControlPoints",
    "Detections",
    "Mending",
    "PixelCount",
    "Rig",
    "aimed",
    "calibrate",
    "describe",
    "mend",
    "read_control_points",
    "read_detections",
    "read_rig",
    "to_dict",
    "write_pose2sim",
    "write_rig",
]
