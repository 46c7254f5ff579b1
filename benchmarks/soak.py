"""A soak: memory, descriptors and threads that should stay flat, and nothing lost that is not counted.

`python benchmarks/soak.py trials [--times 10000] [--minutes M]`: trials of three frames, one after the other in one
process. `python benchmarks/soak.py live [--minutes 30]`: three paced pipes whose cameras stall, fall silent, vanish,
come back, and send garbage. `python benchmarks/soak.py long [--minutes 10]`: a recording of 1920×1080 pixels. Players
whose tracker needs no pictures stand in for those that are tracked, as what is around the tracker is tested; `trials`
also tracks a body.
Prints one JSON object: of everything sampled the slope a step with its 95 % interval, after the first fifth.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import random
import shutil
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from multiprocessing.connection import Connection
from pathlib import Path
from typing import BinaryIO

import av
import numpy as np
from av.container import OutputContainer
from scipy.stats import linregress, t

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from airborne.cameras import Rig, write_pose2sim
from airborne.run import players
from airborne.run.track import track_trial
from airborne.synthetic.throw.writing import write_trial as write_scene
from airborne.trial.file import read_trial
from airborne.types import Image
from tests.support.players_trial import StandIn, camera, trial_text, write_trial
from tests.support.synthetic import small_scene

NAMES = ("left", "right", "middle")
RATE = 25  # images a second of the long recording and of the pipes
CLIP = 50  # images that are sent again and again


class Samples:
    """Memory, descriptors and threads of this process, now and then."""

    def __init__(self) -> None:
        """Start with none."""
        self.rows: list[tuple[int, float, int, int]] = []

    def take(self, step: int) -> None:
        """Sample at a step."""
        memory_mb = int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
        self.rows.append((step, memory_mb, len(os.listdir("/proc/self/fd")), threading.active_count()))

    def slopes(self) -> dict[str, object]:
        """Return what was sampled: first, last, and the slope a thousand steps with its 95 % interval."""
        rows = np.array(self.rows, float)[len(self.rows) // 5 :]
        found: dict[str, object] = {"samples": len(rows), "steps": int(rows[-1, 0])}
        for column, name in enumerate(("memory_mb", "descriptors", "threads"), start=1):
            fit = linregress(rows[:, 0], rows[:, column])
            half = float(np.nan_to_num(t.ppf(0.975, max(len(rows) - 2, 1)) * fit.stderr))  # NaN of a constant
            per_1000 = [round(1000 * value, 4) for value in (fit.slope - half, fit.slope, fit.slope + half)]
            found[name] = {"first": rows[0, column], "last": rows[-1, column], "slope_per_1000_95": per_1000}
        return found


def soak_trials(folder: Path, times: int, seconds: float = np.inf) -> dict[str, object]:
    """Track trials of three frames, of players and every tenth of a body, in one process, for so long at most."""
    trials = [write_trial(folder / "players", 3), folder / "body" / "trial.toml"]
    write_scene(small_scene(n_pictures=2), folder / "body")
    samples, every, n, end_s = Samples(), max(times // 200, 1), 0, time.monotonic() + seconds
    for number in range(times):
        is_body = number % 10 == 9
        track_trial(read_trial(trials[is_body], {"stop": 3}), folder / "run", pictures=False)
        shutil.rmtree(folder / "run")
        n = number + 1
        if number % every == 0:
            samples.take(number)
        if time.monotonic() > end_s:
            break
    return {"trials": n, **samples.slopes()}


def soak_live(folder: Path, seconds: float) -> dict[str, object]:
    """Track from three pipes whose cameras are not to be relied on."""
    write_trial(folder / "clips", CLIP, names=NAMES)
    (folder / "live.toml").write_text(trial_text(NAMES, video=f"{folder.as_posix()}/{{}}.ts"), encoding="utf-8")
    shutil.copyfile(folder / "clips" / "calib.toml", folder / "calib.toml")
    for name in NAMES:
        os.mkfifo(folder / f"{name}.ts")
    context = multiprocessing.get_context("spawn")  # whose memory is not ours
    received, sent = context.Pipe(duplex=False)
    senders = context.Process(target=_send_all, args=(folder, seconds, sent))
    senders.start()
    samples = Samples()
    run = track_trial(
        read_trial(folder / "live.toml"),
        folder / "run",
        live=True,
        pictures=False,
        progress=lambda step, _: samples.take(step) if step % RATE == 1 else None,
    )
    counts = received.recv()
    senders.join()
    returns = [event for event in run.summary["events"] if "came back" in event]
    return {
        "sent": counts,
        "live": run.summary["live"],
        "returns": returns,
        "frames": len(run.motion),
        **samples.slopes(),
    }


def _send_all(folder: Path, seconds: float, sent: Connection) -> None:
    """Send into every pipe, and then how many images each was sent."""
    counts: dict[str, int] = {}
    threads = [threading.Thread(target=_send, args=(folder, name, seconds, counts)) for name in NAMES]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    sent.send(counts)


def _send(folder: Path, name: str, seconds: float, counts: dict[str, int]) -> None:
    """Send images at their rate, with what goes wrong with cameras in between; the last 15 s without vanishing."""
    rng, end_s = random.Random(name), time.monotonic() + seconds
    with av.open(folder / "clips" / f"{name}.mkv") as clip:
        images = [frame.to_ndarray(format="rgb24") for frame in clip.decode(video=0)]
    while time.monotonic() < end_s:
        with open(folder / f"{name}.ts", "wb", buffering=0) as pipe, av.open(pipe, "w", format="mpegts") as container:
            counts[name] = counts.get(name, 0) + _send_stream(pipe, container, images, rng, end_s)
        time.sleep(min(rng.uniform(0.0, 4.0), max(0.0, end_s - time.monotonic())))


def _send_stream(
    pipe: BinaryIO, container: OutputContainer, images: list[Image], rng: random.Random, end_s: float
) -> int:
    """Send an MPEG transport stream until it vanishes, or to the end; return the number of images sent."""
    stream = container.add_stream("libx264", rate=RATE, options={"bf": "0", "g": "10", "preset": "ultrafast"})
    stream.width, stream.height, stream.pix_fmt = images[0].shape[1], images[0].shape[0], "yuv420p"
    start_s, n_sent = time.monotonic(), 0
    while (now_s := time.monotonic()) < end_s and (n_sent < 10 * RATE or now_s > end_s - 15 or rng.random() > 0.001):
        if n_sent > RATE and rng.random() < 0.01:
            time.sleep(rng.choice([0.1, 0.5, 3.0]))  # stalls, or falls silent
        if n_sent > RATE and rng.random() < 0.01:
            pipe.write(rng.randbytes(rng.choice([188, 5000])))
        frame = av.VideoFrame.from_ndarray(images[n_sent % len(images)])
        frame.pts, frame.time_base = round((now_s - start_s) * RATE), Fraction(1, RATE)
        container.mux(stream.encode(frame))
        n_sent += 1
        time.sleep(max(0.0, now_s + 1 / RATE - time.monotonic()))
    container.mux(stream.encode(None))
    return n_sent


def soak_long(folder: Path, seconds: float) -> dict[str, object]:
    """Track players in a long recording of large images."""
    path = write_trial(folder / "long", 2, names=("left",))
    (folder / "long" / "left.mkv").unlink()
    _write_long(folder / "long" / "left.mkv", round(seconds * RATE))
    write_pose2sim(folder / "long" / "calib.toml", Rig((replace(camera("left"), size=(1920, 1080)),)))
    samples, n = Samples(), round(seconds * RATE)
    run = track_trial(
        read_trial(path),
        folder / "run",
        pictures=False,
        progress=lambda step, _: samples.take(step) if step % max(n // 200, 1) == 0 else None,
    )
    return {"written": n, "frames": len(run.motion), "events": run.summary["events"], **samples.slopes()}


def _write_long(path: Path, n: int) -> None:
    """Write n images of 1920×1080: two seconds that are encoded once and repeated."""
    rng = np.random.default_rng(0)
    noise = rng.integers(0, 256, (1080, 1920, 3), dtype=np.uint8)
    with av.open(path, "w") as container:
        stream = container.add_stream("libx264", rate=RATE, options={"bf": "0", "preset": "ultrafast", "crf": "35"})
        stream.width, stream.height, stream.pix_fmt = 1920, 1080, "yuv420p"
        packets = []
        for k in range(2 * RATE):
            frame = av.VideoFrame.from_ndarray(np.roll(noise, 4 * k, axis=1))
            frame.pts, frame.time_base = k, Fraction(1, RATE)
            packets += stream.encode(frame)
        packets += stream.encode(None)
        data = [(bytes(packet), packet.is_keyframe) for packet in packets]
        for number in range(n):
            copy = av.Packet(data[number % len(data)][0])
            copy.pts = copy.dts = number
            copy.time_base, copy.stream, copy.is_keyframe = Fraction(1, RATE), stream, data[number % len(data)][1]
            container.mux(copy)


def stand_in() -> None:
    """Let players be found without looking at any picture."""
    players.players_tracker_of = lambda trial, rig: StandIn()  # type: ignore[assignment]


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("what", choices=["trials", "live", "long"])
    parser.add_argument("--times", type=int, default=10_000)
    parser.add_argument("--minutes", type=float)
    options = parser.parse_args()
    stand_in()
    minutes = options.minutes or {"live": 30.0, "long": 10.0, "trials": np.inf}[options.what]
    soaks: dict[str, Callable[[Path], dict[str, object]]] = {
        "trials": lambda folder: soak_trials(folder, options.times, 60 * minutes),
        "live": lambda folder: soak_live(folder, 60 * minutes),
        "long": lambda folder: soak_long(folder, 60 * minutes),
    }
    with tempfile.TemporaryDirectory() as name:
        print(json.dumps(soaks[options.what](Path(name))))


if __name__ == "__main__":
    main()
