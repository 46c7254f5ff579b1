"""The command that exports a run for other programs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from airborne.cli.console import Json
from airborne.io.terminal import Stages


def export_command(
    results: Annotated[Path, typer.Argument(help="Folder of a run, finished or not.")],
    *,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Folder for the files; by default `export` inside the run's folder."),
    ] = None,
    c3d: Annotated[bool, typer.Option("--c3d", help="Markers for Visual3D, Vicon Nexus, Mokka, ...")] = False,
    trc: Annotated[bool, typer.Option("--trc", help="Markers for OpenSim.")] = False,
    mot: Annotated[bool, typer.Option("--mot", help="Angles for OpenSim, to animate the model with.")] = False,
    osim: Annotated[bool, typer.Option("--osim", help="The body as an OpenSim model.")] = False,
    gltf: Annotated[bool, typer.Option("--gltf", help="The moving body (.glb) for Blender, browsers, ...")] = False,
    bvh: Annotated[bool, typer.Option("--bvh", help="The moving skeleton for animation programs.")] = False,
    csv: Annotated[bool, typer.Option("--csv", help="A wide table: one row per frame.")] = False,
    parquet: Annotated[bool, typer.Option("--parquet", help="The same with types and units.")] = False,
    as_json: Json = False,
) -> None:
    """Write a run as files for other programs, by default in all formats. Files of the same names are replaced.

    Example: airborne export results --c3d --trc
    """
    from airborne.run.export import export_run

    given = {"c3d": c3d, "trc": trc, "mot": mot, "osim": osim, "gltf": gltf, "bvh": bvh, "csv": csv, "parquet": parquet}
    with Stages() as report:
        exported = export_run(results, output, [kind for kind, is_wanted in given.items() if is_wanted], report)
    if as_json:
        print(json.dumps({"files": [str(path) for path in exported.files], "notes": exported.notes}))
        return
    for line in [*map(str, exported.files), *(f"note: {note}" for note in exported.notes)]:
        print(line)
