"""What a calibration file is worth that says how good it is: `python benchmarks/accuracy/calibration_file.py`.

Synthetic throws (seeds 401 to 406), calibrated from control points with clicks like a person's, tracked with the file
that `airborne calibrate` leaves, and with the same file without its covariances. Of each: the median standard deviation
of position and rotation along an axis, and the errors within two of them. Four minutes.
"""

from __future__ import annotations

import sys
import tempfile
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

from airborne.io.environment import set_up_libraries

set_up_libraries()  # as the command line does: with other threads, last digits differ

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import append
from self_check import errors_in_sds

from airborne.calibration.from_points import calibrate
from airborne.calibration.sources.control_points import read_control_points
from airborne.cameras import Rig, write_rig
from airborne.motion import Motion
from airborne.run.track import track_trial
from airborne.synthetic import write_thrown_cross
from airborne.trial.calibration import CalibrationTable
from airborne.trial.file import read_trial

SEEDS = range(401, 407)
SIZE = (768, 576)
FILES = {"file of calibrate": "calib.toml", "file that says nothing": "silent.toml"}


def follow(seed: int) -> dict[str, tuple[Motion, dict[str, np.ndarray]]]:
    """Return by file the motion of a throw, and its errors in standard deviations."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "throw"
        write_thrown_cross(folder, seed=seed)
        points = read_control_points(folder / "control_points.csv")
        rig = calibrate(points, dict.fromkeys(points.cameras, SIZE)).rig
        write_rig(folder / "calib.toml", rig)
        silent = (replace(camera, covariance=None, world_sd=None) for camera in rig)
        write_rig(folder / "silent.toml", Rig(tuple(silent)))
        trial, found = read_trial(folder / "trial.toml"), {}
        for method, file in FILES.items():
            with_file = trial.model_copy(update={"calibration": CalibrationTable(file=file)})
            motion = track_trial(with_file, Path(name) / file, pictures=False).motion
            found[method] = motion, errors_in_sds(motion, folder / "truth.csv")
        return found


def main() -> None:
    """Track, count, append the rows."""
    found = defaultdict(list)
    for seed in SEEDS:
        for method, each in follow(seed).items():
            found[method].append(each)
    rows = []
    for method, runs in found.items():
        common = {"data": "synthetic throws", "method": method, "n": sum(len(motion) for motion, _ in runs)}
        for what, unit, factor in (("position", "mm", 1e3), ("rotation", "deg", np.degrees(1))):
            sd = np.concatenate([getattr(motion, f"{what}_sd") for motion, _ in runs])
            errors = np.abs(np.concatenate([errors[what] for _, errors in runs]))
            rows += [
                {**common, "metric": f"median sd of {what}", "unit": unit, "value": factor * float(np.nanmedian(sd))},
                {**common, "metric": f"{what} errors within 2 sd", "unit": "%",
                 "value": 100 * float(np.mean(errors < 2)), "floor": "88..99"},
            ]  # fmt: skip
    append("calibration_file", rows)


if __name__ == "__main__":
    main()
