"""Is this tree faster or slower than another revision? `python benchmarks/speed/compare.py REV [--only ROAD ...]`.

Both are timed in turns in one run, each in a process of its own on one thread, so that a machine that slows down slows
both. Roads: `thing` tracks the bundled example and `person` a synthetic somersault, decoded beforehand; `recorded` a
person in four videos, `../shared/data/somersault_1` (left out, saying so, where it is missing), from five starts a hair
apart, for how often limbs are searched for hangs on the last digits, and `player` a synthetic block, both decoding
included; `command` runs `airborne track` on the example from start to report. Printed: CPU time of a frame or of the
run, and the median of the pairs' ratios with its interval of 95 %; above 1 this tree is slower. Where the yardstick
lies beside the project (`../shared/yardstick`, needs g++), times are also in C, its time for one hypothesis, measured
in the same turns. REV must have this tree's Python interface: since October 2026.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binom

ROOT = Path(__file__).resolve().parents[2]
YARDSTICK = ROOT.parent / "shared" / "yardstick"
AIRBORNE = "import sys; sys.argv[0] = 'airborne'; from airborne.cli import main; main()"
EXAMPLE = ROOT / "examples" / "thrown_cross" / "trial.toml"
RECORDING = ROOT.parent / "shared" / "data" / "somersault_1" / "trial.toml"
# starts of the recording, and by how much they differ [m, rad]: next to nothing beside the 15 mm by which a start that
# was set by hand is off, and enough that searches differ; five, as single ones differed by a tenth
N_STARTS, START_SD = 5, 2e-4
STOP = {"person": 12, "player": 40}  # frames that are tracked
ROADS = ("thing", "person", "recorded", "player", "command")
LEVEL = 0.95  # of the intervals
PROCESS_ROUNDS = 3  # after which both start anew: a process may be lucky with its memory for as long as it lives


def tracking(
    trial_file: Path, stop: int | None, *, keep: bool, seed: int | None = None
) -> Callable[[], tuple[float, int]]:
    """Return a call that tracks a trial and returns its CPU time [s] and number of frames.

    seed: of how a body's start is moved; None: not at all.
    """
    from airborne.run.body import BodyRun
    from airborne.run.opening import open_trial
    from airborne.run.players import PlayersRun
    from airborne.tracking.tracker import track_frames
    from airborne.trial.file import read_trial

    trial = read_trial(trial_file, {} if stop is None else {"stop": stop})
    opened = open_trial(trial)
    frames = list(opened.recording) if keep else opened.recording
    subject: Any = PlayersRun.open(trial, opened) if trial.has_players else BodyRun.open(trial, opened)
    if seed is not None:
        moved = np.random.default_rng(seed).normal(0, START_SD, (2, 3))
        subject = replace(subject, start=subject.start.move(*moved))
    subject = subject.see(next(iter(frames)))

    def steps() -> Any:
        if hasattr(subject, "track"):
            return subject.track(frames, lambda found: None, {}, lambda n_done: None)
        return track_frames(subject.tracker(), frames, lambda found: None)  # of revisions without keys

    def track() -> tuple[float, int]:
        begun = time.process_time()
        n = sum(1 for _ in steps())
        return time.process_time() - begun, n

    return track


def recorded() -> tuple[float, int]:
    """Track the recording from each start, one after the other; return the CPU time [s] and number of frames."""
    times = [tracking(RECORDING, None, keep=False, seed=seed)() for seed in range(N_STARTS)]
    return sum(seconds for seconds, _ in times), sum(n for _, n in times)


def command() -> tuple[float, int]:
    """Run `airborne track` on the example; return its CPU time [s] and 1."""
    with tempfile.TemporaryDirectory() as folder:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        words = "track", str(EXAMPLE), "-o", str(Path(folder) / "run")
        subprocess.run([sys.executable, "-c", AIRBORNE, *words], check=True, stdout=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, 1


def work(road: str, scenes: Path) -> None:
    """Time a road once for every line on stdin, after a first time that compiles; answer `seconds frames`."""
    if road in ("command", "recorded"):
        measure = command if road == "command" else recorded
    else:
        trial = EXAMPLE if road == "thing" else scenes / road / "trial.toml"
        measure = tracking(trial, STOP.get(road), keep=road in ("thing", "person"))
    measure()
    print("ready", flush=True)
    for _ in sys.stdin:
        print(*measure(), flush=True)


class Worker:
    """A process that times one road with one revision's code."""

    def __init__(self, tree: Path, road: str, scenes: Path) -> None:
        threads = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1")
        environment = {**os.environ, **threads, "PYTHONPATH": str(tree / "src")}
        words = [sys.executable, __file__, "--work", road, str(scenes)]
        self.process = subprocess.Popen(
            words, env=environment, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        assert self.process.stdout is not None
        if self.process.stdout.readline() != "ready\n":
            sys.exit(f"{tree}: the road '{road}' does not run with this revision's code")

    def measure(self) -> float:
        """Return the CPU time of a frame [s]."""
        assert self.process.stdin is not None and self.process.stdout is not None
        self.process.stdin.write("go\n")
        self.process.stdin.flush()
        seconds, n = self.process.stdout.readline().split()
        return float(seconds) / int(n)

    def close(self) -> None:
        """End the process."""
        self.process.communicate()


def checked_out(revision: str) -> Path:
    """Return a checkout of a revision, kept with what it has compiled."""
    git = ["git", "-C", str(ROOT)]
    answer = subprocess.run([*git, "rev-parse", f"{revision}^{{commit}}"], capture_output=True, text=True, check=False)
    if answer.returncode:
        sys.exit(f"{revision}: there is no such revision; give a branch, a tag or a commit")
    commit = answer.stdout.strip()
    folder = ROOT / "build" / "revisions" / commit[:10]
    if not folder.is_dir():
        subprocess.run(["git", "clone", "--quiet", "--shared", "--no-checkout", str(ROOT), str(folder)], check=True)
        subprocess.run(["git", "-C", str(folder), "checkout", "--quiet", commit], check=True)
    return folder


def yardstick() -> Callable[[], float] | None:
    """Return a call that times a hypothesis by the yardstick [s]; None where it is missing."""
    if not (YARDSTICK / "score18.cpp").is_file():
        return None
    sys.path.insert(0, str(YARDSTICK))
    import run  # pyright: ignore[reportMissingImports]

    score, poses = run.Yardstick("sd"), run.hypotheses(100)

    def measure() -> float:
        begun = time.thread_time()
        score(poses)
        return (time.thread_time() - begun) / len(poses)

    return measure


def median_interval(values: np.ndarray) -> tuple[float, float, float]:
    """Return the median of values and its interval by order statistics, of 95 % or what so few values allow."""
    ranked, n = np.sort(values), len(values)
    left_out = max(int(binom.ppf((1 - LEVEL) / 2, n, 0.5)) - 1, 0)
    return float(np.median(ranked)), float(ranked[left_out]), float(ranked[n - 1 - left_out])


def compare(road: str, trees: tuple[Path, Path], scenes: Path, rounds: int, bound: Callable[[], float] | None) -> None:
    """Time a road with both trees in turns and print the result."""
    times, bounds = np.empty((rounds, 2)), np.full(rounds, np.nan)
    workers: list[Worker] = []
    for k in range(rounds):
        if k % PROCESS_ROUNDS == 0:
            for worker in workers:
                worker.close()
            workers = [Worker(tree, road, scenes) for tree in trees]
        order = (0, 1) if k % 2 else (1, 0)  # neither is always first
        for which in order:
            times[k, which] = workers[which].measure()
        bounds[k] = np.nan if bound is None else bound()
    for worker in workers:
        worker.close()
    ratio, low, high = median_interval(times[:, 0] / times[:, 1])
    now, then = np.median(times, axis=0) * 1e3
    in_c = ""
    if bound is not None and road != "command":
        in_c = "  ({:.0f} C, {:.0f} C)".format(*np.median(times / bounds[:, None], axis=0))
    print(f"{road:<8}{now:9.2f} ms now{then:9.2f} ms then{in_c}  ratio {ratio:.3f} [{low:.3f}, {high:.3f}]", flush=True)


def main() -> None:
    """Read the arguments, make the scenes, compare road by road."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("revision", help="a branch, a tag or a commit")
    parser.add_argument("--only", nargs="+", choices=ROADS, default=ROADS)
    parser.add_argument("--rounds", type=int, default=9)
    given = parser.parse_args()
    trees = ROOT, checked_out(given.revision)
    with tempfile.TemporaryDirectory() as name:
        scenes = Path(name)
        synth = {"person": ("somersault", "--preset", "moving-arms", "--seed", "5"), "player": ("block", "--seed", "3")}
        for road, words in synth.items():
            if road in given.only:
                environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
                made = [sys.executable, "-c", AIRBORNE, "synth", *words, "-o", str(scenes / road)]
                subprocess.run(made, env=environment, check=True, stdout=subprocess.DEVNULL)
        bound = yardstick()
        for road in given.only:
            if road == "recorded" and not RECORDING.is_file():
                print(f"recorded: there is no {RECORDING.parent.name} beside the project; left out")
                continue
            compare(road, trees, scenes, given.rounds, bound)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--work"]:
        work(sys.argv[2], Path(sys.argv[3]))
    else:
        main()
