"""Track the cap of the man on the beam: `python benchmarks/accuracy/balance_cap/run.py [FOLDER]` (half a minute).

FOLDER holds the recording `balance`; by default it is looked for beside the project. cam03 is left out: its extrinsics
are off by 15 to 35 px. cam01 and cam02 were saved scaled and cropped. The start is the cap's middle, clicked in three
views and triangulated.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from rows import ROOT, append

from airborne.geometry.triangulation import triangulate
from airborne.motion import Motion
from airborne.run.opening import open_cameras
from airborne.run.track import track_trial
from airborne.trial.file import read_trial

CAMERAS = ("cam01", "cam02", "cam04")
CLICKED_PX = ((485, 372), (532, 435), (264, 532))
EARS = (7, 8)  # of the 33 landmarks

TRIAL = """
name = "balance, the cap"
[calibration]
file = "{data}/Calib.qca.txt"
[body]
file = "{here}/cap.toml"
[start]
position_m = {start}
quaternion_xyzw = [0, 0, 0, 1]
"""
CAMERA = """
[[camera]]
name = "{name}"
video = "{data}/{name}.mp4"
"""
SAVED = """saved_scale = 1.00741
saved_offset_px = [0, -7.11]
"""


def trial_text(data: Path, start: list[float]) -> str:
    """Write the trial file."""
    here = Path(__file__).parent
    text = TRIAL.format(data=data.as_posix(), here=here.as_posix(), start=start)
    for name in CAMERAS:
        text += CAMERA.format(name=name, data=data.as_posix()) + (SAVED if name in ("cam01", "cam02") else "")
    return text


def head_of_trc(path: Path) -> np.ndarray:
    """Read the head of the other system, y up, as (n, 3) in our world, z up [m]."""
    lines = [line.split("\t") for line in path.read_text().splitlines()]
    at = 2 + 3 * [name for name in lines[3] if name][2:].index("Head")
    rows = [[float(x) for x in line[at : at + 3]] for line in lines[5:] if len(line) > at + 2]
    return np.array(rows)[:, [2, 0, 1]]


def rms_mm(difference: np.ndarray) -> float:
    """Return the RMS distance after the mean difference is taken away."""
    return float(np.sqrt(((difference - difference.mean(axis=0)) ** 2).sum(axis=1).mean()) * 1e3)


def main(data: Path) -> None:
    """Track, compare, append the rows."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "trial.toml"
        path.write_text(trial_text(data, [0, 0, 0]))
        rig = open_cameras(read_trial(path)).rig
        start = rig.points_from_px(np.array(CLICKED_PX, float))
        path.write_text(trial_text(data, [round(float(x), 4) for x in start]))
        motion = track_trial(read_trial(path), Path(folder) / "run", pictures=False).motion
    assert isinstance(motion, Motion)
    detections = np.load(data / "detections_2d.npz")
    px = np.stack([detections["c" + name[3:]][:, EARS, :2] for name in CAMERAS], axis=2)
    ears = triangulate(rig.P, px).mean(axis=1)
    base = {"data": "balance, cap", "method": "refined", "n": len(motion)}
    head = head_of_trc(data / "Pose2Sim_markers.trc")
    seen = motion.has_pose
    append(
        "balance_cap",
        [
            {**base, "metric": "frames lost", "unit": "", "value": int((~seen).sum()), "floor": "0"},
            {
                **base,
                "metric": "RMS to triangulated ears, offset removed",
                "unit": "mm",
                "value": rms_mm((motion.position - ears)[seen]),
                "floor": 25,
            },
            {
                **base,
                "metric": "RMS to TRC head, offset removed",
                "unit": "mm",
                "value": rms_mm((motion.position - head)[seen]),
                "floor": 25,
            },
            {**base, "metric": "RMS of ears to TRC head, offset removed", "unit": "mm", "value": rms_mm(ears - head)},
            {
                **base,
                "metric": "frames whose rotation is said to be unseen",
                "unit": "",
                "value": int(np.isinf(motion.rotation_sd).all(axis=1).sum()),
            },
        ],
    )


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT.parent / "shared" / "data" / "balance"
    if not folder.is_dir():
        sys.exit(f"the recording is not at {folder}; give its folder")
    main(folder)
