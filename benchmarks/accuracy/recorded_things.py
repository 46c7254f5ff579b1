"""Two real recordings of a thing by one camera: `python benchmarks/accuracy/recorded_things.py [FOLDER]`.

FOLDER holds `teabox` and `lego_plate`; by default they are looked for beside the project. The printed box is outside of
what one-coloured parts and static cameras allow, and stays 0.43 to 0.46 m away: no frame that is called tracked may be
further off than 5 %. The plate is pushed along a table by a hand: its height over the table and its tilt stay, which
their intervals must hold, and so must the first frame's beside the next ones. Half a minute.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import ROOT, append

from airborne.motion import Motion
from airborne.motion.run_folder import read_body_run
from airborne.run.track import track_trial
from airborne.trial.file import read_trial

NEAREST_M, FARTHEST_M, SHARE = 0.43, 0.46, 0.05  # of the box, from the camera, which is at the origin


def track(folder: Path) -> Motion:
    """Track a recording as its trial says."""
    with tempfile.TemporaryDirectory() as name:
        track_trial(read_trial(folder / "trial.toml"), Path(name) / "run", pictures=False)
        return read_body_run(Path(name) / "run")[0]


def box_rows(motion: Motion) -> Iterator[dict]:
    """Yield how many frames are called tracked, and how many of them at a wrong distance."""
    distance_m, is_tracked = np.linalg.norm(motion.position, axis=1), motion.status == "tracked"
    is_off = (distance_m < (1 - SHARE) * NEAREST_M) | (distance_m > (1 + SHARE) * FARTHEST_M)
    yield {"metric": "frames tracked", "unit": "", "value": int(is_tracked.sum())}
    yield {"metric": "of them more than 5 % off", "unit": "", "value": int((is_tracked & is_off).sum()), "floor": 0}


def plate_rows(motion: Motion) -> Iterator[dict]:
    """Yield which share of the heights and tilts lie within two sds of their medians, and how far off the first is."""
    normals = motion.R[:, :, 2]
    up = normals.mean(axis=0) / np.linalg.norm(normals.mean(axis=0))
    covariance = motion.total_covariance
    height, variance = motion.position @ up, np.einsum("i,nij,j->n", up, covariance[:, :3, :3], up)
    off = (height - np.median(height)) / np.sqrt(variance)
    yield {"metric": "heights within 2 sd", "unit": "%", "value": 100 * np.mean(np.abs(off) < 2), "floor": 88}
    first = (height[0] - np.median(height[1:10])) / np.sqrt(variance[0])
    yield {"metric": "first height, off the next nine", "unit": "sd", "value": abs(first), "floor": "<= 2"}
    across = np.linalg.svd(up[None])[2][1:]  # two axes in the table
    for name, axis, other in (("one", *across), ("the other", *across[::-1])):
        tilt = normals @ other  # changed by a rotation about `axis`
        sd = np.sqrt(np.einsum("i,nij,j->n", axis, covariance[:, 3:6, 3:6], axis))
        share = 100 * np.mean(np.abs(tilt - np.median(tilt)) < 2 * sd)
        yield {"metric": f"tilts about {name} axis within 2 sd", "unit": "%", "value": share, "floor": 88}


def main(data: Path) -> None:
    """Measure, print, append the rows."""
    for name, rows_of in (("teabox", box_rows), ("lego_plate", plate_rows)):
        if not (data / name).is_dir():
            print(f"{data / name} is not there: {name} is left out")
            continue
        motion = track(data / name)
        append(
            "recorded_things", [{"data": name, "method": "refined", "n": len(motion), **row} for row in rows_of(motion)]
        )


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT.parent / "shared" / "data")
