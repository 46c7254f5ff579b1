"""[[camera]]: one camera's video."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from airborne.io.names import CheckedPath, Name
from airborne.trial.table import Pixel, SettingsTable


class CameraTable(SettingsTable):
    """One camera's video, and how its pixels lie in the calibration's image."""

    name: Name
    video: CheckedPath  # live also rtsp://...
    fields: Literal["progressive", "top-first", "bottom-first", "auto"] = "progressive"
    offset_s: float = 0.0  # added to this camera's times
    offset_sd_s: float = Field(0.0, ge=0)  # its standard deviation
    drift_ppm: float = Field(0.0, gt=-1e4, lt=1e4)  # by how much its clock runs slow, in parts per million
    exposure_s: float = Field(0.0, ge=0, le=0.1)  # of each image, about its time; 0: short, or unknown
    calibrated_as: str | None = None  # the camera's name in the calibration file, where it differs
    saved_scale: float = Field(1.0, gt=0)  # calibration px = saved_scale * video px + saved_offset_px
    saved_offset_px: Pixel = [0.0, 0.0]
