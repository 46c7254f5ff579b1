"""The command that fits a body to a person."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from airborne.cli.console import progress


def fit_body_command(
    trial: Annotated[Path, typer.Argument(help="The trial's TOML file, with detections, joints_m or points_px.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="The body file to write.")],
    frames: Annotated[int, typer.Option(min=1, help="How many frames to fit the body to.")] = 5,
    skeleton: Annotated[
        str | None, typer.Option(help="Whose points the detections are, if their files do not say: BODY_25, ...")
    ] = None,
) -> None:
    """Fit the trial's body to the person in its videos: lengths, girths, colours and where they change.

    Example: airborne fit-body trial.toml -o person.toml
    """
    from airborne.run.own_body import describe_fit, fit_person
    from airborne.trial.file import read_trial

    with progress("reading and fitting") as report:
        fitted = fit_person(
            read_trial(trial),
            output,
            n_frames=frames,
            skeleton=skeleton,
            progress=lambda what, done, total: report(done, total),
        )
    print(f"{describe_fit(fitted)}\nbody: {output}\npicture: {fitted.picture}")
