"""Runs that are killed at random moments and resumed, and runs that are started while another writes.

`python benchmarks/kills.py kills|overlaps|studio --times N [--minutes M] [--seed K] [--cold]`: tracks two tiny trials,
a thrown cross without pictures and two players with them, and compares every file but `summary.json` and `report.html`,
which hold times, with those of a run that was left alone. `--cold` begins every chain without compiled kernels. Each
run is a process, forked from this one, that SIGKILL ends. `studio` kills an editing session and opens the folder again:
every edit that was told as done must be there, and page and frame. Prints one JSON object.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numba

from airborne.errors import AirborneError
from airborne.run import track
from airborne.synthetic.throw.writing import write_trial as write_scene
from airborne.trial.examples import example_trial
from airborne.trial.file import read_trial
from tests.support.players_trial import write_trial
from tests.support.run_files import contents_of
from tests.support.studio_edits import edits_found, kill_while_editing
from tests.support.synthetic import small_scene

WITH_TIMES = ("summary.json", "report.html")
MOST_KILLS = 4  # in a chain, before a run is left alone
EDITING_S = 3.0  # at most, before the studio is killed
REFUSED = 2  # exit code of a run that was refused in one line


def write_trials(folder: Path) -> list[Path]:
    """Write a tiny trial of a body and one of players, in a process of its own: threads do not survive a fork."""
    child = os.fork()
    if not child:
        write_scene(small_scene(), folder / "body")
        write_trial(folder / "players", 8)
        os._exit(0)
    assert wait(child) == 0
    return [folder / name / "trial.toml" for name in ("body", "players")]


def fork(trial: Path, out: Path, cache: Path | None, *, resume: bool) -> int:
    """Track in a process of its own and return its number."""
    child = os.fork()
    if child:
        return child
    code = 1
    try:
        if cache is not None:
            numba.config.CACHE_DIR = str(cache)  # type: ignore[attr-defined]
        track.track_trial(read_trial(trial), out, resume=resume, pictures=trial.parent.name == "players")
        code = 0
    except AirborneError as error:
        print(error, file=sys.stderr)
        code = REFUSED
    finally:
        os._exit(code)


def wait(child: int) -> int:
    """Wait for a process and return its exit code, negative for a signal."""
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def files_of(out: Path) -> dict[str, bytes]:
    """Return what must be the same in every run."""
    return {name: data for name, data in contents_of(out).items() if name not in WITH_TIMES}


def alone(trial: Path, out: Path, cache: Path | None) -> tuple[dict[str, bytes], float]:
    """Track without trouble, kernels compiled: the files, and how long it took [s]."""
    for number in range(2):
        start_s = time.monotonic()
        assert wait(fork(trial, out / f"{number}", cache, resume=False)) == 0
    assert files_of(out / "0") == files_of(out / "1"), "two runs that were left alone differ"
    return files_of(out / "1"), time.monotonic() - start_s


def kill_chain(trial: Path, out: Path, cache: Path | None, longest_s: float, rng: random.Random) -> int:
    """Track, killed up to MOST_KILLS times; return how often it was."""
    for n_kills in range(MOST_KILLS):
        child = fork(trial, out, cache, resume=True)
        time.sleep(rng.uniform(0, longest_s))
        with contextlib.suppress(ProcessLookupError):
            os.kill(child, signal.SIGKILL)
        if wait(child) == 0:
            return n_kills
    assert wait(fork(trial, out, cache, resume=True)) == 0
    return MOST_KILLS


def overlap(trial: Path, out: Path, cache: Path | None, longest_s: float, rng: random.Random) -> list[int]:
    """Start a run and, while it goes on, resume it; return both exit codes."""
    first = fork(trial, out, cache, resume=False)
    time.sleep(rng.uniform(0, longest_s))
    second = fork(trial, out, cache, resume=True)
    return [wait(first), wait(second)]


def kill_studio(times: int, end_s: float, rng: random.Random) -> dict[str, int]:
    """Kill an editing session of the studio at random moments; count the edits, and those that were lost."""
    counts = {"studio": 0, "edits": 0, "lost": 0}
    with tempfile.TemporaryDirectory() as name:
        folder = shutil.copytree(example_trial("thrown_cross").parent, Path(name) / "cross")
        while counts["studio"] < times and time.monotonic() < end_s:
            last = kill_while_editing(folder, EDITING_S, rng)
            counts["studio"] += 1
            counts["edits"] = last
            counts["lost"] += not all(last <= number <= last + 1 for number in edits_found(folder))
    return counts


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("what", choices=["kills", "overlaps", "studio"])
    parser.add_argument("--times", type=int, default=100)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cold", action="store_true")
    options = parser.parse_args()
    rng, end_s = random.Random(options.seed), time.monotonic() + 60 * options.minutes
    if options.what == "studio":
        print(json.dumps(kill_studio(options.times, end_s, rng)))
        return
    counts = {"chains": 0, "identical": 0, options.what: 0, "refused": 0}
    differing = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        trials = write_trials(folder)
        known = [alone(trial, folder / f"alone{k}", None) for k, trial in enumerate(trials)]
        while counts[options.what] < options.times and time.monotonic() < end_s:
            number = counts["chains"]
            trial, (expected, took_s) = trials[number % 2], known[number % 2]
            out, cache = folder / f"out{number}", folder / f"cold{number}" if options.cold else None
            longest_s = 20 * took_s if options.cold else 1.2 * took_s
            if options.what == "kills":
                counts["kills"] += kill_chain(trial, out, cache, longest_s, rng)
            else:
                codes = overlap(trial, out, cache, took_s, rng)
                counts["overlaps"] += 1
                counts["refused"] += REFUSED in codes
                assert 0 in codes and set(codes) <= {0, REFUSED}, codes
            counts["chains"] += 1
            counts["identical"] += files_of(out) == expected
            if files_of(out) != expected:
                differing.append([str(out), [k for k in expected if files_of(out).get(k) != expected[k]]])
    print(json.dumps(counts | {"differing": differing, "seconds_alone": [round(took_s, 2) for _, took_s in known]}))


if __name__ == "__main__":
    main()
