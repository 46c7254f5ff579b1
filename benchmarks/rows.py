"""One measurement, one row: what was measured, on what, with which code and machine."""

from __future__ import annotations

import csv
import platform
import subprocess
from datetime import date
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
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
            print(f"{row['data']:<40}{row['method']:<12}{row['metric']:<40}{value:>8} {row['unit']}{floor}", flush=True)


def _commit() -> str:
    answer = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    return answer.stdout.strip() or "unknown"


def _machine() -> str:
    return f"{platform.system()} {platform.machine()}, Python {platform.python_version()}"
