"""The command that smooths a run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from airborne.cli.console import Json, errors, progress
from airborne.errors import ResultError

if TYPE_CHECKING:
    from airborne.motion.smoothing.settings import Smoothing, SmoothingName


def smooth_command(
    results: Annotated[Path, typer.Argument(help="Folder of a run.")],
    *,
    butterworth: Annotated[
        str | None,
        typer.Option(help="Cut-off in Hz of a zero-lag Butterworth filter, or auto: that of the residual analysis."),
    ] = None,
    spline: Annotated[bool, typer.Option("--spline", help="Smoothing splines by cross-validation.")] = False,
    kalman: Annotated[bool, typer.Option("--kalman", help="Kalman smoother with the run's own covariances.")] = False,
    fill: Annotated[float, typer.Option(help="Fill gaps up to so many seconds.")] = 0.0,
    events: Annotated[
        str,
        typer.Option(help="Times in s that no filter crosses, as 0.31,0.92; or auto: take-offs and landings; or none."),
    ] = "auto",
    resample: Annotated[
        float | None, typer.Option(help="Rate in Hz for --butterworth where sampling is uneven.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder for the results; else the run's.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Smooth a run and compute velocities and accelerations: new tables beside the raw ones.

    Without a method the Kalman smoother, which uses the run's own covariances.

    Example: airborne smooth results
    """
    from airborne.export.summary import json_ready
    from airborne.motion.run_folder import note_if_unfinished
    from airborne.run.smooth import smooth_run

    note = ""
    options: dict[SmoothingName, str | bool | None] = {"butterworth": butterworth, "spline": spline, "kalman": kalman}
    given: dict[SmoothingName, str | bool] = {
        name: value for name, value in options.items() if value not in (None, False)
    }
    if not given:
        given["kalman"], note = True, "no method was given: smoothed with --kalman, by the run's own covariances"
    settings = _smoothing(given, fill_s=fill, resample_hz=resample)
    with progress("smoothing") as report:
        done = smooth_run(results, settings, events_s=_times(events), out=output, progress=report)
    if note:
        errors.print(note, markup=False)
    if (unfinished := note_if_unfinished(results)) is not None:
        errors.print(f"note: {unfinished}", markup=False)
    print(json.dumps(json_ready(done.to_dict())) if as_json else done.describe())


def _smoothing(given: dict[SmoothingName, str | bool], *, fill_s: float, resample_hz: float | None) -> Smoothing:
    """Return the one method that was given, with its settings: its option's value may be a cut-off."""
    from airborne.motion.smoothing.settings import Smoothing

    if len(given) > 1:
        raise ResultError(f"give one way to smooth, not {' and '.join(f'--{name}' for name in given)}")
    ((name, value),) = given.items()
    cutoff_hz = None if value in (True, "auto") else _number(str(value), f"--{name}", "a cut-off in Hz, or auto")
    return Smoothing(method=name, cutoff_hz=cutoff_hz, resample_hz=resample_hz, fill_s=fill_s)


def _times(text: str) -> list[float] | None:
    if text in ("auto", "none"):
        return None if text == "auto" else []
    return [_number(word, "--events", "times in seconds as 0.31,0.92, or auto, or none") for word in text.split(",")]


def _number(text: str, option: str, expected: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ResultError(f"{option} is '{text}'; give {expected}") from None
