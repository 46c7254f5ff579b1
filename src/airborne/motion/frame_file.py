"""frame_sd.bin: how far errors change from frame to frame, beside the motion.csv of a run that was fitted as a whole.

Rows of little-endian 64-bit floats, one per row of motion.csv: of the landmarks [m], then of each joint's x-y-z angles,
then of each joint's angles in ISB's sequences [rad].
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from airborne.errors import ResultError
from airborne.motion.covariance_file import FLOAT, write_rows
from airborne.motion.motion import FrameDeviations

FRAME_SD_FILE = "frame_sd.bin"


def write_frame_deviations(motion_file: Path, deviations: FrameDeviations | None) -> None:
    """Write deviations beside motion.csv, at once; None removes them."""
    path = motion_file.with_name(FRAME_SD_FILE)
    if deviations is None:
        path.unlink(missing_ok=True)
        return
    write_rows(path, np.concatenate([each.reshape(len(each), -1) for each in deviations], axis=1))


def read_frame_deviations(motion_file: Path, n: int, n_joints: int) -> FrameDeviations | None:
    """Read the deviations of n frames; None without a file, or where that is not of so many.

    Raises ResultError where it cannot be read.
    """
    path = motion_file.with_name(FRAME_SD_FILE)
    try:
        data = path.read_bytes() if path.is_file() else b""
    except OSError as error:
        raise ResultError(f"{path} cannot be read ({error.strerror}); repair it, or remove it to go without") from None
    if not n or not data or len(data) % (n * FLOAT.itemsize):
        return None
    rows = np.frombuffer(data, FLOAT).reshape(n, -1)
    n_landmarks = rows.shape[1] - 6 * n_joints
    if n_landmarks < 0:
        return None
    angles = rows[:, n_landmarks:].reshape(n, 2, n_joints, 3)
    return FrameDeviations(rows[:, :n_landmarks], angles[:, 0], angles[:, 1])
