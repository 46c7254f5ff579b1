"""`airborne reproduce blockjump`: the block-jump paper's Table I beside ours, and beside a better tracker."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from airborne import __version__
from airborne.errors import ResultError
from airborne.export import write_json
from airborne.reproduction.block.figures import write_block_figures
from airborne.reproduction.block.measures import read_take
from airborne.reproduction.block.plan import FULL, QUICK
from airborne.reproduction.block.summary import summarise
from airborne.reproduction.block.table import CSV_HEADER, csv_rows, markdown, success_table
from airborne.reproduction.block.takes import do_takes, n_cores
from airborne.types import Progress

_PLAN, _TAKES = "plan.json", "sequences"


def reproduce_blockjump(
    folder: Path,
    quick: bool = False,
    progress: Progress | None = None,
    *,
    n_processes: int | None = None,
    n_seeds: int | None = None,
) -> dict[str, Any]:
    """Reproduce the block-jump paper's Table I; return what summary.json holds.

    Into `folder`: sequences/ (each sequence's estimates and measures as soon as it is finished), then table1.csv,
    table.md, success.png, worst.png, sweep.png and summary.json. A run that was stopped resumes with the missing
    sequences. Quick: two sequences, two seeds, 300 particles. `n_processes` (default: all cores) changes no result;
    unless it is 1, a script that calls this needs `if __name__ == "__main__":`. `n_seeds` replaces 5.
    Raises ResultError where the folder holds anything else. Source: block-jump paper, section 5.
    """
    plan = QUICK if quick else FULL
    plan = plan if n_seeds is None else replace(plan, n_seeds=n_seeds)
    _prepare_folder(folder, {"version": __version__, **plan.to_dict()})
    takes = plan.takes()
    paths = do_takes(folder / _TAKES, takes, n_processes=n_processes or n_cores(), progress=progress)
    results = [read_take(path) for path in sorted(paths)]
    summary = summarise(plan, results, is_quick=quick)
    with (folder / "table1.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([CSV_HEADER, *csv_rows(summary)])
    (folder / "table.md").write_text(markdown(summary), encoding="utf-8")
    write_block_figures(folder, summary, [record for take in results for record in take["records"]])
    write_json(folder / "summary.json", summary)
    return summary


def describe_blockjump(summary: Mapping[str, Any]) -> str:
    """Return Table I beside the paper's as text."""
    return success_table(summary)


def _prepare_folder(folder: Path, plan: Mapping[str, Any]) -> None:
    """Create or check the folder of this plan; raises ResultError where it holds anything else."""
    if folder.exists() and not folder.is_dir():
        raise ResultError(f"{folder} is a file; give a folder for the results")
    path = folder / _PLAN
    expected = json.loads(json.dumps(plan))
    if path.is_file():
        if _read(path) != expected:
            raise ResultError(f"{folder} holds a run with other choices or of another version; give another folder")
    elif folder.is_dir() and any(folder.iterdir()):
        raise ResultError(f"{folder} is not empty; give a new or empty folder, or one of a run that was stopped")
    folder.mkdir(parents=True, exist_ok=True)
    write_json(path, expected)


def _read(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        return None
