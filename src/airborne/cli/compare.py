"""`airborne compare`: conditions compared across the trials of a batch."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from airborne.cli.console import Out


def compare_command(
    results: Annotated[Path, typer.Argument(help="The folder of a batch, whose trials have athlete and condition.")],
    output: Out,
    *,
    variable: Annotated[
        list[str], typer.Option(help="A column of trials.csv, or a curve such as com_z_m; may be repeated.")
    ],
    events: Annotated[
        str, typer.Option(help="What curves are normalised between: start, end, take-off, landing, turn-1, ...")
    ] = "start,end",
    conditions: Annotated[str | None, typer.Option(help="Only these conditions, separated by commas.")] = None,
    real_time: Annotated[bool, typer.Option("--real-time", help="Curves in seconds since the first event.")] = False,
) -> None:
    """Compare conditions across trials and athletes: differences with intervals, tests of curves, figures, a text.

    Example: airborne compare results -o comparison --variable com_rise_m --variable com_z_m --events take-off,landing
    """
    from airborne.study.write import write_comparison

    text = write_comparison(
        results,
        output,
        variable,
        events=_split(events),
        conditions=_split(conditions or ""),
        real_time=real_time,
    )
    print(text.partition("\nReferences\n")[0])
    print(f"tables, figures and text: {output}")


def _split(text: str) -> list[str]:
    return [each.strip() for each in text.split(",") if each.strip()]
