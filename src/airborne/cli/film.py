"""The command that writes a film of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from airborne.cli.console import progress


def film_command(
    results: Annotated[Path, typer.Argument(help="Folder of a run, tracked with pictures.")],
    *,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="The film, .mp4 or .gif; the run's videos/film.mp4.")
    ] = None,
    first: Annotated[int | None, typer.Option(min=0, help="First frame; the run's.")] = None,
    last: Annotated[int | None, typer.Option(min=0, help="Last frame; the run's.")] = None,
) -> None:
    """Write a stretch of a run as a film: all cameras with outlines side by side, over curves with a cursor.

    Example: airborne film results --first 20 --last 60 -o flight.gif
    """
    from airborne.motion.run_folder import VIDEOS
    from airborne.run.film import write_film

    path = results / VIDEOS / "film.mp4" if output is None else output
    with progress("drawing") as report:
        begin, end = write_film(results, path, first=first, last=last, progress=report)
    print(f"{path}: frames {begin} to {end}")
