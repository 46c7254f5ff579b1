"""How does the cost grow? `python benchmarks/speed/scaling.py [--only FACTOR ...] [--rounds 5] [--quick] [--rows]`.

Synthetic throws, tracked by `refined` on one thread. Cost is CPU time of a field from the second on, of images decoded
beforehand; of `length` that of a whole run without pictures, from the trial file to its summary, and its peak memory.

    picture     the same body in pixels, in larger pictures; `reading` is the same for decoding and conversion alone
    body        picture and body grow together
    cameras     2 to 8 on an arc
    segments    a bar in one piece to twelve pieces with joints, of the same size
    players     1 to 3 blockers, images decoded as they are needed
    length      the same motion forth and back, one to eight times

Printed: costs, and the exponent of cost in each factor, the median of the rounds with its interval of 95 % (or what so
few allow). `length` may have a fixed cost beside: cost = a + b n^e. `--rows` appends to benchmarks/results/speed.csv.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
from scipy.spatial.transform import RigidTransform

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from airborne.body import BodyModel, Box, Part, Segment
from airborne.cameras import Rig, camera_looking_at
from airborne.run.opening import open_trial
from airborne.run.players import PlayersRun
from airborne.run.track import track_trial
from airborne.synthetic import block_scene, cross_scene, scene_frames, write_block, write_trial
from airborne.synthetic.block.scene import DIFFICULTIES
from airborne.synthetic.throw.measurements import start_pose
from airborne.synthetic.throw.scene import YELLOW, Scene, Throw
from airborne.tracking import Status
from airborne.tracking.methods import Settings, tracker_of
from airborne.tracking.players import StepTracker
from airborne.tracking.tracker import step
from airborne.trial.file import read_trial
from airborne.video import Frames, VideoWriter, View
from benchmarks.rows import append
from benchmarks.speed.compare import median_interval

SEED = 11  # of the throws
# tracked for one cost; of the first nothing is counted. Three are the fewest that leave a mean, for a test that it runs
N_FIELDS, N_QUICK = 8, 3
BAR_M = (1.2, 0.09, 0.05)  # of `segments`
FLOORS = {"picture": 0.2, "length": 1.02}  # largest exponents
FACTORS = ("picture", "body", "cameras", "segments", "players", "length")
PEAK_GB: dict[tuple[Path, int], float] = {}  # memory of whole runs, by folder and number of frames
Cost = Callable[[], float]  # seconds of CPU
Points = dict[float, Cost]  # costs by the factor's size


def later_cost(tracker: Any, frames: Sequence[Frames]) -> float:
    """Track and return the CPU time of a field from the second on [s]."""
    state, times = tracker.init(), []
    for observed in frames:
        begun = time.thread_time()
        state, found = step(tracker, state, observed)
        times.append(time.thread_time() - begun)
        if getattr(found, "status", None) is Status.LOST:
            sys.exit(f"the body was lost at field {observed.index}: such a cost would mislead; choose another scene")
    return float(np.mean(times[1:]))


def thing_cost(scene: Scene, frames: Sequence[Frames]) -> Cost:
    """Return the cost of tracking a thing."""
    tracker = tracker_of(Settings(), scene.model, start_pose(scene))
    return lambda: later_cost(tracker, frames)


def with_views(frames: Sequence[Frames], change: Callable[[View], View]) -> list[Frames]:
    """Change every view."""
    return [replace(each, views=tuple(change(view) for view in each.views if view is not None)) for each in frames]


def in_larger_picture(view: View, share: float) -> View:
    """Put a picture into the middle of one whose sides are `share` times as long; the rest repeats it mirrored."""
    height, width = view.rgb.shape[:2]
    x, y = (round((share - 1) * side / 2) for side in (width, height))
    tiles = np.pad(view.rgb, ((y, y), (x, x), (0, 0)), mode="symmetric")
    size = tiles.shape[1], tiles.shape[0]
    return View(view.camera.resample(scale=(1, 1), offset=(-x, -y), size=size), tiles)


def enlarged(view: View, share: float) -> View:
    """Enlarge or reduce a picture with what it shows."""
    size = tuple(round(share * side) for side in view.camera.size)
    step_px = tuple(own / new for own, new in zip(view.camera.size, size, strict=True))
    offset = tuple((each - 1) / 2 for each in step_px)
    how = cv2.INTER_AREA if share < 1 else cv2.INTER_CUBIC
    camera = view.camera.resample(scale=step_px, offset=offset, size=size)  # pyright: ignore[reportArgumentType]
    return View(camera, np.asarray(cv2.resize(view.rgb, size, interpolation=how), np.uint8))


def reading_cost(frames: Sequence[Frames], folder: Path) -> Cost:
    """Return the cost of decoding and converting a field of all cameras, from files of their own."""
    paths = [folder / f"{len(list(folder.iterdir()))}_{k}.mp4" for k in range(len(frames[0].views))]
    for k, path in enumerate(paths):
        images = [each.views[k].rgb for each in frames]  # pyright: ignore[reportOptionalMemberAccess]
        with VideoWriter(path, size=images[0].shape[1::-1], rate=50, preset="ultrafast") as writer:  # pyright: ignore
            for image in images:
                writer.write(image)

    def read() -> float:
        begun = time.process_time()
        for path in paths:
            with av.open(str(path)) as file:
                for frame in file.decode(video=0):
                    frame.to_ndarray(format="rgb24")
        return (time.process_time() - begun) / len(frames)

    return read


def drawn(scene: Scene, quick: bool) -> list[Frames]:
    """Return the fields of a scene that are tracked."""
    n = N_QUICK if quick else N_FIELDS
    return list(islice(scene_frames(replace(scene, n_pictures=N_FIELDS)), n))


def picture(quick: bool, folder: Path) -> dict[str, Points]:
    """Return tracking and reading in larger pictures, by pixels of a field over those of 768 x 288."""
    scene = cross_scene(seed=SEED)
    frames = drawn(scene, quick)
    shares = (1, 2) if quick else (1, 2, 4)
    larger = {share: with_views(frames, lambda view, share=share: in_larger_picture(view, share)) for share in shares}
    return {
        "picture": {share**2: thing_cost(scene, each) for share, each in larger.items()},
        "picture, reading": {share**2: reading_cost(each, folder) for share, each in larger.items()},
    }


def body(quick: bool, folder: Path) -> dict[str, Points]:
    """Return tracking where picture and body grow together, by pixels over those of 768 x 288."""
    scene = cross_scene(seed=SEED)
    frames = drawn(scene, quick)
    shares = (1, 2) if quick else (0.5, 1, 2, 3)
    larger = {share: with_views(frames, lambda view, share=share: enlarged(view, share)) for share in shares}
    return {"body": {share**2: thing_cost(scene, each) for share, each in larger.items()}}


def cameras(quick: bool, folder: Path) -> dict[str, Points]:
    """Return tracking by cameras, on an arc before the hall's wall."""
    angles = np.radians(np.linspace(-160, -20, 8))
    rig = Rig(
        tuple(
            camera_looking_at(
                f"cam{k}", (5.4 * np.cos(angle), 5.4 * np.sin(angle), 1.5), (0.0, 0.0, 1.55),
                focal_px=1060.0, size=(768, 576),
            )
            for k, angle in enumerate(angles, start=1)
        )
    )  # fmt: skip
    scene = replace(cross_scene(seed=SEED), rig=rig)
    frames = drawn(scene, quick)
    points: Points = {}
    for n in (2, 4) if quick else (2, 4, 8):
        chosen = {2: [2, 5], 4: [0, 2, 5, 7], 8: range(8)}[n]
        own = [replace(each, views=tuple(each.views[k] for k in chosen)) for each in frames]
        points[n] = thing_cost(scene, own)
    return {"cameras": points}


def bar(n: int) -> BodyModel:
    """Return a bar of n pieces with joints between them."""
    length, *across = BAR_M
    piece = np.array([*across, length / n])
    segments = []
    for k in range(n):
        middle = np.array([0.0, 0.0, piece[2] / 2])
        part = Part(f"bar_{k}", Box(piece), RigidTransform.from_translation(middle), YELLOW * (0.75 + 0.25 * (k % 2)))
        parent = f"piece_{k - 1}" if k else None
        joint = np.array([0.0, 0.0, piece[2] if k else 0.0])
        segments.append(Segment(f"piece_{k}", parent, joint, (part,)))
    return BodyModel(f"bar of {n}", tuple(segments))


def segments(quick: bool, folder: Path) -> dict[str, Points]:
    """Return tracking by segments, each after the first with three degrees of freedom more."""
    thrown: Any = cross_scene(seed=SEED)
    points: Points = {}
    for n in (1, 3) if quick else (1, 3, 6, 12):
        own = bar(n)
        flight = Throw(bar(1), thrown.flight.density_kg_m3, thrown.flight.launch)
        scene = replace(thrown, body=own, flight=flight)
        points[n] = thing_cost(scene, drawn(scene, quick))
    return {"segments": points}


def players(quick: bool, folder: Path) -> dict[str, Points]:
    """Return tracking by players, of a file each, conversion of their regions included."""
    points: Points = {}
    for n in (1,) if quick else (1, 2, 3):
        path = folder / f"block_{n}"
        write_block(path, block_scene(SEED, n_blockers=n, difficulty=DIFFICULTIES["easy"]))
        trial = read_trial(path / "trial.toml", {"stop": 20})
        opened = open_trial(trial)
        tracker = StepTracker(PlayersRun.open(trial, opened).players)
        frames = list(opened.recording)
        points[n] = lambda tracker=tracker, frames=frames: later_cost(tracker, frames)
    return {"players": points}


def length(quick: bool, folder: Path) -> dict[str, Points]:
    """Return whole runs by frames, each in a process of its own, and their peak memory [GB]."""
    n_frames = 17
    scene = replace(cross_scene(seed=SEED), is_interlaced=False, n_pictures=n_frames, is_surveyed=False)
    write_trial(scene, folder / "once")
    once = {path.name: read_images(path) for path in (folder / "once").glob("*.mp4")}
    costs, memory = {}, {}
    for turns in (1, 2) if quick else (1, 2, 4, 8):
        own, n = folder / f"length_{turns}", 2 * turns * n_frames
        own.mkdir()
        for path in (folder / "once").iterdir():
            if path.suffix != ".mp4":
                (own / path.name).write_bytes(path.read_bytes())
        for name, images in once.items():
            with VideoWriter(own / name, size=images[0].shape[1::-1], rate=50, preset="ultrafast") as writer:  # pyright: ignore
                for image in turns * [*images, *reversed(images)]:
                    writer.write(image)
        costs[n] = lambda own=own, n=n: whole_run(own, n)
        memory[n] = lambda own=own, n=n: PEAK_GB[own, n]
    return {"length": costs, "length, peak memory": memory}


def read_images(path: Path) -> list[np.ndarray]:
    """Decode a whole video."""
    with av.open(str(path)) as file:
        return [frame.to_ndarray(format="rgb24") for frame in file.decode(video=0)]


def whole_run(folder: Path, n: int) -> float:
    """Track n frames of a trial in a process of its own; return its CPU time [s], and note its peak memory."""
    words = [sys.executable, __file__, "--run", str(folder / "trial.toml"), str(n)]
    answer = subprocess.run(words, capture_output=True, text=True, check=True, env=os.environ)
    cpu_s, PEAK_GB[folder, n] = json.loads(answer.stdout.splitlines()[-1])
    return cpu_s


def run_once(path: Path, n: int) -> None:
    """Track a trial and print what it cost."""
    trial = read_trial(path, {"stop": n})
    begun = time.process_time()
    with tempfile.TemporaryDirectory() as name:
        track_trial(trial, Path(name), pictures=False)
    cpu_s = time.process_time() - begun
    peak = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
    print([cpu_s, int(peak.split()[1]) / 1e6])  # ru_maxrss would begin with the parent's


def exponent(sizes: np.ndarray, costs: np.ndarray, has_fixed_cost: bool) -> float:
    """Fit cost = b size^e, with a fixed cost a >= 0 beside it if asked, by least squares of relative errors."""
    if not has_fixed_cost or len(sizes) < 3:
        return float(np.polyfit(np.log(sizes), np.log(costs), 1)[0])
    best = (np.inf, 1.0)
    for e in np.arange(0.5, 1.6, 0.01):
        columns = np.column_stack([np.ones(len(sizes)), sizes**e]) / costs[:, None]
        ab = np.linalg.lstsq(columns, np.ones(len(sizes)), rcond=None)[0]
        if ab[0] < 0:
            ab = np.array([0.0, columns[:, 1].sum() / (columns[:, 1] ** 2).sum()])
        best = min(best, (float(np.sum((columns @ ab - 1) ** 2)), float(e)))
    return best[1]


def report(name: str, points: Points, rounds: int) -> list[dict[str, Any]]:
    """Measure in turns, print, and return rows."""
    sizes = np.array(list(points), float)
    if not name.startswith("length"):
        for cost in points.values():
            cost()  # compiles
    costs = np.array([[cost() for cost in points.values()] for _ in range(rounds)])
    values = np.array([exponent(sizes, row, has_fixed_cost=name == "length") for row in costs])
    middle, low, high = median_interval(values)
    what, unit = ("peak memory", "MB") if name.endswith("memory") else ("CPU", "ms")
    base = {"data": f"synthetic, {name}", "method": "blocker" if name == "players" else "refined", "n": rounds}
    rows = [
        {**base, "metric": f"{what} at {size:g}", "unit": unit, "value": float(1e3 * cost)}
        for size, cost in zip(sizes, np.median(costs, axis=0), strict=True)
    ]
    shown = ", ".join(f"{row['metric'].split()[-1]}: {row['value']:.3g}" for row in rows)
    print(f"{name}: {shown} {unit}; exponent {middle:.2f} [{low:.2f}, {high:.2f}]", flush=True)
    floor = {"floor": str(FLOORS[name])} if name in FLOORS else {}
    fitted = {"metric": "exponent of cost", "unit": "", "value": middle, "interval": f"{low:.2f} to {high:.2f}"}
    return [*rows, {**base, **fitted, **floor}]


def main() -> None:
    """Read the arguments and measure factor by factor."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=FACTORS, default=FACTORS)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--quick", action="store_true", help="two small sizes and one round, to see that it runs")
    parser.add_argument("--rows", action="store_true", help="append to benchmarks/results/speed.csv")
    given = parser.parse_args()
    rows = []
    for factor in given.only:
        with tempfile.TemporaryDirectory() as name:
            measured = globals()[factor](given.quick, Path(name))
            for key, points in measured.items():
                rows += report(key, points, 1 if given.quick else given.rounds)
    if given.rows:
        append("speed", rows)


if __name__ == "__main__":
    cv2.setNumThreads(1)
    if sys.argv[1:2] == ["--run"]:
        run_once(Path(sys.argv[2]), int(sys.argv[3]))
    else:
        main()
