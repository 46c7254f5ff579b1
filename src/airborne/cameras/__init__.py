"""Cameras: what a camera is, and its files.

In come calibration files of any known format, detections and clicks; out go `Camera`, `Rig` and image points.
Knows no video, no body and no trial. Cameras are estimated in `calibration`.
"""

from airborne.cameras.camera import Camera, Rig, camera_looking_at
from airborne.cameras.detections import Detections, read_detections
from airborne.cameras.files import read_rig, write_pose2sim, write_rig
from airborne.cameras.formats.options import PixelConvention

__all__ = [
    "Camera",
    "Detections",
    "PixelConvention",
    "Rig",
    "camera_looking_at",
    "read_detections",
    "read_rig",
    "write_pose2sim",
    "write_rig",
]
