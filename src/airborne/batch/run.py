"""A batch: every trial that is missing, stopped or changed is tracked, then the table and the page are written."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from airborne.batch.cluster import count_workers, do_tasks, import_for_workers, open_client
from airborne.batch.progress import show_progress
from airborne.batch.table import not_reached, write_outputs
from airborne.batch.task import LOGS, THUMBNAILS, Task, TaskOutcome, inspect_folder
from airborne.batch.trials import TABLE, BatchTrial
from airborne.errors import AirborneError, ResultError
from airborne.io.folder_lock import sole_writer
from airborne.run.opening import open_trial
from airborne.trial.file import read_trial


@dataclass(frozen=True, slots=True)
class BatchResult:
    """How the trials of a batch ended, in the order of its table, and the files that it wrote."""

    outcomes: tuple[TaskOutcome, ...]
    files: tuple[Path, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Machines:
    """What a batch runs on: workers of this machine, or a scheduler by its address."""

    scheduler: str | None = None
    workers: int | None = None  # None: as many as cores
    memory: str = "auto"  # of each worker


def run_batch(
    trials: Sequence[BatchTrial],
    folder: Path,
    *,
    machines: Machines | None = None,
    pictures: bool = True,
    say: Callable[[str], None] = lambda line: None,
) -> BatchResult:
    """Bring every trial's run below `folder` to its end, the longest first, and write the table and the page.

    Trials whose run is finished and whose inputs have not changed are left alone. `say` is told where to look
    meanwhile. Raises AirborneError where nothing can start; what goes wrong with a trial is its outcome.
    """
    machines = machines or Machines()
    if machines.scheduler is None:
        import_for_workers()  # while the trials are looked at
    tasks = plan_tasks(trials, folder, pictures=pictures)
    n_workers = min(machines.workers or count_workers(machines.memory), len(tasks))
    outcomes: dict[str, TaskOutcome] = {}
    with sole_writer(folder), open_client(machines.scheduler, n_workers, machines.memory) as client:
        say(f"dashboard: {client.dashboard_link}")
        info = client.scheduler_info()
        if not info["workers"]:
            address = info["address"]
            say(f"waiting for workers; start them with: dask worker {address} --nthreads 1")
        try:
            with show_progress(len(tasks)) as progress:
                for outcome in do_tasks(client, tasks, report=progress.tell):
                    outcomes[outcome.name] = outcome
                    progress.end(outcome)
        finally:
            is_new = not (folder / TABLE).exists()
            files = write_outputs(folder, trials, outcomes) if outcomes or is_new else []
    return BatchResult(tuple(outcomes.get(trial.name, not_reached(trial)) for trial in trials), tuple(files))


def plan_tasks(trials: Sequence[BatchTrial], folder: Path, *, pictures: bool) -> list[Task]:
    """Return the tasks of a batch, the longest first: that with the largest videos."""
    wrong = [trial.name for trial in trials if trial.name in (LOGS, THUMBNAILS)]
    if wrong:
        raise ResultError(f"a trial is called {wrong[0]}, as the batch's own folder is; rename its file")
    folder = folder.absolute()
    sized = [(-_video_bytes(trial), Task(trial, folder, pictures)) for trial in trials]
    return [task for _, task in sorted(sized, key=lambda each: each[0])]


def _video_bytes(trial: BatchTrial) -> int:
    try:
        described = read_trial(trial.path)
        return sum(described.path(camera.video).stat().st_size for camera in described.camera)
    except (AirborneError, OSError):
        return 0  # its task will say what is wrong


def describe_plan(tasks: Sequence[Task]) -> tuple[list[str], bool]:
    """Say of each task in one line what a batch would do; and whether every trial can be tracked."""
    words = {
        "new": "track",
        "stopped": "go on",
        "changed": "track again, its inputs changed",
        "unchanged": "leave alone",
    }
    lines, is_sound = [], True
    for task in tasks:
        try:
            trial = read_trial(task.trial.path)
            status = inspect_folder(task, trial)[0]
            if status != "unchanged":
                open_trial(trial)  # raises where a file cannot be used
                if not trial.has_players:
                    trial.model()
            lines.append(f"{task.trial.name}: {words[status]}")
        except AirborneError as error:
            lines.append(f"{task.trial.name}: cannot be tracked: {error}")
            is_sound = False
    return lines, is_sound
