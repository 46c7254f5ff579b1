"""What all commands share: options, progress, and the text of errors."""

from __future__ import annotations

import logging
import sys
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from airborne.errors import STOPPED, AirborneError
from airborne.io.terminal import errors
from airborne.io.terminal import progress as progress

_SIDES_PX = range(16, 20_001)  # of an image

Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
Out = Annotated[Path, typer.Option("-o", "--output", help="Folder for the results.")]


class _Notes(logging.Handler):
    """Prints what the code notes as lines on stderr."""

    def emit(self, record: logging.LogRecord) -> None:
        errors.print(f"airborne: {record.getMessage()}", markup=False)


def show_notes() -> None:
    """Let what takes long without progress be told: that kernels are compiled."""
    log = logging.getLogger("airborne.kernels")
    log.setLevel(logging.INFO)
    log.addHandler(_Notes())


def refuse(reason: str, code: int = 2) -> NoReturn:
    """Print the reason in one line and exit."""
    errors.print(f"airborne: {reason}", style="red", markup=False)
    sys.exit(code)


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
