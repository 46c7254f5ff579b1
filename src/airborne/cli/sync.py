"""The command that puts cameras on one clock."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Literal

import typer

from airborne.cli.console import Json, progress


def sync(
    trial: Annotated[Path, typer.Argument(help="The trial's TOML file; the offsets are written into it.")],
    by: Annotated[
        Literal["auto", "flash", "sound", "motion", "tracking"],
        typer.Option(help="What tells the time; auto: motion, then tracking of the body."),
    ] = "auto",
    within: Annotated[float, typer.Option(min=0.01, max=60, help="Motion: the largest offset looked for, in s.")] = 1.0,
    whole_pictures: Annotated[
        bool, typer.Option("--whole-pictures", help="The cameras are genlocked: round to whole pictures.")
    ] = False,
    drift: Annotated[bool, typer.Option("--drift", help="Find each clock's drift too, of long recordings.")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Print the offsets and write nothing.")] = False,
    as_json: Json = False,
) -> None:
    """Find by how much each camera started late, and write it into the trial file.

    Example: airborne sync trial.toml --by flash
    """
    from airborne.sync.from_trial import synchronise, write_offsets
    from airborne.trial.file import read_trial

    with progress("synchronising: pictures read") as report:
        found = synchronise(
            read_trial(trial),
            by=by,
            within_s=within,
            whole_pictures=whole_pictures,
            with_drift=drift,
            progress=report,
        )
    if not dry_run:
        write_offsets(trial, found)
    print(json.dumps(found.to_dict()) if as_json else found.describe())
    if not as_json and not dry_run:
        print(f"written: {trial}")
