"""Batches without workers, and work that needs no trial: done by workers in place of tracking."""

import os
import signal
import time
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

from airborne.batch.task import Task, TaskOutcome, do_task
from airborne.batch.trials import BatchTrial

SLEEP_S = 0.02


def work_here(patch) -> None:
    """Let a batch do its tasks one after the other in this process, as a worker would."""
    client = SimpleNamespace(dashboard_link="none", scheduler_info=lambda: {"workers": {"here": {}}})
    patch.setattr("airborne.batch.run.import_for_workers", lambda: None)
    patch.setattr("airborne.batch.run.open_client", lambda *_: nullcontext(client))
    patch.setattr(
        "airborne.batch.run.do_tasks", lambda client, tasks, *, report: (do_task(each, report) for each in tasks)
    )


def tasks(folder: Path, n: int):
    return [Task(BatchTrial(f"t{k:04}", Path(f"t{k:04}.toml"), {}), folder, pictures=False) for k in range(n)]


def note_name(task, report):
    """Write down that the task was done, and by whom."""
    report(task.trial.name, 1, 1)
    with (task.batch / task.trial.name).open("a") as file:
        file.write(f"{os.getpid()}\n")
    return TaskOutcome(task.trial.name, "done", row={"n_frames": 1})


def sleep_shortly(task, report):
    time.sleep(SLEEP_S)
    return TaskOutcome(task.trial.name, "done")


def die_once(task, report):
    """Kill the worker at the first attempt, and be done at the second."""
    outcome = note_name(task, report)
    if task.trial.name == "t0001" and len((task.batch / "t0001").read_text().split()) == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return outcome


def always_die(task, report):
    if task.trial.name == "t0001":
        time.sleep(0.5)  # the outcome of the task before lies at this worker until it is fetched
        os.kill(os.getpid(), signal.SIGKILL)
    return note_name(task, report)


def take_a_gigabyte(task, report):
    """Take more memory than a worker has, in one task, until somebody ends that."""
    taken = []
    while task.trial.name == "t0001" and len(taken) < 100:
        taken.append(b"x" * 10_000_000)
        time.sleep(0.01)
    return note_name(task, report)
