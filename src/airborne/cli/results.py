"""Commands about the results of a run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from airborne.cli.console import Json
from airborne.io.terminal import errors

_AGAINST = {
    "truth": "against the truth",
    "digitised": "against points clicked by hand",
    "joints": "against the paths of the joints",
    "smooth_joints": "the smoothed joints against them",
    "reference_flight": "against the flight",
}


def evaluate_command(
    results: Annotated[Path, typer.Argument(help="Folder of a run.")],
    truth: Annotated[
        Path | None,
        typer.Argument(
            help="True poses: field,time_s,x_m,y_m,z_m,r00,...,r22; of players frame,time_s,player,l_hip_x,l_hip_y,..."
        ),
    ] = None,
    *,
    digitised: Annotated[
        Path | None, typer.Option(help="Points clicked by hand, to compare with, as the rigid-body paper does.")
    ] = None,
    joints: Annotated[
        Path | None, typer.Option(help="Paths of joints: time_s,joint,x_m,y_m,z_m line by line, or a .trc file.")
    ] = None,
    joint_angles: Annotated[
        Path | None, typer.Option(help="Joint angles: time_s,<joint>_x_rad,<joint>_y_rad,<joint>_z_rad,...")
    ] = None,
    flight: Annotated[
        Path | None,
        typer.Option(help="A flight: time_s,com_x_m,...,L_x_kg_m2_s,...,somersault_deg,tilt_deg,twist_deg, or some."),
    ] = None,
    repeat: Annotated[
        list[Path] | None, typer.Option(help="Another run of the same trial, for the repeatability; may be repeated.")
    ] = None,
    operator: Annotated[
        list[Path] | None, typer.Option(help="Another person's clicks beside --digitised; may be repeated.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder for the agreement's files; the run stays as it is.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Compare a run with the truth, with paths of joints, a flight, or points clicked by hand; players with theirs.

    Also reports agreement (bias, limits of agreement, ICC, SEM), and repeatability between runs or people.

    Example: airborne evaluate results truth.csv --digitised digitised.csv --repeat results2
    """
    from airborne.motion.run_folder import note_if_unfinished
    from airborne.run.evaluate import Comparisons, assess, evaluate_agreement

    others = repeat or joint_angles
    of_series = truth or digitised or joints
    comparisons: Comparisons = {}
    if of_series or flight or not others:
        comparisons = assess(results, truth, digitised, joints, flight=flight, keep=output is None)
    agreement = None
    if of_series or others or operator:
        agreement = evaluate_agreement(
            results,
            truth,
            digitised,
            joints,
            joint_angles=joint_angles,
            repeats=repeat or (),
            operators=operator or (),
            out=output,
            comparisons=comparisons,
        )
    if as_json:
        numbers = {name: comparison.to_dict() for name, comparison in comparisons.items()}
        print(json.dumps(numbers if agreement is None else numbers | agreement.to_dict()))
        return
    for name, comparison in comparisons.items():
        print(_AGAINST[name])
        print(comparison.describe())
    if agreement is not None:
        print(agreement.describe())
    if (note := note_if_unfinished(results)) is not None:
        print(f"note: {note}")
    if agreement is not None and agreement.doubts:
        errors.print("airborne: doubt: less than half of a run is tracked: see there", style="yellow", markup=False)
    if doubtful := [_AGAINST[name] for name, comparison in comparisons.items() if comparison.questions]:
        said = f"what was found {' and '.join(doubtful)} is doubtful: see the question below its numbers"
        errors.print(f"airborne: doubt: {said}", style="yellow", markup=False)
