"""Progress of long work: a bar on stderr, or lines where stderr is no terminal."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

WATCHED = "AIRBORNE_WATCHED"  # set by a program that shows the last line of progress to its user
_SECONDS_A_LINE = 0.5 if WATCHED in os.environ else 5.0  # between lines of progress where no terminal shows a bar
_SECONDS_BEFORE = 0.0 if WATCHED in os.environ else 5.0  # the first

errors = Console(stderr=True, highlight=False, soft_wrap=True)


@contextmanager
def progress(what: str) -> Iterator:
    """Show a progress bar on stderr; where stderr is no terminal, a line every few seconds."""
    if not errors.is_terminal:
        yield _ProgressLines(what)
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=errors, transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


class _ProgressLines:
    """Progress as plain lines."""

    def __init__(self, what: str) -> None:
        self._what, self._next_s = what, time.monotonic() + _SECONDS_BEFORE

    def __call__(self, done: int, total: int | None) -> None:
        if time.monotonic() >= self._next_s:
            self._next_s = time.monotonic() + _SECONDS_A_LINE
            errors.print(f"{self._what}: {done}{f' of {total}' if total else ''}", markup=False)


class Stages(ExitStack):
    """A progress bar for each stage, one after the other."""

    def __init__(self) -> None:
        super().__init__()
        self._what, self._report = "", lambda done, total: None

    def __call__(self, what: str, done: int, total: int | None) -> None:
        """Report a stage; a new one gets a new bar."""
        if what != self._what:
            self.close()
            self._what, self._report = what, self.enter_context(progress(what))
        self._report(done, None if total is None else max(done, total))  # durations that files state may be short
