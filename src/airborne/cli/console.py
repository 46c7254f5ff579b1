"""What all commands share: options, progress, and the text of errors."""

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

from airborne.errors import AirborneError

STOPPED = 130  # the exit code
_SECONDS_A_LINE = 5.0  # between lines of progress where no terminal shows a bar
_SIDES_PX = range(16, 20_001)  # of an image

errors = Console(stderr=True, highlight=False, soft_wrap=True)

Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
Out = Annotated[Path, typer.Option("-o", "--output", help="Folder for the results.")]


def refuse(reason: str) -> NoReturn:
    """Print the reason in one line and exit with code 2."""
    errors.print(f"airborne: {reason}", style="red", markup=False)
    sys.exit(2)


def stop(left: str = "") -> NoReturn:
    """Print that the user stopped the command, and what is left of it; exit with code 130."""
    errors.print(f"airborne: stopped{'; ' if left else ''}{left}", markup=False)
    sys.exit(STOPPED)


def sizes_px(text: str) -> dict[str, tuple[int, int]]:
    """Parse the option --size: 768x576 for all cameras (under ""), or cam1=768x576,cam2=1920x1080."""
    sizes = {}
    try:
        for item in text.split(","):
            name, _, numbers = item.rpartition("=")
            width, height = (int(number) for number in numbers.lower().split("x"))
            sizes[name.strip()] = (width, height)
    except ValueError:
        raise AirborneError(f"--size {text}: expected WIDTHxHEIGHT such as 768x576, or cam1=768x576,cam2=...") from None
    if any(side not in _SIDES_PX for size in sizes.values() for side in size):
        raise AirborneError(f"--size {text}: expected sides of {_SIDES_PX[0]} to {_SIDES_PX[-1]} pixels")
    return sizes


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
        self._what, self._next_s = what, time.monotonic() + _SECONDS_A_LINE

    def __call__(self, done: int, total: int | None) -> None:
        if time.monotonic() >= self._next_s:
            self._next_s = time.monotonic() + _SECONDS_A_LINE
            errors.print(f"{self._what}: {done} of {total or 'unknown'}", markup=False)
