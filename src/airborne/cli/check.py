"""`airborne check`: whether a trial can be tracked, before it is."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from airborne.cli.console import Json, errors


def check_command(
    trial: Annotated[Path, typer.Argument(help="The trial's TOML file.")],
    as_json: Json = False,
) -> None:
    """Open everything that a trial names, track nothing, and list every mistake.

    Example: airborne check trial.toml
    """
    from airborne.run.check import check_trial

    checks = check_trial(trial)
    if as_json:
        print(json.dumps({"mistakes": checks.mistakes, "well": checks.well}, ensure_ascii=False))
    else:
        for line in checks.well:
            print(line)
        for line in checks.mistakes:
            errors.print(f"airborne: {line}", style="red", markup=False)
    if checks.mistakes:
        sys.exit(2)
