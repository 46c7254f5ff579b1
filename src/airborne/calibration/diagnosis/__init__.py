"""What is wrong with a calibration, in plain words: pure functions `check_*` that return `Finding`s.

In come images, pixels, rigs, time stamps; out come sentences, each with the number that shows it and what to do; none
for a good recording. Errors of control points, and findings about them, are in `control_points`.
"""

from airborne.calibration.diagnosis.control_points import (
    check_points,
    check_solutions,
    decompose_cameras,
    find_outliers,
    flatness,
    is_turned,
)
from airborne.cameras.finding import Finding

__all__ = ["Finding", "check_points", "check_solutions", "decompose_cameras", "find_outliers", "flatness", "is_turned"]
