"""Commands about many trials: written from a folder of videos, tracked on any number of machines."""

from __future__ import annotations

import json
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from airborne.cli.console import Json, Out, errors, stop

_SOME_FAILED = 1  # the exit code, also where some were not run


def batch_command(
    trials: Annotated[str, typer.Argument(help="A folder of trials, a quoted pattern, or a CSV with a column trial.")],
    output: Out,
    *,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes on this machine; as many as cores by default.")
    ] = None,
    memory: Annotated[
        str, typer.Option(help="Memory of each worker, such as 4GB; by default an equal share.")
    ] = "auto",
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a running Dask scheduler, tcp://host:8786, instead of this machine.")
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what would be done, and do nothing.")] = False,
    pictures: Annotated[bool, typer.Option(help="Write overlay videos, figures and reports.")] = True,
    as_json: Json = False,
) -> None:
    """Track many trials, each into its folder of the output; give the command again to go on after a stop.

    Only what is missing, stopped or changed is tracked. Writes trials.csv and index.html. Exit code 1 if some failed
    or, with --dry-run, would fail.

    Example: airborne batch trials -o results --workers 4
    """
    from airborne.batch.cluster import require_dask
    from airborne.batch.run import Machines, describe_plan, plan_tasks, run_batch
    from airborne.batch.trials import list_trials

    require_dask()
    listed = list_trials(trials)
    if dry_run:
        lines, is_sound = describe_plan(plan_tasks(listed, output, pictures=pictures))
        print(json.dumps(lines, ensure_ascii=False) if as_json else "\n".join(lines))
        raise typer.Exit(0 if is_sound else _SOME_FAILED)
    machines = Machines(scheduler=scheduler, workers=workers, memory=memory)
    try:
        result = run_batch(
            listed, output, machines=machines, pictures=pictures, say=partial(errors.print, markup=False)
        )
    except KeyboardInterrupt:
        stop(f"what is finished is in {output}; the same command goes on")
    counts = Counter(outcome.status for outcome in result.outcomes)
    failed = {outcome.name: outcome.error for outcome in result.outcomes if outcome.status == "failed"}
    if as_json:
        told = {"counts": counts, "failed": failed, "files": list(map(str, result.files))}
        print(json.dumps(told, ensure_ascii=False))
    else:
        left = f", {counts['not run']} not run: give the command again" if counts["not run"] else ""
        print(f"{counts['done']} tracked, {counts['unchanged']} unchanged, {counts['failed']} failed{left}")
        print(f"results: {', '.join(map(str, result.files))}")
    if failed or counts["not run"]:
        raise typer.Exit(_SOME_FAILED)


def new_command(
    videos: Annotated[Path, typer.Argument(help="The folder of the videos.")],
    *,
    pattern: Annotated[str, typer.Option(help="How the paths below it are built; words in braces become labels.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for session.toml and trials/.")],
    calibration: Annotated[
        str, typer.Option(help="The calibration, or a .csv of control points, from the output.")
    ] = "calib.toml",
    body: Annotated[
        str, typer.Option(help="The body file, likewise; may hold {athlete}. Or human18, legs of players.")
    ] = "body.toml",
) -> None:
    """Write a session and its trials from a folder of videos, for `airborne batch`; files that exist are left alone.

    Example: airborne new videos --pattern "{athlete}_{condition}_{number}_{camera}.mp4" -o study
    """
    from airborne.batch.new import write_study

    study = write_study(videos, pattern, output, calibration=calibration, body=body)
    print(f"session: {study.session}\ntrials: {len(study.trials)} in {study.trials[0].parent}")
    for note in study.notes:
        print(f"note: {note}")
