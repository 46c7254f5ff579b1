"""Memory of a long run of players: resident size while it goes, and its peak.

    python benchmarks/speed/memory.py [--minutes 10] [--size 1920x1080]

A clip of a second is repeated without encoding it again; a tracker that only looks at a region of each camera stands in
for the real ones, so that what is measured is reading, tables and results. Prints JSON.
"""

from __future__ import annotations

import argparse
import json
import resource
import tempfile
import time
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body.legs import LEG_POINTS
from airborne.cameras import Camera, Rig, write_pose2sim
from airborne.run import players
from airborne.run.track import track_trial
from airborne.tracking import Status
from airborne.tracking.players import PlayerEstimate
from airborne.trial.file import read_trial
from airborne.video import VideoWriter

NAMES, RATE = ("left", "right", "middle"), 60
POINTS = [[s * 0.12, 0.0, z] for z in (0.9, 0.5, 0.1) for s in (-1, 1)]


class Still:
    """Finds two players where they started, after a look at a region of every camera."""

    joints = LEG_POINTS

    def __init__(self) -> None:
        self.resident_mb: list[tuple[int, float]] = []

    def init(self) -> None:
        """Return the state: none."""

    def step(self, state, frames):
        """Look, and find everybody where they were."""
        for view in frames.views:
            if view is not None:
                width, height = view.camera.size
                view.crop((width // 4, height // 4, width // 2, 3 * height // 4))
        if frames.index % (10 * RATE) == 0:
            self.resident_mb.append((frames.index, resident_mb()))
        return state, tuple(
            PlayerEstimate(
                player=name, index=frames.index, time_s=frames.time_s, joint_status=(Status.TRACKED,) * 6,
                points=np.array(POINTS), covariance=np.tile(np.eye(3) * 1e-4, (6, 1, 1)), score=0.0, n_views=len(NAMES),
            )
            for name in ("first", "second")
        )  # fmt: skip


def resident_mb() -> float:
    """Return the memory that this process holds now [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


def write_clip(path: Path, size: tuple[int, int], seconds: int) -> None:
    """Write a second of moving noise and repeat its packets."""
    rng = np.random.default_rng(0)
    coarse = rng.integers(0, 256, (size[1] // 8, size[0] // 8, 3), dtype=np.uint8)
    image = np.kron(coarse, np.ones((8, 8, 1), np.uint8))
    second = path.with_suffix(".second.mp4")
    with VideoWriter(second, size=size, rate=Fraction(RATE)) as writer:
        for k in range(RATE):
            writer.write(np.roll(image, 4 * k, axis=1))
    with av.open(str(path), "w") as target:
        stream = None
        for k in range(seconds):
            with av.open(str(second)) as source:
                stream = stream or target.add_stream_from_template(source.streams.video[0])
                for packet in source.demux(video=0):
                    if packet.size:
                        shift = round(k / packet.time_base)
                        packet.pts, packet.dts, packet.stream = packet.pts + shift, packet.dts + shift, stream
                        target.mux(packet)


def write_trial(folder: Path, size: tuple[int, int], seconds: int) -> Path:
    """Write a trial of two players before three cameras that show the same."""
    turn = Rotation.from_matrix([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    K = np.array([[size[0], 0, size[0] / 2], [0, size[0], size[1] / 2], [0, 0, 1.0]])
    places = {name: RigidTransform.from_components([k - 1.0, 0.8, 6.0], turn) for k, name in enumerate(NAMES)}
    rig = Rig(tuple(Camera(name=name, K=K, size=size, camera_from_world=place) for name, place in places.items()))
    write_pose2sim(folder / "calib.toml", rig)
    write_clip(folder / "clip.mp4", size, seconds)
    cameras = "".join(f'[[camera]]\nname = "{name}"\nvideo = "clip.mp4"\n' for name in NAMES)
    joints = "\n".join(f"{name} = {place}" for name, place in zip(LEG_POINTS, POINTS, strict=True))
    players = "".join(
        f'[[start.player]]\nname = "{name}"\n[start.player.joints_m]\ntorso = [0.0, 0.0, 1.2]\n{joints}\n'
        for name in ("first", "second")
    )
    text = f'name = "memory"\n{cameras}[calibration]\nfile = "calib.toml"\n[body]\npreset = "legs"\n{players}'
    (folder / "trial.toml").write_text(text)
    return folder / "trial.toml"


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=0.5)
    parser.add_argument("--size", default="320x240")
    given = parser.parse_args()
    width, height = map(int, given.size.split("x"))
    tracker = Still()
    players.players_tracker_of = lambda trial, rig: tracker
    with tempfile.TemporaryDirectory() as name:
        trial = read_trial(write_trial(Path(name), (width, height), round(60 * given.minutes)))
        begun_s = time.monotonic()
        run = track_trial(trial, Path(name) / "run", pictures=False)
        taken_s = time.monotonic() - begun_s
    settled = [mb for index, mb in tracker.resident_mb if index >= 10 * RATE]
    found = {
        "frames": len(run.motion),
        "frames_per_s": len(run.motion) / taken_s,
        "resident_after_10_s_mb": settled[0],
        "resident_at_the_end_mb": settled[-1],
        "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3,
    }
    print(json.dumps(found, indent=2))


if __name__ == "__main__":
    main()
