"""A batch's progress on stderr: a table of the trials that run, or a line for each that ends."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Group
from rich.live import Live
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from airborne.batch.task import TaskOutcome, TaskStatus
from airborne.io.terminal import errors

_MOST_SHOWN = 20  # trials that run, of which a line each is shown


class BatchProgress:
    """How far a batch is: told by workers of frames, and by the batch of each trial's end."""

    def __init__(self, n_trials: int, live: Live | None) -> None:
        """Begin with nothing done; `live` is the display of a terminal, None where lines are printed."""
        self._live, self._total = live, n_trials
        self._running: dict[str, tuple[float, int, int | None]] = {}  # start [s], frames done and expected
        self._ended: set[str] = set()
        self._counts: dict[TaskStatus, int] = {"done": 0, "unchanged": 0, "failed": 0}
        columns = (BarColumn(), MofNCompleteColumn(), TextColumn("trials"), TimeRemainingColumn())
        self._bar = Progress(*columns, console=errors)
        self._bar_task = self._bar.add_task("", total=n_trials)

    def tell(self, name: str, done: int, total: int | None) -> None:
        """Note how many of a trial's frames are done."""
        if name in self._ended:  # told late
            return
        start_s = self._running.get(name, (time.monotonic(),))[0]
        self._running[name] = (start_s, done, total)
        self._show()

    def end(self, outcome: TaskOutcome) -> None:
        """Note that a trial has ended."""
        self._running.pop(outcome.name, None)
        self._ended.add(outcome.name)
        self._counts[outcome.status] += 1
        self._bar.advance(self._bar_task)
        n_ended = sum(self._counts.values())
        if self._live is None or outcome.error:
            text = f"{n_ended} of {self._total}: {outcome.name} {outcome.status}"
            text += f": {outcome.error}" if outcome.error else ""
            errors.print(text, style="red" if outcome.error else None, markup=False)
        self._show()

    def _show(self) -> None:
        if self._live is None:
            return
        table = Table("trial", "frames", "seconds", box=None)
        now_s = time.monotonic()
        for name, (start_s, done, total) in list(self._running.items())[:_MOST_SHOWN]:
            table.add_row(Text(name), f"{done} of {total or '?'}", f"{now_s - start_s:.0f}")
        counts = ", ".join(f"{n} {status}" for status, n in self._counts.items())
        self._live.update(Group(table, Text(counts), self._bar))


@contextmanager
def show_progress(n_trials: int) -> Iterator[BatchProgress]:
    """Show a batch's progress while it goes on."""
    if not errors.is_terminal:
        yield BatchProgress(n_trials, None)
        return
    with Live(console=errors, transient=True) as live:
        yield BatchProgress(n_trials, live)
