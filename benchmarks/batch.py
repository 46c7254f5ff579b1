"""A season of trials: `python benchmarks/batch.py WHAT [--trials N] [--workers N] [--quick]`, one row for each figure.

`one` tracks the trials one after the other in this process, and again with workers: ratio of wall times, bytes.
`kills` kills a worker every ten seconds, five times. `scheduler` kills the batch half way, and gives the command again.
`broken` breaks 20 trials, in 20 ways. `address` has a scheduler and two workers started by hand. `simulated` does 2,000
tasks that do nothing. `coverage` compares 200 synthetic studies with a known difference, and 200 without, and tests 200
pairs of curves without. Trials are copies of four synthetic throws, 20 small pictures each of three cameras. `--quick`
takes a tenth of everything, and appends nothing to benchmarks/results.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
import psutil
import rows
from scipy.ndimage import gaussian_filter1d

from airborne.batch.cluster import do_tasks, import_for_workers, open_client
from airborne.batch.task import Task
from airborne.batch.trials import list_trials
from airborne.run.track import track_trial
from airborne.study.random_effects import Cells, estimate_difference
from airborne.study.spm import compare_curves
from airborne.synthetic.throw.writing import write_trial
from airborne.trial.file import read_trial
from tests.support import batch_work
from tests.support.broken_trials import WAYS
from tests.support.run_files import contents_of
from tests.support.synthetic import small_scene

N_SCENES, N_PICTURES = 4, 20
N_KILLS, KILL_EVERY_S = 5, 10.0
WITH_TIMES = ("summary.json", "report.html")


def write_season(folder: Path, n: int) -> Path:
    """Write n trials, copies of a few throws."""
    for k in range(min(N_SCENES, n)):
        scene = small_scene("half-twist", n_pictures=N_PICTURES, is_interlaced=False, is_surveyed=False, seed=k)
        write_trial(scene, folder / f"t{k:03}")
    for k in range(N_SCENES, n):
        shutil.copytree(folder / f"t{k % N_SCENES:03}", folder / f"t{k:03}")
    return folder


def command(*words: str | Path) -> list[str]:
    """Return a command of Airborne as a process of its own."""
    code = "import sys; sys.argv[0] = 'airborne'; from airborne.cli import main; main()"
    return [sys.executable, "-c", code, *map(str, words)]


def batch(season: Path, out: Path, *words: str | Path) -> dict:
    """Give the command of a batch, and return what it prints as JSON."""
    done = subprocess.run(
        command("batch", season, "-o", out, "--no-pictures", "--json", *words), stdout=subprocess.PIPE
    )
    return json.loads(done.stdout) | {"code": done.returncode}


def results_of(out: Path) -> dict[str, bytes]:
    """Return the bytes of all runs' files but those that hold times."""
    files = contents_of(out)
    return {name: data for name, data in files.items() if re.match(r"t\d+/", name) and not name.endswith(WITH_TIMES)}


def alone(season: Path, out: Path, most: int | None = None) -> float:
    """Track the trials, or the first of them, one after the other in this process; return the wall time [s]."""
    paths = sorted(season.glob("*/trial.toml"))[:most]
    track_trial(read_trial(paths[0]), out / "warm", pictures=False)
    shutil.rmtree(out / "warm")
    start_s = time.monotonic()
    for path in paths:
        track_trial(read_trial(path), out / path.parent.name, pictures=False)
    return time.monotonic() - start_s


def expected(season: Path, out: Path, n: int) -> dict[str, bytes]:
    """Return the results of n single runs: of each throw once, as the others are its copies."""
    alone(season, out, N_SCENES)
    known = results_of(out)
    return {
        name.replace(name[:4], f"t{k:03}", 1): data
        for k in range(n)
        for name, data in known.items()
        if name.startswith(f"t{k % N_SCENES:03}/")
    }


def bench_one(folder: Path, n: int, workers: int) -> list[dict]:
    season = write_season(folder / "season", n)
    one_s = alone(season, folder / "one")
    start_s = time.monotonic()
    import_for_workers()
    tasks = [Task(trial, folder / "many", pictures=False) for trial in list_trials(str(season))]
    with open_client(None, workers, "auto") as client:
        started_s = time.monotonic() - start_s
        assert all(outcome.status == "done" for outcome in do_tasks(client, tasks))
    many_s = time.monotonic() - start_s
    same = results_of(folder / "one") == results_of(folder / "many")
    what = {"data": f"{n} trials of {N_PICTURES} frames", "method": f"{workers} workers", "n": n}
    return [
        what | {"metric": "wall, one process", "unit": "s", "value": one_s},
        what | {"metric": "wall, workers, their start included", "unit": "s", "value": many_s},
        what | {"metric": "start of the workers", "unit": "s", "value": started_s},
        what | {"metric": "ratio of wall times", "unit": "1", "value": many_s / one_s, "floor": "0.6"},
        what | {"metric": "results identical", "unit": "bool", "value": int(same), "floor": "1"},
    ]


def bench_kills(folder: Path, n: int, workers: int) -> list[dict]:
    season = write_season(folder / "season", n)
    known = expected(season, folder / "one", n)
    tasks = [Task(trial, folder / "many", pictures=False) for trial in list_trials(str(season))]
    killed: list[int] = []
    with open_client(None, workers, "auto") as client:

        def kill() -> None:
            for _ in range(N_KILLS):
                time.sleep(KILL_EVERY_S)
                found = list(client.run(os.getpid).values())
                if found:
                    os.kill(found[len(killed) % len(found)], signal.SIGKILL)
                    killed.append(found[0])

        threading.Thread(target=kill, daemon=True).start()
        ends = [outcome.status for outcome in do_tasks(client, tasks)]
    same = known == results_of(folder / "many")
    what = {"data": f"{n} trials of {N_PICTURES} frames", "method": f"{workers} workers", "n": n}
    return [
        what | {"metric": "workers killed", "unit": "1", "value": len(killed), "floor": str(N_KILLS)},
        what | {"metric": "trials finished", "unit": "1", "value": n - ends.count("failed"), "floor": str(n)},
        what | {"metric": "results identical after kills", "unit": "bool", "value": int(same), "floor": "1"},
    ]


def bench_scheduler(folder: Path, n: int, workers: int) -> list[dict]:
    season, out = write_season(folder / "season", n), folder / "out"
    words = ("batch", season, "-o", out, "--no-pictures", "--workers", workers)
    process = subprocess.Popen(command(*words), start_new_session=True, stderr=subprocess.DEVNULL)
    while len(list(out.glob("*/summary.json"))) < n // 2:
        time.sleep(0.5)
    os.killpg(process.pid, signal.SIGKILL)  # the command, its scheduler and its workers
    process.wait()
    finished = len(list(out.glob("*/summary.json")))
    again = batch(season, out, "--workers", str(workers))
    what = {"data": f"{n} trials, scheduler killed", "method": f"{workers} workers", "n": n}
    left = n - finished
    return [
        what | {"metric": "trials left at the kill", "unit": "1", "value": left},
        what | {"metric": "trials tracked again", "unit": "1", "value": again["counts"]["done"], "floor": str(left)},
        what | {"metric": "exit code", "unit": "1", "value": again["code"], "floor": "0"},
    ]


def bench_broken(folder: Path, n: int, workers: int) -> list[dict]:
    season = write_season(folder / "season", n)
    one = expected(season, folder / "one", n)
    for way, path in zip(WAYS, sorted(season.iterdir())[: min(len(WAYS), n)], strict=False):
        WAYS[way](path)
    found = batch(season, folder / "many", "--workers", str(workers))
    many = results_of(folder / "many")
    right = [name for name in many if name.endswith("motion.csv") and many[name] == one[name]]
    lines = [error for error in found["failed"].values() if error and "\n" not in error and "unexpected" not in error]
    what = {"data": f"{n} trials, {min(len(WAYS), n)} broken", "method": f"{workers} workers", "n": n}
    return [
        what | {"metric": "trials right", "unit": "1", "value": len(right), "floor": str(n - min(len(WAYS), n))},
        what | {"metric": "failures of one line", "unit": "1", "value": len(lines), "floor": str(min(len(WAYS), n))},
        what | {"metric": "exit code", "unit": "1", "value": found["code"], "floor": "1"},
    ]


def bench_address(folder: Path, n: int, workers: int) -> list[dict]:
    season, file = write_season(folder / "season", n), folder / "scheduler.json"
    dask = shutil.which("dask", path=Path(sys.executable).parent) or "dask"
    here = [dask, "scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file), "--no-dashboard"]
    started = [subprocess.Popen(here, cwd=folder, stderr=subprocess.DEVNULL)]
    try:
        while not file.is_file():
            time.sleep(0.2)
        address = json.loads(file.read_text())["address"]
        joined = [dask, "worker", address, "--nthreads", "1", "--nworkers", str(workers), "--no-dashboard"]
        started.append(subprocess.Popen(joined, cwd=folder, stderr=subprocess.DEVNULL))
        found = batch(season, folder / "many", "--scheduler", address)
    finally:
        for process in reversed(started):
            process.terminate()
            process.wait()
    same = expected(season, folder / "one", n) == results_of(folder / "many")
    what = {"data": f"{n} trials by address", "method": f"{workers} workers", "n": n}
    return [
        what | {"metric": "trials tracked", "unit": "1", "value": found["counts"]["done"], "floor": str(n)},
        what | {"metric": "results identical", "unit": "bool", "value": int(same), "floor": "1"},
    ]


def bench_simulated(folder: Path, n: int, workers: int) -> list[dict]:
    n *= 10
    with open_client(None, workers, "auto") as client:
        list(do_tasks(client, batch_work.tasks(folder / "warm", workers), work=batch_work.sleep_shortly))
        start_s = time.monotonic()
        ended = len(list(do_tasks(client, batch_work.tasks(folder, n), work=batch_work.sleep_shortly)))
        took_s = time.monotonic() - start_s
        memory_gb = psutil.Process().memory_info().rss / 1e9  # the scheduler lives in this process
    overhead_ms = 1e3 * (took_s - n * batch_work.SLEEP_S / workers) / n
    what = {"data": f"{n} simulated tasks", "method": f"{workers} workers", "n": ended}
    return [
        what | {"metric": "overhead a trial", "unit": "ms", "value": overhead_ms, "floor": "50"},
        what | {"metric": "memory of scheduler and client", "unit": "GB", "value": memory_gb, "floor": "1"},
    ]


def draw_study(rng: np.random.Generator, effect: float) -> Cells:
    """Draw a number of 8 athletes, 3 to 6 trials in each of two conditions, measured with an sd of 0.5."""
    drawn = []
    for athlete in range(8):
        level, own = rng.normal(0, 2), effect + rng.normal(0, 0.5)
        for condition in (0, 1):
            trials = level + own * condition + rng.normal(0, np.hypot(1.0, 0.5), rng.integers(3, 7))
            drawn += [(value, athlete, condition) for value in trials]
    values, athlete, condition = (np.array(column) for column in zip(*drawn, strict=True))
    variance = np.full((len(values), 1), 0.25)
    return Cells(values=values[:, None], variance=variance, athlete=athlete, condition=condition)


def draw_curves(rng: np.random.Generator) -> Cells:
    """Draw smooth curves of 8 athletes, two trials in each of two conditions that do not differ."""
    athlete, condition = np.repeat(np.arange(8), 4), np.tile([0, 0, 1, 1], 8)
    values = gaussian_filter1d(rng.normal(size=(32, 101)), 10, axis=1)
    values += gaussian_filter1d(rng.normal(size=(8, 101)), 10, axis=1)[athlete]
    return Cells(values=values, variance=np.zeros_like(values), athlete=athlete, condition=condition)


def bench_coverage(folder: Path, n: int, workers: int) -> list[dict]:
    rng = np.random.default_rng(17)
    found = [estimate_difference(draw_study(rng, 1.0), 0, 1) for _ in range(n)]
    covered = np.mean([each.low[0] <= 1.0 <= each.high[0] for each in found])
    alarms = np.mean([estimate_difference(draw_study(rng, 0.0), 0, 1).p[0] < 0.05 for _ in range(n)])
    curves = [compare_curves(estimate_difference(draw_curves(rng), 0, 1), 0.05) for _ in range(n)]
    what = {"data": "8 athletes, 2 conditions", "method": "compare", "n": n, "unit": "%"}
    return [
        what | {"metric": "95 % intervals that hold the difference", "value": 100 * covered, "floor": "93 to 97"},
        what | {"metric": "false alarms, numbers", "value": 100 * alarms, "floor": "3 to 7"},
        what
        | {
            "metric": "false alarms, curves",
            "value": 100 * np.mean([bool(each.clusters) for each in curves]),
            "floor": "3 to 7",
        },
    ]


BENCHES = {
    "one": bench_one,
    "kills": bench_kills,
    "scheduler": bench_scheduler,
    "broken": bench_broken,
    "address": bench_address,
    "simulated": bench_simulated,
    "coverage": bench_coverage,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=BENCHES)
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--quick", action="store_true")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        n = max(given.trials // 10, 1) if given.quick else given.trials
        measured = BENCHES[given.what](Path(folder), n, given.workers)
    if given.quick:
        for row in measured:
            print(f"{row['data']:<40}{row['metric']:<45}{row['value']:>8.3g} {row['unit']}  (floor {row.get('floor')})")
    else:
        rows.append("batch", measured)


if __name__ == "__main__":
    main()
