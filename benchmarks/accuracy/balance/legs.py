"""Track the legs of the man on the beam: `python benchmarks/accuracy/balance/legs.py [FOLDER]`.

FOLDER holds the recording `balance`; by default it is looked for beside the project. The joints of the first frame, and
those that the tracked ones are compared with, are triangulated from a pose network's detections, which are good for 30
to 50 mm. cam03 is mended by the detections first, as for the whole man (`run.py`).
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from run import ROOT, append, trial_text

from airborne.body.legs import LEG_POINTS
from airborne.run.detections import landmarks_over_time
from airborne.run.opening import open_trial
from airborne.tracking import Status
from airborne.tracking.capsules import Blocker
from airborne.tracking.players import PlayerStart
from airborne.trial.file import read_trial

TRUNK = ("hip_left", "hip_right", "shoulder_left", "shoulder_right")


def main(data: Path) -> None:
    """Track, compare, append the rows."""
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "trial.toml"
        path.write_text(trial_text(data, 'preset = "human18"\nstature_m = 1.72\nmass_kg = 66.0'))
        trial = read_trial(path)
        opened = open_trial(trial)
        seen = landmarks_over_time(opened.recording.rig, opened.detections)
    first = {joint: seen[joint][0] for joint in (*LEG_POINTS, "foot_left", "foot_right")}
    first["torso"] = np.mean([seen[joint][0] for joint in TRUNK], axis=0)
    tracker = Blocker([PlayerStart(name="man", joints_m=first)])
    state, off, lost, spent_s = tracker.init(), [], 0, []
    for frames in opened.recording:
        begun = time.thread_time()
        state, (estimate,) = tracker.step(state, frames)
        spent_s.append(time.thread_time() - begun)
        lost += estimate.status is Status.LOST
        off.append([estimate.points[k] - seen[joint][frames.index] for k, joint in enumerate(LEG_POINTS)])
    distance = np.linalg.norm(off, axis=-1) * 1e3
    base = {"data": "balance, legs", "method": "blocker", "n": len(off)}
    rows: list[dict] = [
        {**base, "metric": "frames lost", "unit": "", "value": lost, "floor": 0},
        {**base, "metric": "hips, knees, ankles, mean distance", "unit": "mm", "value": float(np.nanmean(distance)),
         "floor": 50},
        {**base, "metric": "CPU per frame, 4 views", "unit": "ms", "value": float(np.median(spent_s) * 1e3)},
    ]  # fmt: skip
    for k, part in enumerate(("hips", "knees", "ankles")):
        value = float(np.nanmean(distance[:, 2 * k : 2 * k + 2]))
        rows.append({**base, "metric": f"{part}, mean distance", "unit": "mm", "value": value})
    append("balance", rows)


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT.parent / "shared" / "data" / "balance"
    if not folder.is_dir():
        sys.exit(f"the recording is not at {folder}; give its folder")
    main(folder)
