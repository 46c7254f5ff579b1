"""Track recorded somersaults that are made harder: `python benchmarks/accuracy/altered_somersaults.py [FOLDER]`.

FOLDER holds `somersault_1` and `somersault_2`; by default they are looked for beside the project. Each is encoded again
as it is, backward, at half the frame rate, darkened with noise, at half the size, with pictures repeated in
all cameras, from its middle on, and without each camera. No constant was chosen on these. Some 6 minutes.
"""

from __future__ import annotations

import json
import re
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

from airborne.io.environment import set_up_libraries

set_up_libraries()  # as the command line does: with other threads, last digits differ

import av
import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import ROOT, append

from airborne.cameras import Rig, read_rig, write_rig
from airborne.evaluation import compare_joints, read_joint_paths
from airborne.motion.run_folder import read_body_run
from airborne.run.track import track_trial
from airborne.trial.file import read_trial
from airborne.types import Image
from airborne.video import VideoWriter

START_SD_M = 0.015  # of each joint of a start that is not the recording's own, as those are set by hand


@dataclass(frozen=True)
class Recording:
    """Images by camera, and the number of each image's frame in the recording."""

    images: dict[str, Sequence[Image]]
    frames: Sequence[int]
    rate_hz: int
    scale: float = 1.0  # of the images

    def map(self, change: Callable[[Image], Image]) -> Recording:
        """Change every image."""
        return replace(self, images={name: [change(each) for each in of] for name, of in self.images.items()})

    def repeat(self, rows: Sequence[int]) -> Recording:
        """Show what the frame before showed, in some frames of all cameras; the truth goes on."""
        shown = list(range(len(self.frames)))
        for row in rows:
            shown[row] = shown[row - 1]
        return replace(self, images={name: [of[row] for row in shown] for name, of in self.images.items()})

    def select(self, rows: slice, rate_hz: int | None = None) -> Recording:
        """Take some of the frames."""
        images = {name: of[rows] for name, of in self.images.items()}
        return replace(self, images=images, frames=self.frames[rows], rate_hz=rate_hz or self.rate_hz)


def darken(image: Image) -> Image:
    """Return an image at 0.55 of its light, with noise of 7 grey levels."""
    noise = np.random.default_rng(int(image[::16, ::16].sum())).normal(0, 7, image.shape)
    return np.clip(0.55 * image + noise, 0, 255).astype(np.uint8)


def halve(image: Image) -> Image:
    """Return an image of half the width and height."""
    return cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)


def alterations(whole: Recording) -> Iterator[tuple[str, Recording]]:
    """Yield the recording in all its forms."""
    yield "encoded again", whole
    yield "backward", whole.select(slice(None, None, -1))
    yield "half the frame rate", whole.select(slice(None, None, 2), whole.rate_hz // 2)
    yield "dark, noisy", whole.map(darken)
    yield "half the size", replace(whole.map(halve), scale=0.5)
    n = len(whole.frames)
    yield "every sixth repeated", whole.repeat(range(6, n, 6))
    yield "last ten repeated", whole.repeat(range(n - 10, n))
    yield "from the middle on", whole.select(slice(len(whole.frames) // 2, None))
    for left_out in whole.images:
        images = {name: of for name, of in whole.images.items() if name != left_out}
        yield f"without {left_out}", replace(whole, images=images)


def read_images(path: Path) -> list[Image]:
    """Decode a video."""
    with av.open(str(path)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


def write_video(path: Path, images: Sequence[Image], rate_hz: int) -> None:
    """Encode a video, at a quality at which its noise stays."""
    height, width = images[0].shape[:2]
    with VideoWriter(path, size=(width, height), rate=Fraction(rate_hz), preset="veryfast") as writer:
        for image in images:
            writer.write(image)


def write_trial(folder: Path, source: Path, recording: Recording) -> None:
    """Write videos, calibration, trial and truth of an altered recording."""
    for name, images in recording.images.items():
        write_video(folder / f"{name}.mp4", images, recording.rate_hz)
    scale = recording.scale
    rig = read_rig(source / "Calib.toml")
    sizes = [tuple(round(scale * length) for length in camera.size) for camera in rig]
    middle = ((1 / scale - 1) / 2,) * 2  # of the pixels that the first one is the mean of
    write_rig(
        folder / "Calib.toml",
        Rig(tuple(c.resample(scale=(1 / scale,) * 2, offset=middle, size=s) for c, s in zip(rig, sizes, strict=True))),
    )
    truth = read_joint_paths(source / "truth_joints.csv")
    lines = ["time_s,joint,x_m,y_m,z_m"]
    for row, frame in enumerate(recording.frames):
        for name, point in zip(truth.names, truth.points[frame], strict=True):
            lines.append(",".join([f"{row / recording.rate_hz:.6f}", name, *(f"{x:.5f}" for x in point)]))
    (folder / "truth_joints.csv").write_text("\n".join(lines) + "\n")
    text = (source / "trial.toml").read_text()
    for table in re.findall(r"\[\[camera\]\]\n(?:.+\n)+\n", text):
        if not any(f'"{name}"' in table for name in recording.images):
            text = text.replace(table, "")
    if recording.frames[0] != 0:
        rng = np.random.default_rng(0)
        known = dict(zip(truth.names, truth.points[recording.frames[0]], strict=True))
        head, start = text.split("[start.joints_m]")
        names = [line.split(" = ")[0] for line in start.splitlines() if " = " in line]
        joints = {name: rng.normal(known[name], START_SD_M).round(3).tolist() for name in names if name in known}
        text = head + "[start.joints_m]\n" + "".join(f"{name} = {at}\n" for name, at in joints.items())
    (folder / "trial.toml").write_text(text)


def rows_of(data: str, method: str, folder: Path) -> list[dict]:
    """Track an altered recording; return its rows."""
    run = folder / "run"
    track_trial(read_trial(folder / "trial.toml"), run, pictures=False)
    found = compare_joints(*read_body_run(run), read_joint_paths(folder / "truth_joints.csv"))
    findings = json.loads((run / "summary.json").read_text())["self_check"]
    common = {"data": data, "method": method, "n": found.whole.n}
    held, alarms = found.coverage_with_offset.within_95, sum(finding["is_alarm"] for finding in findings)
    return [
        {**common, "metric": "mean joint error", "unit": "mm", "value": found.whole.mean_mm},
        {**common, "metric": "the same without constant offsets", "unit": "mm",
         "value": found.whole.mean_without_offset_mm},
        {**common, "metric": "joints tracked", "unit": "", "value": found.share_tracked},
        {**common, "metric": "of them more than 100 mm off", "unit": "", "value": found.n_far, "floor": "0"},
        {**common, "metric": "held by the 95 % interval", "unit": "", "value": held, "floor": "0.88..0.99"},
        {**common, "metric": "false alarms", "unit": "", "value": alarms, "floor": "0"},
    ]  # fmt: skip


def main(data: Path) -> None:
    """Measure, print, append the rows."""
    for name in ("somersault_1", "somersault_2"):
        source = data / name
        if not source.is_dir():
            print(f"{source} is not there: {name} is left out")
            continue
        videos = sorted(source.glob("cam*.mp4"))
        images = {path.stem: read_images(path) for path in videos}
        whole = Recording(images, range(len(images[videos[0].stem])), rate_hz=60)
        for method, recording in alterations(whole):
            with tempfile.TemporaryDirectory() as folder:
                write_trial(Path(folder), source, recording)
                append("altered_somersaults", rows_of(name, method, Path(folder)))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT.parent / "shared" / "data")
