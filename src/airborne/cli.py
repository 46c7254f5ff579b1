"""The command line: thin, one function a command."""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NoReturn

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from airborne import __version__
from airborne.errors import AirborneError

if TYPE_CHECKING:
    from airborne.pipeline import Run
    from airborne.players_pipeline import PlayersRun

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Measure athletes in flight from ordinary multi-camera colour video.",
)
synth = typer.Typer(no_args_is_help=True, help="Write a synthetic trial with its truth.")
app.add_typer(synth, name="synth")
reproduce = typer.Typer(no_args_is_help=True, help="Make a paper's experiment anew: its table beside ours.")
app.add_typer(reproduce, name="reproduce")

_SECONDS_A_LINE = 5.0
_AGAINST = {
    "truth": "against the truth",
    "digitised": "against digitising by hand",
    "joints": "against the paths of the joints",
}
_UsageError: Any = typer.BadParameter.__bases__[0]  # wherever this version of typer keeps it

errors = Console(stderr=True, highlight=False, soft_wrap=True)

Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
Out = Annotated[Path, typer.Option("-o", "--output", help="Folder for the results.")]


def main() -> None:
    """Run the command line; a user's error is one line on stderr and exit code 2."""
    try:
        sys.exit(app(standalone_mode=False))
    except _UsageError as error:
        said, context = error.format_message(), getattr(error, "ctx", None)
        if "Usage:" in said or not said:  # a command without arguments: its help
            print(said, end="")
            sys.exit(2)
        _refuse(f"{' '.join(said.split())} See: {context.command_path if context else 'airborne'} --help")
    except (KeyboardInterrupt, typer.Abort):
        sys.exit(130)
    except AirborneError as error:
        _refuse(str(error))
    except OSError as error:
        _refuse(f"{error.filename or 'a file'}: {error.strerror or error}; give a path that can be read or written")


def _refuse(reason: str) -> NoReturn:
    errors.print(f"airborne: {reason}", style="red", markup=False)
    sys.exit(2)


@app.callback(invoke_without_command=True)
def _version(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    if version:
        print(__version__)
        raise typer.Exit


@app.command()
def demo(
    output: Out = Path("airborne-demo"),
    as_json: Json = False,
) -> None:
    """Track the bundled example, a thrown cross, and compare it with its truth.

    Example: airborne demo
    """
    from airborne.examples import example_trial

    trial = example_trial("thrown_cross")
    _forget_demo(trial, output)
    run = _track(trial, output, resume=False, pictures=True)
    if not as_json:
        print(_in_short(run.summary))
    evaluate(output, trial.parent / "truth.csv", trial.parent / "digitised.csv", as_json=as_json)
    if not as_json:
        print(f"report: {output / 'report.html'}")


def _forget_demo(path: Path, output: Path) -> None:
    """Let the demo be run again in its own folder; a folder with any other run is left alone."""
    from airborne.pipeline import holds_run_of
    from airborne.trial import read_trial

    if holds_run_of(read_trial(path), output):
        (output / "motion.csv").unlink(missing_ok=True)


@app.command()
def track(
    trial: Annotated[Path, typer.Argument(help="The trial's TOML file.")],
    output: Out,
    resume: Annotated[bool, typer.Option(help="Go on with a run that was stopped.")] = False,
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
    """Track a trial; results appear in the output folder as they are found.

    Example: airborne track trial.toml -o results
    """
    given = {"method": method, "every": every, "overlay": overlay}
    changes = {key: value for key, value in given.items() if value is not None}
    run = _track(trial, output, resume=resume, pictures=pictures, changes=changes, cameras=cameras, live=live)
    if as_json:
        print((output / "summary.json").read_text(encoding="utf-8"), end="")
    else:
        print(f"{_in_short(run.summary)}\nresults: {output}")
    if run.summary["n_frames"] == run.summary["n_lost"]:
        raise typer.Exit(1)


def _track(
    path: Path,
    output: Path,
    *,
    resume: bool,
    pictures: bool,
    changes: dict | None = None,
    cameras: str | None = None,
    live: bool = False,
) -> Run | PlayersRun:
    from airborne import pipeline
    from airborne.players_pipeline import track_players
    from airborne.trial import read_trial

    names = None if cameras is None else [name.strip() for name in cameras.split(",")]
    trial = read_trial(path, changes or {}, names)
    if live and not trial.has_players:
        raise AirborneError('--live is for players; this trial has no body preset = "legs"')
    try:
        with _progress(f"tracking {trial.name}") as report:
            if trial.has_players:
                return track_players(trial, output, resume=resume, live=live, pictures=pictures, progress=report)
            return pipeline.track(trial, output, resume=resume, pictures=pictures, progress=report)
    except KeyboardInterrupt:
        errors.print(f"airborne: stopped; the frames found so far are in {output}; --resume goes on", markup=False)
        raise typer.Exit(130) from None


def _in_short(summary: dict) -> str:
    from airborne.export.players_report import players_in_short

    counts = ", ".join(f"{summary[f'n_{status}']} {status}" for status in ("tracked", "uncertain", "lost"))
    lines = [f"{summary['n_frames']} frames at {summary['rate_hz']:.5g} Hz: {counts}"]
    if "players" in summary:
        lines += players_in_short(summary)
    elif summary["n_frames"] == summary["n_lost"]:
        lines.append("the body was found in no frame: look at the first picture of the overlay videos, mend [start]")
    else:
        position, rotation = summary["median_position_sd_mm"], summary["median_rotation_sd_deg"]
        lines.append(
            f"median sd: position {_or_unseen(position, 'mm')}, rotation {_or_unseen(rotation, 'degrees')}; "
            "summary.json says which errors it holds"
        )
    lines += [f"note: {text}" for text in [*summary["warnings"], *summary["events"]]]
    return "\n".join(lines)


def _or_unseen(sd: float, unit: str) -> str:
    return f"{sd:.2g} {unit}" if math.isfinite(sd) else "not seen in the pictures"


@app.command()
def calibrate(
    points: Annotated[Path, typer.Argument(help="Control points: point,x_m,y_m,z_m,<camera>_u,<camera>_v,...")],
    size: Annotated[str, typer.Option(help="Image size in pixels, WIDTHxHEIGHT, or name=WIDTHxHEIGHT,...")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Calibration file to write (Pose2Sim TOML).")],
    method: Annotated[
        Literal["lm", "annealing"], typer.Option(help="Fit: least squares, or simulated annealing.")
    ] = "lm",
    as_json: Json = False,
) -> None:
    """Find the cameras from surveyed control points.

    Example: airborne calibrate control_points.csv --size 768x576 -o calib.toml
    """
    from airborne import cameras

    table = cameras.read_control_points(points)
    calibration = cameras.calibrate(table, _sizes(size, table.cameras), method=method)
    cameras.write_pose2sim(output, calibration.rig, errors_px={fit.name: fit.rms_px for fit in calibration.fits})
    print(json.dumps(cameras.to_dict(calibration)) if as_json else cameras.describe(calibration))
    if not as_json:
        print(f"written: {output}")


def _sizes(text: str, names: tuple[str, ...]) -> dict[str, tuple[int, int]]:
    """Parse 768x576 for all cameras, or cam1=768x576,cam2=1920x1080."""
    sizes = {}
    try:
        for item in text.split(","):
            name, _, numbers = item.rpartition("=")
            width, height = (int(number) for number in numbers.lower().split("x"))
            sizes |= {n: (width, height) for n in ([name] if name else names)}
    except ValueError:
        raise AirborneError(f"--size {text}: expected WIDTHxHEIGHT such as 768x576, or cam1=768x576,cam2=...") from None
    missing = [name for name in names if name not in sizes]
    if missing:
        raise AirborneError(f"--size gives no size for {', '.join(missing)}; add {missing[0]}=WIDTHxHEIGHT")
    return sizes


@app.command("fit-body")
def fit_body(
    trial: Annotated[Path, typer.Argument(help="The trial's TOML file; its [start] has detections or joints_m.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="The body file to write.")],
    frames: Annotated[int, typer.Option(min=1, help="How many frames to fit the body to.")] = 5,
) -> None:
    """Fit the trial's body to the person in its videos: lengths, girths, colours and where these change.

    Example: airborne fit-body trial.toml -o person.toml
    """
    from airborne.fitting import described, fit_person
    from airborne.trial import read_trial

    with _progress("reading and fitting") as report:
        fitted = fit_person(
            read_trial(trial), output, n_frames=frames, progress=lambda what, done, total: report(done, total)
        )
    print(f"{described(fitted)}\nbody: {output}\npicture: {fitted.picture}")


@app.command()
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


@synth.command("cross")
def synth_cross(
    output: Out,
    preset: Annotated[Literal["half-twist", "side-somersault"], typer.Option(help="The throw.")] = "half-twist",
    seed: Annotated[int, typer.Option(help="Seed of everything random.")] = 0,
) -> None:
    """Write a thrown wooden cross: interlaced videos of three cameras, calibration, clicks, truth.

    Example: airborne synth cross -o my-trial --seed 3
    """
    from airborne.synthetic import write_thrown_cross

    with _progress("rendering") as report:
        write_thrown_cross(output, preset=preset, seed=seed, progress=report)
    print(f"trial: {output / 'trial.toml'}")


@synth.command("somersault")
def synth_somersault(
    output: Out,
    preset: Annotated[
        Literal["paper", "moving-arms", "pike"], typer.Option(help="11 poses of one shape, or 50 frames/s that move.")
    ] = "paper",
    target: Annotated[Literal["skin", "ellipsoids"], typer.Option(help="The surface of the person drawn.")] = "skin",
    style: Annotated[
        Literal["exact", "gym"], typer.Option(help="Pictures in the tracker's own light, or of cameras in a hall.")
    ] = "exact",
    seed: Annotated[int, typer.Option(help="Seed of everything random.")] = 0,
) -> None:
    """Write a half-twisting somersault: videos from front, side and top, calibration, body, truth, the person as glTF.

    Example: airborne synth somersault -o my-somersault --preset moving-arms --style gym
    """
    from airborne.export import write_model
    from airborne.synthetic import somersault, write_somersault

    with _progress("rendering") as report:
        write_somersault(output, preset=preset, target=target, style=style, seed=seed, progress=report)
    write_model(output / "person.glb", somersault(preset, target=target, style=style, seed=seed).body)
    print(f"trial: {output / 'trial.toml'}")


@synth.command("block")
def synth_block(
    output: Out,
    seed: Annotated[int, typer.Option(help="Seed of everything random.")] = 0,
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
    from dataclasses import replace

    from airborne.synthetic import DIFFICULTIES, block_scene, write_block

    given = {"frame_rate": frame_rate, "n_cameras": cameras}
    hardness = replace(DIFFICULTIES[difficulty], **{key: value for key, value in given.items() if value is not None})
    with _progress("rendering") as report:
        write_block(output, block_scene(seed, n_blockers=blockers, difficulty=hardness), progress=report)
    print(f"trial: {output / 'trial.toml'}")


@reproduce.command("rigid")
def reproduce_rigid(
    output: Out = Path("reproduced-rigid"),
    quick: Annotated[bool, typer.Option("--quick", help="Fewer poses, methods and cases: under a minute.")] = False,
    as_json: Json = False,
) -> None:
    """Track a synthetic somersault as the rigid-body paper does, and better: errors, curves, sensitivity; minutes.

    Example: airborne reproduce rigid -o rigid
    """
    from airborne.reproduction import rigid

    try:
        with _progress("tracking") as report:
            summary = rigid.reproduce_rigid(output, quick=quick, progress=report)
    except KeyboardInterrupt:
        errors.print(f"airborne: stopped; the files finished so far are in {output}", markup=False)
        raise typer.Exit(130) from None
    print((output / "summary.json").read_text(encoding="utf-8") if as_json else rigid.describe(summary))
    if not as_json:
        print(f"results: {output}")


@reproduce.command("blockjump")
def reproduce_blockjump(
    output: Out = Path("reproduced-blockjump"),
    quick: Annotated[bool, typer.Option("--quick", help="Two sequences, two seeds: about a minute.")] = False,
    seeds: Annotated[int | None, typer.Option(min=1, help="Seeds of each method; 5 unless --quick.")] = None,
    processes: Annotated[int | None, typer.Option(min=1, help="Sequences at a time; as many as cores.")] = None,
    as_json: Json = False,
) -> None:
    """Track 22 synthetic block jumps as the block-jump paper does, and better: its Table I, strict errors; 20 minutes.

    A command that was stopped goes on where it was. Example: airborne reproduce blockjump -o blockjump
    """
    from airborne.reproduction import block_jump

    try:
        with _progress("tracking") as report:
            summary = block_jump.reproduce_blockjump(
                output, quick=quick, progress=report, n_processes=processes, n_seeds=seeds
            )
    except KeyboardInterrupt:
        errors.print(f"airborne: stopped; give the same command again to go on; sequences in {output}", markup=False)
        raise typer.Exit(130) from None
    print((output / "summary.json").read_text(encoding="utf-8") if as_json else block_jump.describe(summary))
    if not as_json:
        print(f"results: {output}")


@app.command()
def bench(as_json: Json = False) -> None:
    """Measure the speed of this machine on the bundled example: CPU time per field, and per hypothesis.

    Example: airborne bench
    """
    from airborne.bench import measure_speed

    found = measure_speed()
    print(json.dumps(found) if as_json else "\n".join(f"{name}: {value:.3g}" for name, value in found.items()))


@contextmanager
def _progress(what: str) -> Iterator:
    """Show a bar on stderr while frames go by; where stderr is no terminal, a line every few seconds."""
    if not errors.is_terminal:
        yield _Lines(what)
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=errors, transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


class _Lines:
    """Progress as plain lines."""

    def __init__(self, what: str) -> None:
        self._what, self._next_s = what, time.monotonic() + _SECONDS_A_LINE

    def __call__(self, done: int, total: int | None) -> None:
        if time.monotonic() >= self._next_s:
            self._next_s = time.monotonic() + _SECONDS_A_LINE
            errors.print(f"{self._what}: {done} of {total or 'unknown'}", markup=False)
