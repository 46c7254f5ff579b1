"""What a batch leaves beside its runs: a table with one row a trial, and a page of them."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

from airborne.batch.task import LOGS, TaskOutcome, thumbnail_of
from airborne.batch.trials import TABLE, BatchTrial, label_names
from airborne.errors import count
from airborne.export.page import format_value, format_with_sd, label, render_page
from airborne.io import parquet
from airborne.io.writing import write_text
from airborne.motion.run_folder import REPORT
from airborne.motion.tables import cell

PAGE = "index.html"
_ORDER = ("failed", "not run", "done")  # of the page's rows
_ON_THE_PAGE = ("share_tracked", "somersault_rev", "twist_rev", "L_kg_m2_s", "com_rise_m", "hip_height_m", "n_alarms")


def write_outputs(folder: Path, trials: Sequence[BatchTrial], outcomes: Mapping[str, TaskOutcome]) -> list[Path]:
    """Write trials.csv, with pyarrow also trials.parquet, and index.html; return their paths.

    The table is in the order of the trials and holds nothing that depends on when or where they were tracked.
    """
    names = label_names(trials)
    ends = [outcomes.get(trial.name, not_reached(trial)) for trial in trials]
    rows = [
        {"trial": trial.name, **dict.fromkeys(names, ""), **trial.labels}
        | {"status": "done" if end.status == "unchanged" else end.status, "error": end.error}
        | {"folder": trial.name, **end.row}
        for trial, end in zip(trials, ends, strict=True)
    ]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    written = [folder / TABLE, folder / PAGE]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([cell("" if row.get(name) is None else row[name]) for name in columns] for row in rows)
    write_text(written[0], text.getvalue())
    if parquet.CAN_WRITE_PARQUET:
        written.append((folder / TABLE).with_suffix(".parquet"))
        values = {name: [row.get(name) for row in rows] for name in columns}
        parquet.write_parquet(written[-1], values, {}, {"units": "at the end of each name"})
    write_text(written[1], _page(folder, rows, names))
    return written


def not_reached(trial: BatchTrial) -> TaskOutcome:
    """Return the outcome of a trial that was not tracked before the batch ended."""
    return TaskOutcome(trial.name, "not run", "the batch was stopped, or its scheduler lost; give the command again")


def _page(folder: Path, rows: Sequence[Mapping[str, Any]], labels: Sequence[str]) -> str:
    """Return the page of a batch: failures first, then what was not run, then alarms, else in the table's order."""
    shown = [name for name in _ON_THE_PAGE if any(row.get(name) is not None for row in rows)]
    ordered = sorted(rows, key=lambda row: (_ORDER.index(row["status"]), not row.get("n_alarms")))
    counts = {status: sum(row["status"] == status for row in rows) for status in _ORDER}
    return render_page(
        "batch.html.j2",
        title=", ".join(
            [count(len(rows), "trial"), *(f"{n} {status}" for status, n in counts.items() if n and status != "done")]
        ),
        headers=[label(name.removeprefix("n_")) for name in ("trial", *labels, "status", *shown)],
        rows=[
            {
                "name": row["trial"],
                "cells": [
                    (value, _text(row, name)) for name in (*labels, "status", *shown) for value in [row.get(name)]
                ],
                "report": _link(folder, folder / row["folder"] / REPORT),
                "status": row["status"],
                "log": _link(folder, folder / LOGS / f"{row['trial']}.log"),
                "thumbnail": _link(folder, thumbnail_of(folder, row["trial"])),
                "remark": row["error"] or row.get("findings", ""),
            }
            for row in ordered
        ],
    )


def _text(row: Mapping[str, Any], name: str) -> str:
    """Return a cell's text, numbers of turns with their standard deviation; empty where there is none."""
    value = row.get(name)
    if value is None:
        return ""
    return format_with_sd(value, row.get(f"{name}_sd")) if name.endswith("_rev") else format_value(value)


def _link(folder: Path, path: Path) -> str | None:
    """Return the address of a file beside the page; None where there is no such file."""
    return quote(path.relative_to(folder).as_posix()) if path.is_file() else None
