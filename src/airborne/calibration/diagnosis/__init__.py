"""What is wrong with a calibration, in plain words: pure functions that look at evidence and return `Finding`s.

In come pictures, pixels, rigs, clocks; out come sentences, each with the number that shows it and what to do. A sound
recording gives none. Errors and warnings about control points stand in `points`.
"""

from airborne.calibration.diagnosis.control_points import (
    check_points,
    decompose_cameras,
    find_outliers,
    flatness,
    warnings_about,
)
from airborne.cameras.finding import Finding

__all__ = ["Finding", "check_points", "decompose_cameras", "find_outliers", "flatness", "warnings_about"]
