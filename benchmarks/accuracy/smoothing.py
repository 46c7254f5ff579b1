"""Errors of smoothed somersaults: `python benchmarks/accuracy/smoothing.py [SOMERSAULT ...] [--runs FOLDER]`.

Two synthetic somersaults, which no constant was chosen on, and recorded ones whose folders are given are tracked and
smoothed by the Kalman smoother, from the poses frame by frame and from those of the fit of the whole run (about a
minute of CPU each); runs that lie in FOLDER already are taken as they are.
"""

from __future__ import annotations

import argparse
import csv
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import append

from airborne.body import BodyModel
from airborne.motion import Motion, landmarks
from airborne.motion.files import read_motion
from airborne.motion.run_folder import TRACKED_MOTION, read_body_run
from airborne.motion.smoothing.settings import Smoothing
from airborne.motion.smoothing.smoother import smooth_landmarks, smooth_root
from airborne.run.track import track_trial
from airborne.synthetic import write_somersault
from airborne.synthetic.flight.somersault import SomersaultPreset
from airborne.trial.file import read_trial
from airborne.types import Array

_SYNTHETIC: dict[SomersaultPreset, int] = {"moving-arms": 81, "pike": 82}  # and their seeds
_SAME_TIME_S = 2e-3
_KALMAN = Smoothing(method="kalman")


def measure(name: str, folder: Path, run: Path) -> list[dict]:
    """Return the rows of one run: errors of the smoothed motions against those of the tracked one."""
    fitted, model = read_body_run(run)
    motion = replace(read_motion(run / TRACKED_MOTION), lasting=fitted.lasting)
    truth = _Truth(model, true_joints(folder, motion.time_s, [each.name for each in model.landmarks]))
    points, true_w = landmarks(motion, model)[0], _true_rates(folder, motion.time_s)
    tracked_mm, tracked_w = truth.mean_mm(motion, points), _rms(_rates(motion.time_s, motion.R) - true_w)
    common = {"data": name, "n": len(motion)}
    rows = [
        {**common, "method": "tracked", "metric": "joints, mean", "unit": "mm", "value": tracked_mm[0]},
        {**common, "method": "tracked", "metric": "without offset", "unit": "mm", "value": tracked_mm[1]},
        {**common, "method": "tracked", "metric": "angular velocity, RMS", "unit": "rad/s", "value": tracked_w},
    ]
    for method, each in {"kalman": motion, "whole run, kalman": fitted}.items():
        joints, root = smooth_landmarks(each, model, _KALMAN, []), smooth_root(each, model, _KALMAN, [])
        smooth, sd, v, v_sd, a, a_sd = (
            joints[f"{key}{end}"].to_numpy()[:, : len(model.landmarks)]
            for key in ("position", "velocity", "acceleration")
            for end in ("", "_sd")
        )
        true_v, true_a = _derivatives(motion.time_s, truth.points)
        w, w_sd = root["angular_velocity"].to_numpy(), root["angular_velocity_sd"].to_numpy()[:, None]
        all_mm, free_mm = truth.mean_mm(each, smooth)
        found = {
            "joints, against tracked": (_change(all_mm, tracked_mm[0]), -15),
            "without offset, against tracked": (_change(free_mm, tracked_mm[1]), -15),
            "joints within 2 sd": (_share(smooth - truth.points, sd), "88..99"),
            "velocities of joints within 2 sd": (_share(v - true_v, v_sd), "88..99"),
            "accelerations of joints within 2 sd": (_share(a - true_a, a_sd), "88..99"),
            "angular velocity, against tracked": (_change(_rms(w - true_w), tracked_w), -40),
            "angular velocity within 2 sd": (_share(w - true_w, w_sd), "88..99"),
        }
        rows += [
            {**common, "method": method, "metric": metric, "unit": "%", "value": value, "floor": floor}
            for metric, (value, floor) in found.items()
        ]
    return rows


@dataclass(frozen=True, slots=True, eq=False)
class _Truth:
    """A body's true joints (n, joints, 3) [m]; NaN where unknown."""

    model: BodyModel
    points: Array

    def mean_mm(self, motion: Motion, points: Array) -> tuple[float, float]:
        """Return the mean error, and that without each joint's constant offset in its segment, as its definition is."""
        owners = [self.model.index_of(each.segment) for each in self.model.landmarks]
        R = np.array([self.model.with_pose(motion.pose(row)).R[owners] for row in range(len(motion))])
        known = np.isfinite(self.points).all(axis=(0, 2))
        own = np.einsum("njba,njb->nja", R, points - self.points)[:, known]
        means = (np.nanmean(np.linalg.norm(each, axis=-1)) for each in (own, own - np.nanmean(own, axis=0)))
        all_m, free_m = (float(each) for each in means)
        return 1e3 * all_m, 1e3 * free_m


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.nanmean(np.sum(errors**2, axis=1))))


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


def _derivatives(time_s: Array, points: Array) -> tuple[Array, Array]:
    """Return velocities and accelerations of even paths (n, joints, 3) by central differences; NaN at ends."""
    velocity, acceleration = np.full((2, *points.shape), np.nan)
    step_s = float(np.median(np.diff(time_s)))
    velocity[1:-1] = (points[2:] - points[:-2]) / (2 * step_s)
    acceleration[1:-1] = (points[2:] - 2 * points[1:-1] + points[:-2]) / step_s**2
    return velocity, acceleration


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
    append("smoothing", rows)


if __name__ == "__main__":
    main()
