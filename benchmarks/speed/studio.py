"""How long the studio makes its user wait, in a real browser: stepping, jumping, dragging, opening long videos.

    python benchmarks/speed/studio.py [short] [long] [many] [--minutes 10] [--steps 60] [--rows]

`short`: a person moves before three 1080p cameras that show moving noise; a run's outlines lie over the pictures. Times
are the browser's, from the key or the pointer to the finished drawing, on the page Track, which has no 3D scene: a
browser without a graphics card draws that for seconds. `long`: the first picture of four long videos, jumps through
them, and through three of them. `many`: 50 runs, one of a person over 200,000 frames, one of 20 players. Memory is what
the server's process holds. They are wall times: the load of the machine is printed beside them. `--rows` appends to
benchmarks/results/studio.csv.
"""

from __future__ import annotations

import argparse
import os
import resource
import shutil
import sys
import tempfile
import time
from fractions import Fraction
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import av
import numpy as np
from rows import append

from airborne.cameras import Rig, camera_looking_at, write_pose2sim
from airborne.motion import PlayersWriter
from airborne.tracking import Status
from airborne.tracking.players import PlayerEstimate
from airborne.video import VideoWriter
from tests.support.browser import open_page
from tests.support.person_run import PERSON, PERSON_TABLE, write_person_run
from tests.support.studio import at_pixel, open_studio, wait_for_frame

SIZE, SMALL, RATE, NOISE = (1920, 1080), (640, 360), 50, 8
PLACES = {"left": [3.0, -4.0, 1.5], "right": [-4.0, -3.0, 1.2], "behind": [0.5, 5.0, 1.4]}
ARM = """() => { // the outline's outermost point at the height of the left forearm, in the first picture
    const { points } = document.querySelector("canvas.view").view.nowItems().find((each) => each.pane === 0);
    const v = points.map((point) => point[1]), top = Math.min(...v), high = Math.max(...v) - top;
    const arm = points.filter((point) => Math.abs(point[1] - top - 0.42 * high) < 0.05 * high);
    const [u, at] = arm.reduce((a, b) => a[0] > b[0] ? a : b);
    return [u - 4, at];
}"""
JUMP = """frame => new Promise((done) => { // told by the page: to look at it sixty times a second takes its time
    const canvas = document.querySelector("canvas.view");
    const end = ({ detail }) => detail.frame === frame && done(window.removeEventListener("airborne-shown", end));
    delete canvas.dataset.coarseMs;
    window.addEventListener("airborne-shown", end);
    canvas.view.go(frame);
})"""
N_JUMPS, N_DRAGS, DRAG_PX = 20, 3, 300.0
START = "[start]\nframe = 0\nposition_m = [0.0, 0.0, 1.0]\nquaternion_xyzw = [0.0, 0.0, 0.0, 1.0]\n"
PLACE = "0.15294658314806603,0.4842854493912971,1.0517079524479056,0.015421024123065537"
N_MANY, N_RUNS, N_TEAM_FRAMES = 200_000, 50, 3000
LONG, MANY = "four 1080p videos of {:g} min", "50 runs, of 200,000 frames, of 20 players"
FLOORS = {"step": 80, "jump": 300, "drag": 50, "release": 150, "open": 2000, "memory": 1000}


def write_second(path: Path, size: tuple[int, int]) -> None:
    """Write a second of a coarse pattern that moves, under noise: 8 Mbit or so."""
    rng = np.random.default_rng(0)
    coarse = rng.integers(60, 190, (size[1] // 24, size[0] // 24, 3), dtype=np.uint8)
    image = np.kron(coarse, np.ones((24, 24, 1), np.uint8))
    grain = rng.integers(0, NOISE, image.shape, dtype=np.uint8)
    with VideoWriter(path, size=(image.shape[1], image.shape[0]), rate=Fraction(RATE)) as writer:
        for k in range(RATE):
            writer.write(np.roll(image, 4 * k, axis=1) + np.roll(grain, (37 * k, 91 * k), axis=(0, 1)))


def repeat_clip(second: Path, path: Path, seconds: int) -> None:
    """Repeat the packets of a second, without encoding them again."""
    with av.open(str(second)) as source:
        packets = [packet for packet in source.demux(video=0) if packet.size]
        stamps = [(packet.pts, packet.dts) for packet in packets]
        with av.open(str(path), "w") as target:
            stream = target.add_stream_from_template(source.streams.video[0])
            for k in range(seconds):
                for packet, (pts, dts) in zip(packets, stamps, strict=True):
                    shift = round(k / packet.time_base)
                    packet.pts, packet.dts, packet.stream = pts + shift, dts + shift, stream
                    target.mux(packet)


def rig_around(places: dict[str, list[float]], size: tuple[int, int]) -> Rig:
    """Return cameras at places that look at a person who stands in the midst."""
    cameras = [camera_looking_at(name, at, [0, 0, 1.1], focal_px=1500, size=size) for name, at in places.items()]
    return Rig(tuple(cameras))


def write_trial(folder: Path, second: Path, rig: Rig, seconds: int) -> None:
    """Write a trial whose cameras show the same clip."""
    folder.mkdir()
    names = rig.names
    repeat_clip(second, folder / f"{names[0]}.mp4", seconds)
    for name in names[1:]:
        os.link(folder / f"{names[0]}.mp4", folder / f"{name}.mp4")
    write_pose2sim(folder / "calib.toml", rig)
    tables = "".join(f'[[camera]]\nname = "{name}"\nvideo = "{name}.mp4"\n' for name in names)
    (folder / "trial.toml").write_text(
        f'name = "waiting"\ncalibration = {{ file = "calib.toml" }}\n{PERSON_TABLE}\n{tables}'
    )


def step_ms(page, n: int) -> list[float]:
    """Step from frame to frame; return how long each took."""
    canvas, taken = page.locator("canvas.view"), []
    canvas.press("Home")
    wait_for_frame(page, 0)
    for frame in range(1, n + 1):
        canvas.press(".")
        wait_for_frame(page, frame)
        taken.append(shown_ms(page))
    return taken


def jump_ms(page, n_frames: int) -> tuple[list[float], list[float], list[float]]:
    """Jump to frames anywhere; return how long each took, its key frame, and the CPU time of server and browser."""
    rng, taken, coarse, cpu = np.random.default_rng(0), [], [], []
    for frame in rng.integers(0, n_frames, N_JUMPS).tolist():
        begun_ms = used_ms()
        page.evaluate(JUMP, frame)
        cpu.append(used_ms() - begun_ms)
        taken.append(shown_ms(page))
        first = page.evaluate("document.querySelector('canvas.view').dataset.coarseMs")
        coarse.append(taken[-1] if first is None else float(first))
        page.wait_for_timeout(1000)  # someone looks; pictures ahead are made
    return taken, coarse, cpu


def shown_ms(page) -> float:
    """Return how long the frame in view took."""
    return float(page.evaluate("document.querySelector('canvas.view').dataset.ms"))


def drag_ms(page, rig: Rig, steps: int) -> tuple[list[float], list[float]]:
    """Drag a forearm to and fro; return how long the outline took to follow, and the body to be solved at the end."""
    page.get_by_role("button", name="Place it by hand").click()
    page.wait_for_function("document.querySelector('canvas.view').view.nowItems().length >= 3")
    on_way, at_end = [], []
    for _ in range(N_DRAGS):
        start = np.array(page.evaluate(ARM), float)
        page.mouse.move(*at_pixel(page, 0, *start))
        page.mouse.down()
        page.mouse.move(*at_pixel(page, 0, *np.add(start, [25.0, 0.0])))
        for k in range(steps):
            angle = 2 * np.pi * k / steps
            n = count_drags(page)
            way = [25 + DRAG_PX / 2 * np.sin(angle) ** 2, -DRAG_PX / 2 * np.sin(angle / 2)]
            page.mouse.move(*at_pixel(page, 0, *np.add(start, way)))
            page.wait_for_function("n => Number(document.querySelector('canvas.view').dataset.drags || 0) > n", arg=n)
            on_way.append(float(page.evaluate("document.querySelector('canvas.view').dataset.dragMs")))
        n = count_drags(page)
        page.mouse.up()
        page.wait_for_function("n => Number(document.querySelector('canvas.view').dataset.drags || 0) > n", arg=n)
        page.wait_for_function("document.querySelector('canvas.view').view.live === null")
        at_end.append(float(page.evaluate("document.querySelector('canvas.view').dataset.dragMs")))
    return on_way, at_end


def count_drags(page) -> int:
    """Return how many movements were answered."""
    return int(page.evaluate("document.querySelector('canvas.view').dataset.drags || 0"))


def descendants() -> list[tuple[bytes, int, int]]:
    """Return the command, the CPU time [ticks] and the memory [pages] of each process that this one has started."""
    found, parents = {}, {}
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            words = status.read_text().rpartition(")")[2].split()
            line, pages = status.with_name("cmdline").read_bytes(), status.with_name("statm").read_text().split()[1]
        except OSError:  # it has ended
            continue
        pid = int(status.parent.name)
        found[pid], parents[pid] = (line, int(words[11]) + int(words[12]), int(pages)), int(words[1])
    own = {os.getpid()}
    while new := {pid for pid, parent in parents.items() if parent in own} - own:
        own |= new
    return [found[pid] for pid in own - {os.getpid()}]


def used_ms() -> float:
    """Return the CPU time so far of studio and browser, without what drives the browser."""
    ticks = [ticks for line, ticks, _ in descendants() if b"chrom" in line or b"main()" in line]
    return 1e3 * sum(ticks) / os.sysconf("SC_CLK_TCK")


def server() -> tuple[float, float]:
    """Return the memory [MB] and the CPU time so far [s] of the studio, which this process has started."""
    _, ticks, pages = next(each for each in descendants() if b"studio" in each[0] and b"main()" in each[0])
    return pages * resource.getpagesize() / 1e6, ticks / os.sysconf("SC_CLK_TCK")


def measure_short(folder: Path, second: Path, steps: int) -> dict[str, list[float]]:
    """Measure steps, jumps and drags on a clip of 20 seconds."""
    rig = rig_around(PLACES, SIZE)
    write_trial(folder, second, rig, 20)
    write_person_run(folder / "results", rig, 20 * RATE, Fraction(RATE))
    with open_studio(folder) as address, open_page(address.replace("/?", "/track?")) as page:
        wait_for_frame(page, 0)
        page.wait_for_timeout(3000)  # what the kernels compile, once
        begun_s = server()[1]
        steps_ms, stepped_s = step_ms(page, steps), server()[1]
        jumps = name_jumps("jump", jump_ms(page, 20 * RATE))
        page.goto(address.split("?")[0] + "start")
        page.wait_for_function("document.querySelector('canvas.view')?.dataset.frame !== undefined")
        before_s = server()[1]
        drags_ms, releases_ms = drag_ms(page, rig, steps)
        dragged_s = server()[1]
    cpu_ms = {
        "step, server's CPU": [1e3 * (stepped_s - begun_s) / steps],
        "drag, server's CPU": [1e3 * (dragged_s - before_s) / len(drags_ms)],
    }
    return {"step": steps_ms, **jumps, "drag": drags_ms[5:], "release": releases_ms, **cpu_ms}


def name_jumps(kind: str, measured: tuple[list[float], list[float], list[float]]) -> dict[str, list[float]]:
    """Name what `jump_ms` returns."""
    whole, coarse, cpu = measured
    return {kind: whole, f"{kind}, to the key frame before": coarse, f"{kind}, CPU of server and browser": cpu}


def measure_long(folder: Path, second: Path, minutes: float) -> dict[str, list[float]]:
    """Measure the first picture of four long videos, memory after jumps through them, and jumps through three."""
    places = {name: [4 * np.cos(k), 4 * np.sin(k), 1.5] for k, name in enumerate("abcd")}
    write_trial(folder, second, rig_around(places, SIZE), round(60 * minutes))
    text, n_frames = (folder / "trial.toml").read_text(), round(60 * minutes) * RATE
    (folder / "three.toml").write_text(text.rpartition("[[camera]]")[0])
    with open_studio(folder / "three.toml") as address, open_page(address) as page:
        page.goto("/".join(address.split("/")[:3]) + "/track")
        wait_for_frame(page, 0)
        page.wait_for_timeout(3000)  # what the kernels compile, once
        three = name_jumps("three cameras: long jump", jump_ms(page, n_frames))
    shutil.rmtree(folder / ".airborne")  # where it was, and when each picture is shown
    with open_studio(folder) as address, open_page(address) as page:
        page.get_by_text("Use these cameras").wait_for()
        begun = time.monotonic()
        page.goto(address.split("?")[0] + "track")
        wait_for_frame(page, 0)
        taken_ms = 1e3 * (time.monotonic() - begun)
        jumps = name_jumps("long jump", jump_ms(page, n_frames))
        return {"open": [taken_ms], **jumps, "memory": [server()[0]], **three}


def measure_many(folder: Path, second: Path) -> dict[str, list[float]]:
    """Measure Review and Results of a folder with 50 runs, one of them of 200,000 frames, one of 20 players."""
    rig = rig_around(PLACES, SMALL)
    write_trial(folder, second, rig, N_MANY // RATE)
    with (folder / "trial.toml").open("a") as file:
        file.write(START)
    write_person_run(folder / "results", rig, RATE, Fraction(RATE))
    runs = folder / "results"
    for k in range(N_RUNS - 2):
        shutil.copytree(runs, folder / f"short{k}")
    header, *lines = (runs / "motion.csv").read_text().splitlines()
    (runs / "covariance.bin").unlink()  # 26 kB a frame
    with (runs / "motion.csv").open("w") as file:
        file.write(header + "\n")
        for k in range(N_MANY):
            file.write(f"{k},{k / RATE!r},{lines[k % RATE].split(',', 2)[2]}\n")
    with (runs / "joints.csv").open("w") as file:
        file.write("frame,time_s,joint,x_m,y_m,z_m,sd_m,status\n")
        for k in range(N_MANY):
            status = "uncertain" if k % 5000 == 0 else "tracked"
            file.writelines(f"{k},{k / RATE!r},{each.name},{PLACE},{status}\n" for each in PERSON.landmarks)
    write_team(folder / "team", runs)
    os.utime(runs)  # the newest is shown first
    with open_studio(folder) as address, open_page(address) as page:
        found = {"results, for the first time: Review open": [review_ms(page, address)]}
    with open_studio(folder) as address, open_page(address) as page:
        for name, n_frames in (("results", N_MANY), ("team", N_TEAM_FRAMES)):
            os.utime(folder / name)
            found |= {f"{name}: Review open": [review_ms(page, address)]}
            found |= {f"{name}: step": step_ms(page, 20), f"{name}: jump": jump_ms(page, n_frames)[0]}
            page.evaluate("document.querySelector('canvas.view').view.go(0)")
            wait_for_frame(page, 0)
        begun = time.monotonic()
        page.goto("/".join(address.split("/")[:3]) + "/results")
        page.get_by_text("short0").first.wait_for()
        return {**found, "Results open": [1e3 * (time.monotonic() - begun)], "many, memory": [server()[0]]}


def review_ms(page, address: str) -> float:
    """Open Review; return how long it took until pictures and curves were there."""
    begun = time.monotonic()
    page.goto("/".join(address.split("/")[:3]) + "/review")  # it opens again where it was
    wait_for_frame(page, 0)
    page.wait_for_function("Number(document.querySelector('canvas.curves')?.dataset.frames) > 0")
    return 1e3 * (time.monotonic() - begun)


def write_team(run: Path, like: Path) -> None:
    """Write a run of 20 players who move."""
    run.mkdir()
    shutil.copyfile(like / "calib.toml", run / "calib.toml")
    joints = tuple(f"{limb}_{side}" for limb in ("hip", "knee", "ankle", "foot") for side in ("left", "right"))
    leg = np.array([[0.0, 0, 1.0], [0, 0, 0.5], [0, 0, 0.1], [0.2, 0, 0]])
    home = np.random.default_rng(0).uniform([-2, -2, 0], [2, 2, 0.1], (20, 1, 3)) + np.repeat(leg, 2, axis=0)
    facts = {"covariance": np.broadcast_to(1e-4 * np.eye(3), (8, 3, 3)), "score": 1.0, "n_views": 3}
    facts |= {"joint_status": (Status.TRACKED,) * len(joints)}
    with PlayersWriter(run / "joints.csv", joints) as writer:
        for k in range(N_TEAM_FRAMES):
            points = home + np.array([0.3 * np.sin(0.05 * k), 0, 0])
            time_s = Fraction(k, RATE)
            writer.append(
                [
                    PlayerEstimate(index=k, time_s=time_s, player=f"player{n}", points=each, **facts)
                    for n, each in enumerate(points)
                ]
            )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", help="short, long, many; without any all of them")
    parser.add_argument("--minutes", type=float, default=10.0, help="of the long videos")
    parser.add_argument("--steps", type=int, default=60)
    parser.add_argument("--rows", action="store_true", help="append to benchmarks/results/studio.csv")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=Path.home()) as name:
        folder = Path(name)
        write_second(folder / "second.mp4", SIZE)
        write_second(folder / "small.mp4", SMALL)
        ways = {
            "short": ("three 1080p cameras", lambda: measure_short(folder / "s", folder / "second.mp4", given.steps)),
            "long": (
                LONG.format(given.minutes),
                lambda: measure_long(folder / "l", folder / "second.mp4", given.minutes),
            ),
            "many": (MANY, lambda: measure_many(folder / "m", folder / "small.mp4")),
        }
        for part in given.parts or ways:
            data, measure = ways[part]
            before = os.getloadavg()[0]
            found = measure()
            load = f"load {before:.1f} to {os.getloadavg()[0]:.1f} of {os.cpu_count()} cores"
            rows = [make_row(data, load, key, values) for key, values in found.items()]
            print(data, load, flush=True)
            for row in rows:
                print(f"{row['metric']:<38}{row['value']:>8.1f} {row['unit']}  floor {row['floor']}  {row['interval']}")
            if given.rows:
                append("studio", rows)


def make_row(data: str, load: str, key: str, values: list[float]) -> dict[str, object]:
    """Return what is kept of a measurement; its kind is the key's last word."""
    return {
        "data": data,
        "method": load,
        "metric": f"{key}, {'95th percentile' if len(values) > 1 else 'once'}",
        "unit": "MB" if key.endswith("memory") else "ms",
        "value": float(np.percentile(values, 95)),
        "n": len(values),
        "floor": FLOORS.get(key.split()[-1], ""),
        "interval": f"median {np.median(values):.3g}",
    }


if __name__ == "__main__":
    main()
