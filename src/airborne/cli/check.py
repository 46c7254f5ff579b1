"""`airborne check`: whether a trial can be tracked, before it is."""

from __future__ import annotations

import json
import sys
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from airborne.cli.console import Json, errors
from airborne.errors import count


def check_command(
    trial: Annotated[Path, typer.Argument(help="The trial's TOML file.")],
    as_json: Json = False,
) -> None:
    """Open everything that a trial names, track nothing, and list every mistake and every doubt.

    Example: airborne check trial.toml
    """
    if errors.is_terminal:
        errors.print("opening videos; what is in order is listed first, then mistakes and doubts", style="dim")
    from airborne.run.check import check_trial

    checks = check_trial(trial, (lambda line: None) if as_json else partial(print, flush=True))
    if as_json:
        print(
            json.dumps({"mistakes": checks.mistakes, "doubts": checks.doubts, "well": checks.well}, ensure_ascii=False)
        )
    else:
        for line in checks.mistakes:
            errors.print(f"airborne: {line}", style="red", markup=False)
        for line in checks.doubts:
            errors.print(f"airborne: doubt: {line}", style="yellow", markup=False)
        if checks.mistakes and checks.well:
            corrected = "this is" if len(checks.mistakes) == 1 else "these are"
            errors.print(f"the other checks run once {corrected} corrected", style="dim")
        elif checks.doubts and not checks.mistakes:
            print(f"{count(len(checks.doubts), 'doubt')}: frames may come out uncertain or lost")
        elif not checks.mistakes:
            print("no mistakes: ready to be tracked")
    if checks.mistakes:
        sys.exit(2)
