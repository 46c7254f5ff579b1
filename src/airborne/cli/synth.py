"""Commands that write synthetic trials."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from airborne.cli.console import Out, progress

Seed = Annotated[int, typer.Option(min=0, help="Seed of the random numbers.")]


def synth_cross_command(
    output: Out,
    preset: Annotated[Literal["half-twist", "side-somersault"], typer.Option(help="The throw.")] = "half-twist",
    seed: Seed = 0,
) -> None:
    """Write a thrown wooden cross: interlaced videos of three cameras, calibration, clicks, truth.

    Example: airborne synth cross -o my-trial --seed 3
    """
    from airborne.synthetic import write_thrown_cross

    with progress("rendering") as report:
        write_thrown_cross(output, preset=preset, seed=seed, progress=report)
    print(f"trial: {output / 'trial.toml'}")


def synth_somersault_command(
    output: Out,
    *,
    preset: Annotated[
        Literal["paper", "moving-arms", "pike"], typer.Option(help="11 poses of one shape, or motion at 50 frames/s.")
    ] = "paper",
    target: Annotated[Literal["skin", "ellipsoids"], typer.Option(help="The surface of the rendered person.")] = "skin",
    style: Annotated[
        Literal["exact", "gym"], typer.Option(help="Images in the tracker's own light, or as of cameras in a hall.")
    ] = "exact",
    seed: Seed = 0,
) -> None:
    """Write a half-twisting somersault: videos from front, side and top, calibration, body, truth, the person as glTF.

    Example: airborne synth somersault -o my-somersault --preset moving-arms --style gym
    """
    from airborne.export.models import write_model
    from airborne.synthetic import somersault_scene, write_somersault

    with progress("rendering") as report:
        write_somersault(output, preset=preset, target=target, style=style, seed=seed, progress=report)
    write_model(output / "person.glb", somersault_scene(preset, target=target, style=style, seed=seed).body)
    print(f"trial: {output / 'trial.toml'}")


def synth_block_command(
    output: Out,
    seed: Seed = 0,
    *,
    blockers: Annotated[int, typer.Option(min=1, max=3, help="How many players jump to block.")] = 1,
    difficulty: Annotated[
        Literal["easy", "default", "hard"], typer.Option(help="Clothes, players in the way, noise, calibration.")
    ] = "default",
    frame_rate: Annotated[int | None, typer.Option(help="Frames per second: 30, 60 or 120.")] = None,
    cameras: Annotated[int | None, typer.Option(min=2, max=6, help="How many cameras.")] = None,
) -> None:
    """Write a volleyball block: videos from behind the blockers, calibration, hand-set start, truth.

    Example: airborne synth block -o my-block --seed 3 --blockers 2
    """
    from airborne.synthetic import block_scene, write_block

    options = {"difficulty": difficulty, "frame_rate": frame_rate, "n_cameras": cameras}
    with progress("rendering") as report:
        write_block(output, block_scene(seed, n_blockers=blockers, **options), progress=report)
    print(f"trial: {output / 'trial.toml'}")
