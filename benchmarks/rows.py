"""One measurement, one row: what was measured, on what, with which code and machine.

`python benchmarks/rows.py` lists the newest row of every measurement, and marks those that are older than the last
change of the code that they measure.
"""

from __future__ import annotations

import csv
import platform
import subprocess
from datetime import date
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
MEASURED = {  # rooms of src/airborne that the rows of a file measure; of other files the whole package
    "speed": ("appearance", "kernels", "rendering", "tracking", "video"),
    "calibration": ("calibration", "cameras"),
    "calibration_file": ("calibration", "cameras", "tracking"),
    "few_points": ("calibration", "cameras"),
    "sync": ("sync", "video"),
    "jumps": ("motion/jumps", "synthetic/block", "tracking/capsules"),
    "find_start": ("appearance", "run", "tracking/first_pose"),
}
COLUMNS = ("date", "commit", "machine", "data", "method", "metric", "unit", "value", "n", "floor", "interval")


def append(name: str, rows: list[dict]) -> None:
    """Append rows to benchmarks/results/<name>.csv and print them."""
    path = ROOT / "benchmarks" / "results" / f"{name}.csv"
    common = {"date": date.today().isoformat(), "commit": _commit(), "machine": _machine()}
    is_new = not path.exists()
    with path.open("a", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, restval="")
        if is_new:
            writer.writeheader()
        for row in rows:
            value = f"{row['value']:.3g}" if isinstance(row["value"], float) else row["value"]
            writer.writerow({**common, **row, "value": value})
            floor = f"  (floor {row['floor']})" if row.get("floor") else ""
            what = f"{row['data']:<40} {row['method']:<12} {row['metric']:<40}"
            print(f"{what} {value:>8} {row['unit']}{floor}", flush=True)


def newest_rows(path: Path) -> list[dict[str, str]]:
    """Return the last row of each measurement of a file."""
    with path.open(newline="", encoding="utf-8") as file:
        return list({(row["data"], row["method"], row["metric"]): row for row in csv.DictReader(file)}.values())


def changes_since(commit: str, paths: list[str], root: Path = ROOT) -> int | None:
    """Count the commits that have changed some paths since a commit; None where that is not in the history."""
    answer = _git("rev-list", "--count", f"{commit}..HEAD", "--", *paths, root=root)
    return int(answer) if answer else None


def main() -> None:
    """List the rows."""
    for path in sorted((ROOT / "benchmarks" / "results").glob("*.csv")):
        paths = [f"src/airborne/{room}" for room in MEASURED.get(path.stem, ("",))]
        print(f"{path.stem}: of src/airborne, {', '.join(MEASURED.get(path.stem, ('all',)))}")
        for row in newest_rows(path):
            n = changes_since(row["commit"], paths)
            mark = "unknown commit" if n is None else f"OLD: {n} changes since" if n else ""
            what = f"{row['data'][:38]:<40}{row['method'][:14]:<16}{row['metric'][:38]:<40}"
            print(f"  {what}{row['value']:>9} {row['unit']:<6}{row['date']} {row['commit']}  {mark}")


def _commit() -> str:
    return _git("rev-parse", "--short", "HEAD") or "unknown"


def _git(*words: str, root: Path = ROOT) -> str:
    answer = subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, check=False)
    return answer.stdout.strip()


def _machine() -> str:
    return f"{platform.system()} {platform.machine()}, Python {platform.python_version()}"


if __name__ == "__main__":
    main()
