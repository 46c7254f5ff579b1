"""Commands about the results of a run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from airborne.cli.console import Json

_AGAINST = {
    "truth": "against the truth",
    "digitised": "against digitising by hand",
    "joints": "against the paths of the joints",
}


def evaluate(
    results: Annotated[Path, typer.Argument(help="Folder of a run.")],
    truth: Annotated[
        Path | None,
        typer.Argument(
            help="True poses: field,time_s,x_m,y_m,z_m,r00,...,r22; of players frame,time_s,player,l_hip_x,l_hip_y,..."
        ),
    ] = None,
    digitised: Annotated[
        Path | None, typer.Option(help="Points clicked by hand, to compare with, as the rigid-body paper does.")
    ] = None,
    joints: Annotated[
        Path | None, typer.Option(help="Paths of joints: time_s,joint,x_m,y_m,z_m line by line, or a .trc file.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Compare a run with the truth, with paths of joints, or with points clicked by hand; of players with their truth.

    Example: airborne evaluate results truth.csv --digitised digitised.csv
    """
    from airborne.assessment import assess

    found = assess(results, truth, digitised, joints)
    if as_json:
        print(json.dumps({name: comparison.to_dict() for name, comparison in found.items()}))
        return
    for name, comparison in found.items():
        print(_AGAINST[name])
        print(comparison.describe())
