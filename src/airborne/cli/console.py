"""What all commands share: options, progress, and how an error is told."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, NoReturn

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

_SECONDS_A_LINE = 5.0

errors = Console(stderr=True, highlight=False, soft_wrap=True)

Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
Out = Annotated[Path, typer.Option("-o", "--output", help="Folder for the results.")]


def refuse(reason: str) -> NoReturn:
    """Say why in one line and leave with code 2."""
    errors.print(f"airborne: {reason}", style="red", markup=False)
    sys.exit(2)


@contextmanager
def progress(what: str) -> Iterator:
    """Show a bar on stderr while frames go by; where stderr is no terminal, a line every few seconds."""
    if not errors.is_terminal:
        yield _Lines(what)
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=errors, transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


class _Lines:
    """Progress as plain lines."""

    def __init__(self, what: str) -> None:
        self._what, self._next_s = what, time.monotonic() + _SECONDS_A_LINE

    def __call__(self, done: int, total: int | None) -> None:
        if time.monotonic() >= self._next_s:
            self._next_s = time.monotonic() + _SECONDS_A_LINE
            errors.print(f"{self._what}: {done} of {total or 'unknown'}", markup=False)
