"""Measure what smoothing gains: `python benchmarks/accuracy/smoothing.py [SOMERSAULT ...] [--runs FOLDER]`.

Two synthetic somersaults, which no constant was chosen on, and recorded ones whose folders are given are tracked and
smoothed by the Kalman smoother (about 3 minutes of CPU each); runs that lie in FOLDER already are taken as they are.
"""

from __future__ import annotations

import argparse
import csv
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import append

from airborne.motion import landmarks
from airborne.motion.run_folder import read_body_run
from airborne.motion.smoothing.smoother import Smoothing, smooth_landmarks, smooth_root
from airborne.run.track import track_trial
from airborne.synthetic import write_somersault
from airborne.synthetic.flight.somersault import SomersaultPreset
from airborne.trial.file import read_trial
from airborne.types import Array

_SYNTHETIC: dict[SomersaultPreset, int] = {"moving-arms": 81, "pike": 82}  # and their seeds
_SAME_TIME_S = 2e-3
_KALMAN = Smoothing(method="kalman")


def measure(name: str, truth: Path, run: Path) -> list[dict]:
    """Return the rows of one run: errors of the smoothed motion against those of the tracked one."""
    motion, model = read_body_run(run)
    points, _ = landmarks(motion, model)
    joints, root = smooth_landmarks(motion, model, _KALMAN, []), smooth_root(motion, model, _KALMAN, [])
    place = true_joints(truth, motion.time_s, [landmark.name for landmark in model.landmarks])
    smooth, sd = (joints[key].to_numpy()[:, : len(model.landmarks)] for key in ("position", "position_sd"))
    raw_m, smooth_m = (np.nanmean(np.linalg.norm(each - place, axis=-1)) for each in (points, smooth))
    true_w, tracked_w = _true_rates(truth, motion.time_s), _rates(motion.time_s, motion.R)
    w, w_sd = root["angular_velocity"].to_numpy(), root["angular_velocity_sd"].to_numpy()[:, None]
    raw_w, smooth_w = (np.sqrt(np.nanmean(np.sum((each - true_w) ** 2, axis=1))) for each in (tracked_w, w))
    common = {"data": name, "method": "kalman", "n": len(motion)}
    return [
        {**common, "metric": "joints, mean, tracked", "unit": "mm", "value": 1e3 * raw_m},
        {**common, "metric": "joints, smoothed against", "unit": "%", "value": _change(smooth_m, raw_m), "floor": -15},
        {**common, "metric": "joints within 2 sd", "unit": "%", "value": _share(smooth - place, sd)},
        {**common, "metric": "angular velocity, RMS, tracked", "unit": "rad/s", "value": raw_w},
        {**common, "metric": "its, smoothed against", "unit": "%", "value": _change(smooth_w, raw_w), "floor": -40},
        {**common, "metric": "angular velocity within 2 sd", "unit": "%", "value": _share(w - true_w, w_sd)},
    ]


def _change(after: float, before: float) -> float:
    return float(100 * (after / before - 1))


def _share(errors: Array, sd: Array) -> float:
    is_known = np.isfinite(errors) & np.isfinite(sd)
    return float(100 * np.mean((np.abs(errors) < 2 * sd)[is_known]))


def true_joints(folder: Path, time_s: Array, names: list[str]) -> Array:
    """Return a recording's true joints at the times (n, joints, 3) [m]; NaN where unknown."""
    points = np.full((len(time_s), len(names), 3), np.nan)
    for row in _read(folder / "truth_joints.csv"):
        at = int(np.argmin(np.abs(time_s - float(row["time_s"]))))
        if row["joint"] in names and abs(time_s[at] - float(row["time_s"])) < _SAME_TIME_S:
            points[at, names.index(row["joint"])] = [float(row[axis]) for axis in ("x_m", "y_m", "z_m")]
    return points


def _true_rates(folder: Path, time_s: Array) -> Array:
    """Return true angular velocities (n, 3) [rad/s], world axes, at the times."""
    if (folder / "truth_flight.csv").exists():
        rows = _read(folder / "truth_flight.csv")
        angles = [[float(row[f"{name}_deg"]) for name in ("somersault", "tilt", "twist")] for row in rows]
        R = Rotation.from_euler("XYZ", angles, degrees=True).as_matrix()
    else:
        rows = _read(folder / "truth.csv")
        R = np.array([[float(row[f"r{i}{j}"]) for i in range(3) for j in range(3)] for row in rows]).reshape(-1, 3, 3)
    true_s = np.array([float(row["time_s"]) for row in rows])
    return _rates(true_s, R)[np.abs(true_s[:, None] - time_s).argmin(axis=0)]


def _rates(time_s: Array, R: Array) -> Array:
    """Return angular velocities by central differences (n, 3) [rad/s], world axes; NaN at ends and gaps."""
    rates = np.full((len(R), 3), np.nan)
    inner = np.flatnonzero(np.isfinite(R[2:] * R[:-2]).all(axis=(1, 2)))
    turns = Rotation.from_matrix(R[inner + 2] @ R[inner].swapaxes(1, 2)).as_rotvec()
    rates[inner + 1] = turns / (time_s[inner + 2] - time_s[inner])[:, None]
    return rates


def _read(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("recordings", type=Path, nargs="*", help="folders with trial.toml and truth")
    parser.add_argument("--runs", type=Path, help="where runs lie, or are left")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as made:
        runs = asked.runs or Path(made) / "runs"
        folders = {folder.name: folder for folder in asked.recordings}
        for preset, seed in _SYNTHETIC.items():
            folder = folders[f"{preset}, seed {seed}"] = Path(made) / f"{preset}_{seed}"
            write_somersault(folder, preset=preset, style="gym", seed=seed)
        rows = []
        for name, folder in folders.items():
            if not (runs / folder.name / "summary.json").exists():
                track_trial(read_trial(folder / "trial.toml"), runs / folder.name, pictures=False)
            rows += measure(name, folder, runs / folder.name)
            print(*(f"{row['metric']} {row['value']:.3g} {row['unit']}" for row in rows[-6:]), sep="; ", flush=True)
    append("smoothing", rows)


if __name__ == "__main__":
    main()
