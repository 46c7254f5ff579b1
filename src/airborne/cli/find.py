"""Commands before the first pose is known: one looks for the body, the other writes the image to click in."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from airborne.cli.console import Json, progress


def find_command(
    trial: Annotated[Path, typer.Argument(help="The trial's TOML file; it needs no [start].")],
    output: Annotated[
        Path, typer.Option("-o", "--output", help="Folder for candidates.json and its picture, if undecided.")
    ] = Path("airborne-find"),
    take: Annotated[int | None, typer.Option(min=1, help="Which of the poses in candidates.json.")] = None,
    as_json: Json = False,
) -> None:
    """Look for the body, or the players, in the videos, and print the [start] that was found. Exit code 3: undecided.

    Example: airborne find trial.toml
    """
    import tomlkit

    from airborne.run.find import find_start
    from airborne.run.find_players import find_players_start
    from airborne.run.folder import open_results
    from airborne.trial.file import read_trial

    checked = read_trial(trial)
    find = find_players_start if checked.has_players else find_start
    with open_results(output), progress(f"looking for the {'players' if checked.has_players else 'body'}") as report:
        found = find(checked, output, take=take, progress=report)
    if as_json:
        print(json.dumps({**found.start, "probability": found.finding.candidates[0].probability, "notes": found.notes}))
    else:
        print(tomlkit.dumps({"start": found.start}), end="")
        for note in found.notes:
            print(f"# {note}")


def frame_command(
    trial: Annotated[Path, typer.Argument(help="The trial's TOML file.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="The image to write: .png, .tif, .bmp.")],
    camera: Annotated[str, typer.Option(help="The camera's name.")],
    frame: Annotated[int, typer.Option(min=0, help="Number of the frame or field, as in start.frame.")] = 0,
) -> None:
    """Write the image of one camera at one frame or field, in whose pixels points are clicked.

    Example: airborne frame trial.toml --camera cam1 --frame 12 -o cam1_12.png
    """
    from airborne.run.frame import write_frame
    from airborne.trial.file import read_trial

    size = write_frame(read_trial(trial), camera, frame, output)
    print(f"{output}: {size[0]}×{size[1]} px; (0, 0) is the middle of the top-left pixel")
