"""The command that synchronises cameras."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Literal

import typer

from airborne.cli.console import Json, progress


def sync_command(
    trial: Annotated[Path, typer.Argument(help="The trial's TOML file; the offsets are written into it.")],
    *,
    by: Annotated[
        Literal["auto", "flash", "sound", "motion", "tracking"],
        typer.Option(help="What the offsets come from; auto: motion, then tracking."),
    ] = "auto",
    within: Annotated[float, typer.Option(min=0.01, max=60, help="Motion: the largest offset searched, in s.")] = 1.0,
    whole_pictures: Annotated[
        bool, typer.Option("--whole-pictures", help="The cameras are genlocked: round to whole frames.")
    ] = False,
    drift: Annotated[
        bool, typer.Option("--drift", help="Also estimate the drift of each clock, for long recordings.")
    ] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Print the offsets and write nothing.")] = False,
    as_json: Json = False,
) -> None:
    """Estimate the time offset of each camera, and write it into the trial file.

    Example: airborne sync trial.toml --by flash
    """
    from airborne.sync.from_trial import synchronise, write_offsets
    from airborne.trial.file import read_trial

    with progress("synchronising: images read") as report:
        offsets = synchronise(
            read_trial(trial),
            by=by,
            within_s=within,
            whole_pictures=whole_pictures,
            with_drift=drift,
            progress=report,
        )
    if not dry_run:
        write_offsets(trial, offsets)
    print(json.dumps(offsets.to_dict()) if as_json else offsets.describe())
    if not as_json and not dry_run:
        print(f"written: {trial}")
