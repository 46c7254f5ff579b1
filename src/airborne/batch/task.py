"""One trial of a batch, as a worker does it: tracked, resumed, or left alone; its log and what is remembered of it."""

from __future__ import annotations

import os
import platform
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np

from airborne import __version__
from airborne.batch.row import TableRow, row_of
from airborne.batch.trials import BatchTrial
from airborne.errors import AirborneError
from airborne.export import write_json
from airborne.export.pictures import thumbnail
from airborne.io.text import read_json
from airborne.io.writing import explain_full_disk
from airborne.motion.run_folder import MOTION, REPORT, RUN_RECORD, SUMMARY, list_figures
from airborne.run.identity import run_identity
from airborne.run.track import track_trial
from airborne.trial.file import Trial, read_trial

TaskStatus = Literal["done", "unchanged", "failed", "not run"]
FolderState = Literal["new", "stopped", "changed", "unchanged"]  # what a folder holds of a trial

LOGS, THUMBNAILS = "logs", "thumbnails"  # folders of a batch beside those of its trials
_THUMBNAIL_PX = 160  # width, so that a row of the page is a finger high
_SECONDS_A_REPORT = 1.0  # between reports of a trial's frames


@dataclass(frozen=True, slots=True)
class Task:
    """A trial and the batch's folder; travels to a worker, which sees the same files."""

    trial: BatchTrial
    batch: Path  # absolute
    pictures: bool
    version: str = __version__  # of whoever gave it

    @property
    def folder(self) -> Path:
        """Where the trial's run lies."""
        return self.batch / self.trial.name

    @property
    def log(self) -> Path:
        """Where the trial's log lies."""
        return self.batch / LOGS / f"{self.trial.name}.log"

    @property
    def record(self) -> Path:
        """Where the inputs are remembered that the folder's run is made from."""
        return self.batch / LOGS / f"{self.trial.name}.json"


@dataclass(frozen=True, slots=True)
class TaskOutcome:
    """How a task ended."""

    name: str
    status: TaskStatus
    error: str = ""  # one line, of one that failed or was not run
    row: TableRow = field(default_factory=dict)  # of the batch's table


Report = Callable[[str, int, int | None], None]  # the trial's name, frames done and expected


def do_task(task: Task, report: Report = lambda name, done, total: None) -> TaskOutcome:
    """Bring a trial's run to its end: track it, go on where it stopped, or find that nothing has changed.

    Whatever goes wrong is one line of the outcome, and more in the log.
    """
    started_s = time.monotonic()
    task.log.parent.mkdir(parents=True, exist_ok=True)
    with explain_full_disk(task.batch), task.log.open("a", encoding="utf-8") as log:

        def note(text: str) -> None:
            log.write(f"{datetime.now():%F %T} {text}\n")
            log.flush()

        note(f"process {os.getpid()} on {platform.node()}: {task.trial.path}, airborne {__version__}")
        status: TaskStatus = "failed"
        error, row = "", {}
        try:
            status = _bring_to_end(task, report, note)
            row = row_of(task.folder)
            if row["share_lost"] == 1:
                status, error = "failed", "nothing was found in any frame; look at the overlays and correct [start]"
        except AirborneError as problem:
            error = str(problem)
        except OSError as problem:
            error = f"{problem.filename or task.trial.path}: {problem.strerror or problem}"
        except Exception as problem:
            log.write(traceback.format_exc())
            error = f"unexpected {type(problem).__name__}: {problem}; {LOGS}/{task.log.name} says where"
        error = " ".join(error.split())
        note(f"{status} after {time.monotonic() - started_s:.1f} s{f': {error}' if error else ''}")
    return TaskOutcome(task.trial.name, status, error, row)


def _bring_to_end(task: Task, report: Report, note: Callable[[str], None]) -> TaskStatus:
    """Track a trial as far as that is needed, and return how."""
    if task.version != __version__:
        raise AirborneError(
            f"the worker has airborne {__version__}, the batch {task.version}; install the same on every machine"
        )
    trial = read_trial(task.trial.path)
    state, identity = inspect_folder(task, trial)
    note(state)
    if state != "unchanged":
        if identity is not None:
            replaces = _run_stamp(task) if state == "changed" else None
            write_json(task.record, {"identity": identity, "replaces": replaces})
        next_s = 0.0

        def tell(done: int, total: int | None) -> None:
            nonlocal next_s
            if time.monotonic() >= next_s:
                next_s = time.monotonic() + _SECONDS_A_REPORT
                report(task.trial.name, done, total)
                note(f"frame {done} of {total or 'unknown'}")

        track_trial(
            trial,
            task.folder,
            resume=state != "changed",
            overwrite=state == "changed",
            pictures=task.pictures,
            progress=tell,
        )
        _write_thumbnail(task)
    return "unchanged" if state == "unchanged" else "done"


def inspect_folder(task: Task, trial: Trial) -> tuple[FolderState, dict[str, Any] | None]:
    """Return what the folder holds of a trial, and what the trial's inputs are; None where one is missing."""
    try:
        identity = run_identity(trial)
    except (OSError, ValueError):
        return "new", None  # tracking says which input is missing or damaged
    try:
        record = read_json(task.record)
        known, replaces = record["identity"], record.get("replaces")
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return ("stopped" if (task.folder / MOTION).is_file() else "new"), identity
    if known != identity or (replaces is not None and replaces == _run_stamp(task)):
        return "changed", identity
    is_finished = (task.folder / SUMMARY).is_file() and (not task.pictures or (task.folder / REPORT).is_file())
    return ("unchanged" if is_finished else "stopped"), identity


def _run_stamp(task: Task) -> str | None:
    """Return when the run in a task's folder began; by it a run that was to be replaced is known to be there still."""
    path = task.folder / RUN_RECORD
    return str(path.stat().st_mtime_ns) if path.is_file() else None


def thumbnail_of(batch: Path, name: str) -> Path:
    """Return where a trial's thumbnail lies."""
    return batch / THUMBNAILS / f"{name}.jpg"


def _write_thumbnail(task: Task) -> None:
    """Reduce one of a run's figures; a run without pictures has none."""
    figures = list_figures(task.folder)
    image = cv2.imread(str(figures[0])) if figures else None
    if image is not None:
        path = thumbnail_of(task.batch, task.trial.name)
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(thumbnail(np.asarray(image[..., ::-1], np.uint8), _THUMBNAIL_PX))
