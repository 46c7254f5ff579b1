"""Measure the trackers on the thrown cross: `python benchmarks/accuracy/thrown_cross.py` (about a minute)."""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import append

from airborne.body.files import read_body
from airborne.body.symmetry import symmetries
from airborne.evaluation import (
    compare_digitised,
    compare_motion,
    fit_digitised_poses,
    is_recovered,
    perturb,
    read_digitised,
    read_truth,
)
from airborne.evaluation.basin import Basin
from airborne.motion import Motion
from airborne.run.opening import open_trial
from airborne.tracking.methods import tracker_of
from airborne.tracking.model_based.refined import RefinedState, RefinedTracker
from airborne.tracking.tracker import step
from airborne.trial.calibration import CalibrationTable
from airborne.trial.examples import example_trial
from airborne.trial.file import Trial, read_trial

FOLDER = example_trial("thrown_cross").parent
MODEL = read_body(FOLDER / "cross.toml")
TRUTH = read_truth(FOLDER / "truth.csv")
ALIKE = symmetries(MODEL)


def trial(*, exact: bool, cameras: list[str] | None = None, **track) -> Trial:
    """Read the bundled trial with other settings."""
    found = read_trial(FOLDER / "trial.toml", track, cameras)
    return found.model_copy(update={"calibration": CalibrationTable(file="calib_true.toml")}) if exact else found


def run(settings: Trial) -> tuple[Motion, list[float]]:
    """Track a trial; return the motion and each frame's CPU time [s], without decoding."""
    recording = open_trial(settings).recording
    tracker = tracker_of(settings.settings, MODEL, settings.start.pose)
    state, estimates, times = tracker.init(), [], []
    for frames in recording:
        start = time.thread_time()
        state, estimate = step(tracker, state, frames)
        times.append(time.thread_time() - start)
        estimates.append(estimate)
    return Motion.collect(estimates), times


def refined_rows() -> list[dict]:
    """Measure `refined` against the truth, in the settings that others were measured in."""
    cases = {
        "calibrated from control points": (trial(exact=False), 2.0, 0.4),
        "exact cameras": (trial(exact=True), 1.2, 0.2),
        "every second field": (trial(exact=True, every=2), 1.5, 0.25),
        "every third field": (trial(exact=True, every=3), None, None),
        "two cameras": (trial(exact=True, cameras=["cam1", "cam2"]), 2.0, 0.3),
        "one camera": (trial(exact=True, cameras=["cam1"]), 30.0, None),
    }
    rows = []
    run(cases["exact cameras"][0])  # compiles
    for data, (settings, floor_mm, floor_deg) in cases.items():
        motion, times = run(settings)
        found = compare_motion(motion, TRUTH, ALIKE)
        base = {"data": f"thrown_cross, {data}", "method": "refined", "n": found.n_matched}
        rows += [
            {
                **base,
                "metric": "position RMS in space",
                "unit": "mm",
                "value": found.position.rms_3d_mm,
                "floor": floor_mm,
            },
            {**base, "metric": "geodesic RMS", "unit": "deg", "value": found.raw.geodesic_rms_deg, "floor": floor_deg},
            {**base, "metric": "fields lost", "unit": "", "value": found.n_lost, "floor": "0"},
            {**base, "metric": "CPU per field, median", "unit": "ms", "value": float(np.median(times) * 1e3)},
        ]
        for name, share in (("position", found.position_calibration), ("rotation", found.rotation_calibration)):
            rows.append({**base, "metric": f"{name} errors within 2 sd", "unit": "", "value": share.within_2sd})
    return rows


def paper_rows() -> list[dict]:
    """Measure the methods against digitising by hand, as paper B does."""
    rows = []
    for method, extra in (
        ("stepping", {}),
        ("stepping", {"v_rule": "v_literal"}),
        ("simplex", {}),
        ("refined", {}),
    ):
        settings = trial(exact=False, method=method, **extra)
        recording = open_trial(settings).recording
        motion, times = run(settings)
        clicked = fit_digitised_poses(read_digitised(FOLDER / "digitised.csv", recording.rig), recording.rig, MODEL)
        found = compare_digitised(motion, clicked, ALIKE).tracked_minus_digitised
        true = compare_motion(motion, TRUTH, ALIKE)
        name = method + (", v_literal" if extra else "")
        base = {"data": "thrown_cross against digitising", "method": name, "n": found.n_matched}
        for axis, value in zip("xyz", found.position.rms_mm, strict=True):
            rows.append({**base, "metric": f"{axis} RMS", "unit": "mm", "value": value, "floor": 10})
        for angle, value in zip(("somersault", "tilt", "twist"), found.raw.rms_deg, strict=True):
            rows.append({**base, "metric": f"{angle} RMS", "unit": "deg", "value": value, "floor": 3})
        rows += [
            {**base, "metric": "position RMS against truth", "unit": "mm", "value": true.position.rms_3d_mm},
            {**base, "metric": "geodesic RMS against truth", "unit": "deg", "value": true.raw.geodesic_rms_deg},
            {**base, "metric": "fields lost", "unit": "", "value": found.n_lost},
            {**base, "metric": "CPU per field, median", "unit": "ms", "value": float(np.median(times) * 1e3)},
        ]
    return rows


def basin_rows(n: int = 100) -> list[dict]:
    """Start one step from poses that are off by exactly so much; count how many are found again."""
    settings = trial(exact=True)
    recording = open_trial(settings).recording
    motion, _ = run(settings)
    rows = []
    for distance_m, angle_deg, floor in ((0.1, 10, 98), (0.15, 15, 90), (0.2, 20, 50), (0.3, 30, None)):
        rng, found = np.random.default_rng(0), 0
        tracker = RefinedTracker(MODEL, settings.start.pose)
        state = tracker.init()
        trials_of = np.bincount(4 + (29 * np.arange(n)) % 30, minlength=34)  # spread over the fields
        for frames, n_trials in zip(recording, trials_of, strict=True):
            true = replace(motion.pose(frames.index), world_from_root=TRUTH_POSES[frames.index])
            for start in perturb(rng, true, distance_m=distance_m, angle_rad=np.radians(angle_deg), n=int(n_trials)):
                before = RefinedState(((frames.time_s - recording.rate**-1, start),), state.appearance, state.reference)
                found += is_recovered(tracker.search(before, frames).pose, true, ALIKE)
            state, _ = step(tracker, state, frames)
        result = Basin(n, found)
        low, high = result.interval
        rows.append(
            {
                "data": f"thrown_cross, one step from {distance_m * 1e3:.0f} mm and {angle_deg} deg",
                "method": "refined",
                "metric": "found again within 10 mm and 2 deg",
                "unit": "%",
                "value": 100 * found / n,
                "n": n,
                "floor": floor,
                "interval": f"{100 * low:.0f}..{100 * high:.0f}",
            }
        )
    return rows


if __name__ == "__main__":
    from scipy.spatial.transform import RigidTransform, Rotation

    TRUTH_POSES = [
        RigidTransform.from_components(position, Rotation.from_matrix(R))
        for position, R in zip(TRUTH.position, TRUTH.R, strict=True)
    ]
    append("thrown_cross", [*refined_rows(), *paper_rows(), *basin_rows()])
