"""Commands that repeat a paper's experiment."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from airborne.cli.console import Json, Out, progress, stop


def reproduce_rigid_command(
    output: Out = Path("reproduced-rigid"),
    quick: Annotated[bool, typer.Option("--quick", help="Fewer poses, methods and cases: under a minute.")] = False,
    as_json: Json = False,
) -> None:
    """Track a synthetic somersault as the rigid-body paper does, and better: errors, curves, sensitivity; minutes.

    Example: airborne reproduce rigid -o rigid
    """
    from airborne.reproduction.rigid.experiment import describe_rigid
    from airborne.reproduction.rigid.experiment import reproduce_rigid as reproduce

    try:
        with progress("tracking") as report:
            summary = reproduce(output, quick=quick, progress=report)
    except KeyboardInterrupt:
        stop(f"the files finished so far are in {output}")
    print((output / "summary.json").read_text(encoding="utf-8") if as_json else describe_rigid(summary))
    if not as_json:
        print(f"results: {output}")


def reproduce_blockjump_command(
    output: Out = Path("reproduced-blockjump"),
    *,
    quick: Annotated[bool, typer.Option("--quick", help="Two sequences, two seeds: about a minute.")] = False,
    seeds: Annotated[int | None, typer.Option(min=1, help="Seeds of each method; 5 unless --quick.")] = None,
    processes: Annotated[int | None, typer.Option(min=1, help="Sequences at a time; by default one per core.")] = None,
    as_json: Json = False,
) -> None:
    """Track 22 synthetic block jumps as the block-jump paper does, and better: its Table I, strict errors; 20 minutes.

    A command that was stopped resumes. Example: airborne reproduce blockjump -o blockjump
    """
    from airborne.reproduction.block.experiment import describe_blockjump
    from airborne.reproduction.block.experiment import reproduce_blockjump as reproduce

    try:
        with progress("tracking") as report:
            summary = reproduce(output, quick=quick, progress=report, n_processes=processes, n_seeds=seeds)
    except KeyboardInterrupt:
        stop(f"give the same command again to resume; sequences in {output}")
    print((output / "summary.json").read_text(encoding="utf-8") if as_json else describe_blockjump(summary))
    if not as_json:
        print(f"results: {output}")
