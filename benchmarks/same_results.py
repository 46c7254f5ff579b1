"""Do two revisions give the same bytes? `python benchmarks/same_results.py record DIR`, then `... compare DIR DIR`.

`record` tracks a reference set with the code that is imported: the example by two methods, a synthetic somersault,
and where shared/data lies beside the project the recordings block_jump and balance, the latter with a fitted body. Set
PYTHONPATH to another checkout's `src` to record that one. Run it twice on a fresh checkout of a revision from before
kernels gave the same bytes compiled or loaded. `compare` names every table that differs, and by how much.
"""

from __future__ import annotations

import argparse
import csv
import math
import subprocess
import sys
from itertools import zip_longest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from rows import ROOT

DATA = ROOT.parent / "shared" / "data"
CROSS = ROOT / "examples" / "thrown_cross" / "trial.toml"
SAVED = "saved_scale = 1.00741\nsaved_offset_px = [0.0, -7.11]\n"
PRESET = 'preset = "human18"\nstature_m = 1.72\nmass_kg = 66.0\n'


def airborne(*words: str | Path) -> None:
    """Run a command of Airborne in a process of its own."""
    code = "import sys; sys.argv[0] = 'airborne'; from airborne.cli import main; main()"
    subprocess.run([sys.executable, "-c", code, *map(str, words)], check=True, stdout=subprocess.DEVNULL)


def balance_trial(path: Path, body: str) -> Path:
    """Write the trial of the recording `balance`."""
    data = DATA / "balance"
    cameras = "".join(
        f'[[camera]]\nname = "{name}"\nvideo = "{(data / name).as_posix()}.mp4"\n{SAVED if name < "cam03" else ""}'
        for name in ("cam01", "cam02", "cam03", "cam04")
    )
    path.write_text(
        f'name = "balance"\n{cameras}[calibration]\nfile = "{data.as_posix()}/Calib.qca.txt"\nmend = ["cam03"]\n'
        f'[body]\n{body}[start]\ndetections = "{data.as_posix()}/detections_2d.npz"\n'
    )
    return path


def record(folder: Path) -> None:
    """Track the reference set into a new folder."""
    folder.mkdir(parents=True)
    airborne("track", CROSS, "-o", folder / "cross", "--no-pictures")
    airborne("track", CROSS, "-o", folder / "stepping", "--method", "stepping", "--every", 4, "--no-pictures")
    airborne("synth", "somersault", "-o", folder / "scene", "--preset", "moving-arms", "--seed", 5)
    airborne("track", folder / "scene" / "trial.toml", "-o", folder / "somersault", "--no-pictures")
    if not DATA.is_dir():
        print(f"{DATA} is missing: block_jump and balance are left out")
        return
    airborne("track", DATA / "block_jump" / "trial.toml", "-o", folder / "block", "--no-pictures")
    airborne("fit-body", balance_trial(folder / "fit.toml", PRESET), "-o", folder / "person.toml")
    trial = balance_trial(folder / "balance.toml", 'file = "person.toml"\n')
    airborne("track", trial, "-o", folder / "balance", "--every", 2, "--no-pictures")


def tables(folder: Path) -> dict[str, Path]:
    """Return the tables of a recorded set by run and name, wherever in the run's folder they lie."""
    runs = [path for path in folder.iterdir() if path.is_dir() and path.name != "scene"]
    found = {f"{run.name}/{path.name}": path for run in runs for path in run.rglob("*.csv")}
    return found | {path.name: path for path in folder.glob("person.toml")}


def difference(first: Path, second: Path) -> str:
    """Say in a few words how two tables differ."""
    rows = [list(csv.reader(path.read_text().splitlines())) for path in (first, second)]
    n_cells, most = 0, 0.0
    for a, b in zip_longest(*rows, fillvalue=[]):
        for x, y in zip_longest(a, b, fillvalue=""):
            if x != y:
                n_cells += 1
                try:
                    most = max(most, abs(float(x) - float(y)))
                except ValueError:
                    most = math.inf
    return f"{n_cells} cells, by {most:.2g} at most"


def compare(first: Path, second: Path) -> int:
    """Print what differs; return 1 where anything does."""
    ours, theirs = tables(first), tables(second)
    differs = [name for name in ours.keys() & theirs.keys() if ours[name].read_bytes() != theirs[name].read_bytes()]
    for name in sorted(differs):
        print(f"{name}: {difference(ours[name], theirs[name])}")
    for name in sorted(ours.keys() ^ theirs.keys()):
        print(f"{name}: in one of the folders only")
    print(f"{len(ours.keys() & theirs.keys())} tables compared, {len(differs)} differ")
    return 1 if differs or ours.keys() ^ theirs.keys() else 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("action", choices=("record", "compare"))
    parser.add_argument("folders", nargs="+", type=Path)
    given = parser.parse_args()
    if given.action == "record":
        record(given.folders[0])
    else:
        sys.exit(compare(*given.folders[:2]))
