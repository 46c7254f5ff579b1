"""Track the whole man on the beam: `python benchmarks/accuracy/balance/run.py [FOLDER] [--body person.toml]`.

FOLDER holds the recording `balance`; by default it is looked for beside the project. Without `--body` a person of
1.72 m and 66 kg is first fitted to the recording (`airborne fit-body`). All four cameras are used: cam03, whose
extrinsics are off, is mended by the detections; cam01 and cam02 were saved scaled and cropped. Nothing here is exact:
the detections and the other system's joints are good for 30 to 50 mm.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.signal import medfilt

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from rows import ROOT, append

from airborne.body.files import read_body
from airborne.evaluation import compare_joints, landmark_of, read_joint_paths
from airborne.motion import Motion
from airborne.run.detections import landmarks_over_time
from airborne.run.opening import open_trial
from airborne.run.own_body import fit_person
from airborne.run.track import track_trial
from airborne.trial.file import read_trial

SIDES = ("left", "right")
LIMBS = [f"{joint}_{side}" for joint in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist") for side in SIDES]
SAVED = "saved_scale = 1.00741\nsaved_offset_px = [0.0, -7.11]\n"
HIGHER_M, RESTING_M_S = 0.06, 0.4  # the other ankle is so much higher; the standing one moves no faster


def trial_text(data: Path, body: str) -> str:
    """Write the trial file."""
    cameras = "".join(
        f'[[camera]]\nname = "{name}"\nvideo = "{data.as_posix()}/{name}.mp4"\n{SAVED if name < "cam03" else ""}'
        for name in ("cam01", "cam02", "cam03", "cam04")
    )
    return (
        f'name = "balance"\n{cameras}[calibration]\nfile = "{data.as_posix()}/Calib.qca.txt"\nmend = ["cam03"]\n'
        f'[body]\n{body}\n[start]\ndetections = "{data.as_posix()}/detections_2d.npz"\n'
    )


def stance(ankle: np.ndarray, other: np.ndarray, rate_hz: float) -> np.ndarray:
    """Say when a foot stands alone, by the ankles (n, 3) [m] of the reference."""
    speed = medfilt(np.linalg.norm(np.gradient(ankle, axis=0), axis=1) * rate_hz, 9)
    return (other[:, 2] - ankle[:, 2] > HIGHER_M) & (speed < RESTING_M_S)


def main(data: Path, body: Path | None) -> None:
    """Fit, track, compare, append the rows."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if body is None:
            body = folder / "person.toml"
            (folder / "fit.toml").write_text(trial_text(data, 'preset = "human18"\nstature_m = 1.72\nmass_kg = 66.0'))
            fit_person(read_trial(folder / "fit.toml"), body)
        (folder / "trial.toml").write_text(trial_text(data, f'file = "{body.resolve().as_posix()}"'))
        trial = read_trial(folder / "trial.toml")
        opened = open_trial(trial)
        seen = landmarks_over_time(opened.recording.rig, opened.detections)
        run = track_trial(trial, folder / "run", pictures=False)
        model = read_body(folder / "run" / "body.toml")
    assert isinstance(run.motion, Motion)
    motion, base = run.motion, {"data": "balance, whole body", "method": trial.track.method, "n": len(run.motion)}
    trc = read_joint_paths(data / "Pose2Sim_markers.trc")
    paths = {landmark_of(name): trc.points[:, i] for i, name in enumerate(trc.names)}
    places = {landmark.name: i for i, landmark in enumerate(model.landmarks)}
    found = np.stack([model.with_pose(motion.pose(row)).landmarks for row in np.flatnonzero(motion.has_pose)])
    off = np.stack([found[:, places[limb]] - seen[limb][motion.index[motion.has_pose]] for limb in LIMBS], axis=1)
    free = np.linalg.norm(off - np.nanmean(off, axis=0), axis=-1) * 1e3
    rows = [
        {**base, "metric": "frames lost", "unit": "", "value": int((~motion.has_pose).sum()), "floor": "0"},
        {**base, "metric": "mean distance to detections, offset removed", "unit": "mm",
         "value": float(np.nanmean(free)), "floor": 50},
        {**base, "metric": "mean distance to detections", "unit": "mm",
         "value": float(np.nanmean(np.linalg.norm(off, axis=-1)) * 1e3)},
        {**base, "metric": "mean distance to TRC, offset removed", "unit": "mm",
         "value": compare_joints(motion, model, trc).whole.mean_without_offset_mm},
    ]  # fmt: skip
    for side, other in (("left", "right"), ("right", "left")):
        ankle, lifted, knee = paths[f"ankle_{side}"], paths[f"ankle_{other}"], paths[f"knee_{side}"]
        rests = np.flatnonzero(stance(ankle, lifted, 60.0))
        rests = rests[rests < len(found)]
        ours = found[rests, places[f"knee_{side}"], 2]
        rows += [
            {**base, "metric": f"sd of the {side} knee's height, {side} stance", "unit": "mm", "n": len(rests),
             "value": float(np.std(ours) * 1e3), "floor": f"{np.std(knee[rests, 2]) * 1e3:.3g} (TRC)"},
        ]  # fmt: skip
    append("balance", rows)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT.parent / "shared" / "data" / "balance")
    parser.add_argument("--body", type=Path)
    given = parser.parse_args()
    if not given.folder.is_dir():
        sys.exit(f"the recording is not at {given.folder}; give its folder")
    main(given.folder, given.body)
