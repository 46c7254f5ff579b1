"""Commands that track: the demo, a trial."""

from __future__ import annotations

import math
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from airborne.cli.console import Json, Out, stop
from airborne.cli.results import evaluate_command
from airborne.errors import UNTRACKED, AirborneError, count, count_of, format_digits
from airborne.io.terminal import Stages

if TYPE_CHECKING:
    from airborne.run.track import TrackResult

_FIRST_WRITTEN = ("motion.csv", "joints.csv")  # of a body, of players


def demo_command(
    output: Out = Path("airborne-demo"),
    as_json: Json = False,
) -> None:
    """Track the bundled example, a thrown cross, and compare it with its truth.

    An earlier demo's run is replaced; one that was stopped is resumed.

    Example: airborne demo
    """
    from airborne.motion.run_folder import SUMMARY
    from airborne.run.folder import holds_run_of
    from airborne.trial.examples import example_trial
    from airborne.trial.file import read_trial

    trial = example_trial("thrown_cross")
    is_there = holds_run_of(read_trial(trial), output)  # a folder with any other run is left alone
    is_begun = is_there and not (output / SUMMARY).is_file()
    run = _track(
        trial,
        output,
        resume=is_begun,
        overwrite=is_there and not is_begun,
        pictures=True,
        go_on="the same command goes on",
    )
    if not as_json:
        print(_describe(run.summary, output))
    evaluate_command(output, trial.parent / "truth.csv", digitised=trial.parent / "digitised.csv", as_json=as_json)
    if not as_json:
        print(f"report: {output / 'report.html'}")


def track_command(
    trial: Annotated[Path, typer.Argument(help="The trial's TOML file.")],
    output: Out,
    *,
    resume: Annotated[
        bool,
        typer.Option(
            help="Resume a stopped run; frames that new or changed [[key]] and [[mask]] tables touch are tracked again."
        ),
    ] = False,
    overwrite: Annotated[bool, typer.Option(help="Replace the run that the folder holds.")] = False,
    first_frame: Annotated[
        bool,
        typer.Option("--first-frame", help="Track one frame and draw it in every camera: is [start] right?"),
    ] = False,
    take: Annotated[
        int | None,
        typer.Option(min=1, help="Without [start]: the number of the pose in candidates.json to start from."),
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            help="Instead of the trial's: refined, joint, hierarchical, stepping, simplex; "
            "of players blocker, block-jump, mixture, framework."
        ),
    ] = None,
    every: Annotated[int | None, typer.Option(min=1, help="Track every n-th frame or field.")] = None,
    cameras: Annotated[str | None, typer.Option(help="Only these cameras, separated by commas.")] = None,
    pictures: Annotated[bool, typer.Option(help="Write overlay videos, figures and the report.")] = True,
    overlay: Annotated[str | None, typer.Option(help="What overlay videos of players show: paper, broadcast.")] = None,
    live: Annotated[
        bool, typer.Option(help="Players: read pipes, capture devices, or files at their own speed; late frames drop.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Track a trial; results appear in the output folder while it is tracked.

    Example: airborne track trial.toml -o results
    """
    options = {"method": method, "every": every, "overlay": overlay}
    changes = {key: value for key, value in options.items() if value is not None}
    run = _track(
        trial,
        output,
        resume=resume,
        overwrite=overwrite,
        pictures=pictures,
        first_frame=first_frame,
        take=take,
        changes=changes,
        cameras=cameras,
        live=live,
    )
    if as_json:
        print((output / "summary.json").read_text(encoding="utf-8"), end="")
    else:
        if run.was_finished:
            print(f"{output} holds this run, finished; nothing was tracked again (--overwrite tracks it anew)")
        print(f"{_describe(run.summary, output)}\nresults: {_describe_results(output)}")
    from airborne.export.summary import count_tracked, is_hardly_tracked

    is_found = count_tracked(run.summary) or (first_frame and run.summary.get("n_uncertain"))
    if not is_found or is_hardly_tracked(run.summary):
        raise typer.Exit(UNTRACKED)


def _track(
    path: Path,
    output: Path,
    *,
    resume: bool,
    overwrite: bool,
    pictures: bool,
    first_frame: bool = False,
    take: int | None = None,
    changes: dict | None = None,
    cameras: str | None = None,
    live: bool = False,
    go_on: str = "--resume goes on",
) -> TrackResult:
    names = None if cameras is None else [name.strip() for name in cameras.split(",") if name.strip()]
    if names == []:
        raise AirborneError("--cameras names no camera; give their names, separated by commas")
    began_s = time.time()
    try:
        with Stages() as report:
            report("opening videos", 0, None)  # at once, as even loading the modules takes seconds
            from airborne.run.track import track_trial
            from airborne.trial.file import read_trial

            trial = read_trial(path, changes or {}, names, given_as="--{} {}")
            return track_trial(
                trial,
                output,
                resume=resume,
                overwrite=overwrite,
                live=live,
                pictures=pictures,
                first_frame=first_frame,
                take=take,
                progress=partial(report, f"tracking {trial.name}"),
                stage_progress=report,
            )
    except KeyboardInterrupt:
        written = [path for table in _FIRST_WRITTEN if (path := output / table).is_file()]
        if not written:
            stop("no frame was tracked yet")
        if overwrite and written[0].stat().st_mtime < began_s:
            stop(f"no frame was tracked yet; {output} still holds the run before")
        motion = output / _FIRST_WRITTEN[0]
        n = motion.read_text(encoding="utf-8").count("\n") - 1 if motion.is_file() else None  # below its header
        found = "what was found so far is" if n is None else f"{count(n, 'frame')} found so far, kept"
        stop(f"{found} in {output}{'' if live else f'; {go_on}'}")


def _describe_self_check(summary: dict) -> str | None:
    """Say what the self-check found; alarms are among the notes."""
    findings, n = summary.get("self_check"), summary["n_frames"]
    if findings is None or n in (summary["n_lost"], 1):
        return None
    if any(each["is_alarm"] for each in findings):
        return "self-check: something is wrong, see the notes"
    from airborne.export.summary import is_mostly_untracked

    if is_mostly_untracked(summary):
        tracked = count_of(summary["n_tracked"], n, "frame")
        return f"self-check of sizes, cameras and times: {tracked} tracked, too few to say that nothing is wrong"
    if not findings:
        return None
    said = "; ".join(each["sentence"] for each in findings[:2])
    return f"self-check of sizes, cameras and times: nothing seems wrong; {said}"


def _overlays(output: Path) -> list[Path]:
    """Return the overlays that a run left: its videos, or after --first-frame images."""
    return sorted([*output.glob("videos/overlay_*"), *output.glob("figures/overlay_*")])


def _describe_results(output: Path) -> str:
    """Say where the results are, and what to open first."""
    from airborne.motion.run_folder import REPORT

    first = [output / REPORT] if (output / REPORT).is_file() else _overlays(output)
    return f"{output}; open {', '.join(map(str, first))}" if first else str(output)


def _describe(summary: dict, output: Path) -> str:
    counts = ", ".join(f"{summary[f'n_{status}']} {status}" for status in ("tracked", "uncertain", "lost"))
    n, rate_hz = summary["n_frames"], summary["rate_hz"]
    lines = [f"{count(n, 'frame')}{f' at {rate_hz:.5g} Hz' if n > 1 else ''}: {counts}"]
    drawn = [path.relative_to(output).as_posix() for path in _overlays(output)]
    look = f"look at the first frame in {', '.join(drawn)}" if drawn else ""
    look_and = f"{look} and " if look else ""
    said_above: list[str] = []
    if "players" in summary:
        from airborne.export.players_notes import players_warnings
        from airborne.export.players_report import players_summary

        said_above = list(players_warnings(summary))
        lines += players_summary(summary)
        if n == summary["n_lost"]:
            mend = "correct [[start.player]], or let `airborne find` look for them"
            lines.append(f"no player was found in any frame: {look_and}{mend}")
    elif summary["n_frames"] == summary["n_lost"]:
        lines.append(f"the body was found in no frame: {look_and}correct [start]")
    else:
        from airborne.export import describe_doubts
        from airborne.export.summary import is_mostly_untracked

        if summary["doubts"]:
            lines.append(f"uncertain: {describe_doubts(summary)}")
        if n == summary["n_uncertain"] == 1:
            said = "one frame alone does not show what else looks like the body, so it is often uncertain"
            lines.append(f"{said}: {look}, where every outline must lie on the body" if look else said)
        elif not summary["n_tracked"]:
            lines.append("no frame was tracked, so none of these numbers can be relied on")
        else:
            if is_mostly_untracked(summary):
                lines.append("what is said of the whole run, as its turns, rests on uncertain frames")
            position, rotation = summary["median_position_sd_mm"], summary["median_rotation_sd_deg"]
            lines.append(
                f"median sd: position {_describe_sd(position, 'mm')}, rotation {_describe_sd(rotation, 'degrees')}; "
                "summary.json says which errors these include"
            )
    if (line := _describe_self_check(summary)) is not None:
        lines.append(line)
    notes = [text for text in summary["warnings"] if text not in said_above]
    lines += [f"note: {text}" for text in [*notes, *summary["events"]]]
    return "\n".join(lines)


def _describe_sd(sd: float, unit: str) -> str:
    return f"{format_digits(sd, 2)} {unit}" if math.isfinite(sd) else "not visible in the images"
