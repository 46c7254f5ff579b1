"""Calibration: cameras estimated from control points or from any sources, alone or together.

In come control points, or a file that names videos, images, tables of points and detections; out go a `Calibration` or
a `RigCalibration` with its uncertainty, and their report. Knows no body and no trial.
"""

from airborne.calibration.from_points import Calibration, CameraFit, calibrate
from airborne.calibration.from_sources import RigCalibration, calibrate_from
from airborne.calibration.initial.resection import Resection, resect_cameras
from airborne.calibration.sources.control_points import ControlPoints, read_control_points
from airborne.calibration.sources.files import Sources, read_sources, sources_from

__all__ = [
    "Calibration",
    "CameraFit",
    "ControlPoints",
    "Resection",
    "RigCalibration",
    "Sources",
    "calibrate",
    "calibrate_from",
    "read_control_points",
    "read_sources",
    "resect_cameras",
    "sources_from",
]
