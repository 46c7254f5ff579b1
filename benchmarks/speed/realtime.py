"""Video time over processing time of three 1920×1080 60 fps files: `python benchmarks/speed/realtime.py [FOLDER]`.

FOLDER holds the recording `block_jump`; by default it is looked for beside the project. Its files are written with a
high bit rate, which makes decoding dear, and last hardly longer than a start takes; so they are also measured written
anew at an ordinary rate, played forth and back until they last ten seconds. A first run, which compiles, does not
count. Decoding alone is measured too, as nothing can be faster.
"""

from __future__ import annotations

import shutil
import statistics
import sys
import tempfile
import time
from fractions import Fraction
from pathlib import Path

import av

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import ROOT, append

from airborne.run.opening import open_trial
from airborne.run.track import track_trial
from airborne.trial.file import read_trial
from airborne.video import VideoWriter

CRF, REPEATS = 23, 3
TURNS = 4  # forth and back


def written_anew(source: Path, target: Path) -> float:
    """Write a video at an ordinary quality, forth and back; return its bit rate [Mbit/s]."""
    with av.open(str(source)) as file:
        frames = [frame.to_ndarray(format="rgb24") for frame in file.decode(video=0)]
    height, width, _ = frames[0].shape
    with VideoWriter(target, size=(width, height), rate=Fraction(60), crf=CRF) as writer:
        for frame in TURNS * [*frames, *reversed(frames)]:
            writer.write(frame)
    return target.stat().st_size * 8e-6 / (2 * TURNS * len(frames) / 60)


def measure(folder: Path) -> tuple[float, float]:
    """Return video time over wall time of a whole run, and of decoding alone: medians."""
    trial = read_trial(folder / "trial.toml")
    runs, decoding = [], []
    for number in range(REPEATS + 1):
        with tempfile.TemporaryDirectory() as name:
            begun = time.monotonic()
            run = track_trial(trial, Path(name), pictures=False)
            whole_s = time.monotonic() - begun
        begun = time.monotonic()
        n = sum(1 for _ in open_trial(trial).recording)
        if number:
            runs.append(len(run.motion) / 60 / whole_s)
            decoding.append(n / 60 / (time.monotonic() - begun))
    return statistics.median(runs), statistics.median(decoding)


def main(data: Path) -> None:
    """Measure both, append the rows."""
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file in (*data.glob("*.toml"), *data.glob("*.csv")):
            shutil.copy(file, folder)
        rate = sum(written_anew(data / f"cam{k}.mp4", folder / f"cam{k}.mp4") for k in (1, 2, 3)) / 3
        for which, path in (("as recorded", data), (f"{rate:.0f} Mbit/s a camera, 10 s", folder)):
            whole, decoding = measure(path)
            base = {"data": f"block_jump, {which}", "method": "blocker", "unit": "", "n": REPEATS}
            rows.append({**base, "metric": "video time / processing time", "value": whole, "floor": "1.0"})
            rows.append({**base, "metric": "video time / time of decoding alone", "value": decoding})
    append("speed", rows)


if __name__ == "__main__":
    given = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT.parent / "shared" / "data" / "block_jump"
    if not given.is_dir():
        sys.exit(f"the recording is not at {given}; give its folder")
    main(given)
