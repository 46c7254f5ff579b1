"""[calibration]: where the cameras come from."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from airborne.io.names import CheckedPath
from airborne.trial.table import SettingsTable


class CalibrationTable(SettingsTable):
    """Where the cameras come from: a calibration file, or control points."""

    file: CheckedPath | None = None
    control_points: CheckedPath | None = None
    method: Literal["lm", "annealing"] = "lm"
    mend: list[str] = []  # cameras to re-resect from the detections of [start]

    @model_validator(mode="after")
    def _check_source(self) -> CalibrationTable:
        if (self.file is None) == (self.control_points is None):
            raise ValueError('give file = "..." or control_points = "...", one of them')
        return self
