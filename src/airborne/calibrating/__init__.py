"""Calibration from any sources, alone or together: a file that names them -> cameras, their errors, pictures.

In come videos, pictures, tables of points and detections; out go a `Calibrated` rig and its report. It knows no body
and no trial.
"""

from airborne.calibrating.joint import Calibrated, calibrate_from
from airborne.calibrating.pictures import write_pictures
from airborne.calibrating.report import describe, to_dict
from airborne.calibrating.tables import Sources, read_sources, sources_from

__all__ = [
    "Calibrated",
    "Sources",
    "calibrate_from",
    "describe",
    "read_sources",
    "sources_from",
    "to_dict",
    "write_pictures",
]
