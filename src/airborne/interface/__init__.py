"""The public functions of `import airborne`: what the commands do, with values instead of files where that is shorter.

Paths may be text. `progress=True` shows a bar; a function is called with the steps done and expected, where there are
several stages with the name of the stage before them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from inspect import signature
from numbers import Integral
from pathlib import Path
from typing import Any, Literal

import numpy as np

from airborne.calibration import (
    Calibration,
    RigCalibration,
    calibrate_from,
    read_control_points,
    read_sources,
)
from airborne.calibration import calibrate as calibrate_points
from airborne.calibration.acceptance import require_plausible
from airborne.errors import AirborneError, RunThereError, require_choice
from airborne.interface.arguments import (
    FilePath,
    as_list,
    explain_paths,
    folder_of,
    report_progress,
    report_stages,
    to_times,
)
from airborne.io.names import to_path
from airborne.motion.smoothing.settings import SMOOTHING_METHODS, Smoothing, SmoothingName
from airborne.run.evaluate import AgreementReport, Comparison, assess, evaluate_agreement
from airborne.run.export import EXPORT_FORMATS, ExportResult
from airborne.run.export import export_run as write_export
from airborne.run.own_body import PersonFit, fit_person
from airborne.run.result import Run
from airborne.run.smooth import SmoothRun, smooth_run
from airborne.run.track import track_trial
from airborne.synthetic import block_scene, write_block, write_somersault, write_thrown_cross
from airborne.trial.file import Trial
from airborne.trial.file import read_trial as read_trial_file
from airborne.types import Progress, Size, StageProgress

__all__ = ["calibrate", "evaluate", "export_run", "fit_body", "read_run", "read_trial", "smooth", "synthesise", "track"]

_SCENES = ("cross", "somersault", "block")


@explain_paths
def read_trial(path: FilePath, *, cameras: Sequence[str] | None = None, **track: Any) -> Trial:
    """Read a trial file; keywords replace entries of its [track] table, `cameras` selects cameras by name.

    Raises TrialError, naming the file and what is wrong.

    >>> trial = read_trial("trial.toml", stop=3, method="refined")
    >>> trial.track.stop
    3
    """
    settings = {name: value.item() if isinstance(value, np.generic) else value for name, value in track.items()}
    return read_trial_file(to_path(path), settings, cameras)


@explain_paths
def track(
    trial: Trial | FilePath,
    folder: FilePath,
    *,
    resume: bool = False,
    overwrite: bool = False,
    pictures: bool = True,
    progress: bool | Progress = False,
) -> Run:
    """Track a trial, a body or players, and write the results into a folder; as `airborne track` does.

    `resume` continues a run that was stopped, to the same result; `overwrite` replaces one. `pictures=False` leaves
    out videos, figures and report. Raises an AirborneError for input that cannot be used, and for a folder that holds
    another run.

    >>> run = track("trial.toml", "again", pictures=False, progress=True)
    >>> run
    Run('again'): thrown cross, half-twisting somersault, 5 frames: 5 tracked, 0 uncertain, 0 lost
    """
    trial = trial if isinstance(trial, Trial) else read_trial(trial)
    try:
        with report_progress(progress, f"tracking {trial.name}") as report:
            track_trial(trial, to_path(folder), resume=resume, overwrite=overwrite, pictures=pictures, progress=report)
    except RunThereError as error:
        raise RunThereError(
            f"{folder} already holds a run; give resume=True, overwrite=True or another folder"
        ) from error
    return read_run(folder)


@explain_paths
def read_run(folder: FilePath) -> Run:
    """Return the run in a folder, finished or not; raises ResultError where there is none.

    >>> read_run("results").summary["n_frames"]
    5
    """
    return Run(to_path(folder).absolute())


@explain_paths
def calibrate(
    sources: FilePath,
    *,
    sizes: Size | Mapping[str, Size] | None = None,
    method: Literal["lm", "annealing"] = "lm",
    progress: bool | StageProgress = False,
) -> Calibration | RigCalibration:
    """Calibrate cameras from a file of sources (.toml), or from a table of control points (.csv); `.rig` has them.

    A table needs `sizes`, (width, height) [px] of all images, or by camera; `method` is for tables too. Raises an
    AirborneError where cameras cannot be estimated, or come out too wrong to measure with.

    >>> rig = calibrate("control_points.csv", sizes=(768, 576)).rig
    >>> rig["cam1"].px_from_world([0.0, 0.0, 1.3]).shape
    (2,)
    """
    if to_path(sources).suffix.lower() == ".toml":
        if sizes is not None:
            raise AirborneError("sizes go with a table of control points; a file of sources has size = [width, height]")
        with report_stages(progress) as report:
            found = calibrate_from(read_sources(to_path(sources)), report)
        require_plausible(found)
        return found
    if sizes is None:
        raise AirborneError("sizes is missing: give the image size in pixels, such as sizes=(768, 576)")
    table = read_control_points(to_path(sources))
    given = sizes if isinstance(sizes, Mapping) else dict.fromkeys(table.cameras, sizes)
    for size in given.values():
        if not (isinstance(size, Sequence) and len(size) == 2 and all(isinstance(number, Integral) for number in size)):
            raise AirborneError(f"sizes holds {size!r}; expected (width, height) in pixels, such as (768, 576)")
    by_camera = {name: (int(width), int(height)) for name, (width, height) in given.items()}
    missing = [name for name in table.cameras if name not in by_camera]
    if missing:
        raise AirborneError(f"sizes gives no size for {', '.join(missing)}; add (width, height) in pixels")
    calibration = calibrate_points(table, by_camera, method=method)
    require_plausible(calibration)
    return calibration


@explain_paths
def fit_body(
    trial: Trial | FilePath,
    output: FilePath,
    *,
    n_frames: int = 5,
    skeleton: str | None = None,
    progress: bool | StageProgress = False,
) -> PersonFit:
    """Fit a trial's body to the person in its images, and write the body file; as `airborne fit-body` does.

    The trial's [start] has detections or joints_m; `skeleton` says whose points detections are where their files do
    not. Raises an AirborneError for input that cannot be used.

    >>> fit_body("trial.toml", "person.toml")
    Traceback (most recent call last):
    airborne.errors.TrialError: thrown cross, half-twisting somersault: fitting the body needs known joints; ...
    """
    trial = trial if isinstance(trial, Trial) else read_trial(trial)
    with report_stages(progress) as report:
        return fit_person(trial, to_path(output), n_frames=n_frames, skeleton=skeleton, progress=report)


@explain_paths
def evaluate(
    run: Run | FilePath,
    truth: FilePath | None = None,
    *,
    digitised: FilePath | None = None,
    joints: FilePath | None = None,
    joint_angles: FilePath | None = None,
    flight: FilePath | None = None,
    repeats: FilePath | Run | Sequence[FilePath | Run] = (),
    operators: FilePath | Sequence[FilePath] = (),
) -> Mapping[str, Comparison | AgreementReport]:
    """Compare a run with the truth, with clicked points, with paths of joints, with a flight; into its summary too.

    Returns a comparison for each, by name, which describes itself (`.describe()`). With `joint_angles`, with `repeats`,
    other runs of the same trial, or `operators`, other people's clicks beside `digitised`, there is `agreement` too: of
    the run with all of them and between the repetitions, with tables and figures in the run's folder. What seems
    wrong with a reference, such as its unit, its clock or its recording, is among the comparison's `questions`. Raises
    an AirborneError where a file cannot be read, or nothing in it can be compared.

    >>> evaluate("results", "truth.csv")["truth"].n_matched
    5
    """
    references = [None if path is None else to_path(path) for path in (truth, digitised, joints)]
    angles = None if joint_angles is None else to_path(joint_angles)
    runs, clicks = ([folder_of(one) for one in as_list(each)] for each in (repeats, operators))
    of_flight = None if flight is None else to_path(flight)
    is_alone = not any((*references, of_flight))
    if is_alone and not (angles or runs or clicks):
        raise AirborneError(
            "nothing to compare with; give truth, digitised, joints, joint_angles or flight, the path of a table, or "
            "repeats"
        )
    folder = folder_of(run)
    compared = {} if is_alone else assess(folder, *references, flight=of_flight)
    if angles or runs or clicks:
        agreement = evaluate_agreement(
            folder, *references, joint_angles=angles, repeats=runs, operators=clicks, comparisons=compared
        )
        return {**compared, "agreement": agreement}
    return compared


@explain_paths
def smooth(
    run: Run | FilePath,
    method: SmoothingName | None = None,
    *,
    cutoff_hz: float | None = None,
    fill_s: float = 0.0,
    resample_hz: float | None = None,
    events_s: Sequence[float] | None = None,
    output: FilePath | None = None,
    progress: bool | Progress = False,
) -> SmoothRun:
    """Smooth a run and compute velocities and accelerations: new tables beside the raw ones, and in `.tables`.

    Without a method by the Kalman smoother, as `airborne smooth` does, or with a cut-off by a Butterworth filter. That
    filter without a cut-off gets the one of the residual analysis; gaps up to `fill_s` [s] are filled;
    `events_s` are the times [s] that no filter crosses, [] none, None those that are found. Raises an AirborneError for
    what cannot be smoothed so.

    >>> smooth("results", cutoff_hz=10, events_s=[]).tables["joints"]["velocity"].attrs["units"]
    'm/s'
    """
    method = method or ("kalman" if cutoff_hz is None else "butterworth")
    require_choice(method, tuple(SMOOTHING_METHODS), "method")
    if not isinstance(cutoff_hz, float | int | None):
        raise AirborneError(f"cutoff_hz is {cutoff_hz!r}; expected Hz, or None for that of the residual analysis")
    settings = Smoothing(method=method, cutoff_hz=cutoff_hz, resample_hz=resample_hz, fill_s=fill_s)
    out, times_s = None if output is None else to_path(output), to_times(events_s)
    with report_progress(progress, "smoothing") as report:
        return smooth_run(folder_of(run), settings, events_s=times_s, out=out, progress=report)


@explain_paths
def export_run(
    run: Run | FilePath, *formats: str, output: FilePath | None = None, progress: bool | StageProgress = False
) -> ExportResult:
    """Write a run for other programs: c3d, trc, mot, osim, gltf, bvh, csv, parquet; without formats all of them.

    Files go into `output`, or into the run's folder `export`. Raises ResultError for a format that cannot hold the run.

    >>> export_run("results", "c3d").files[0].name
    'results.c3d'
    """
    unknown = [format for format in formats if format not in EXPORT_FORMATS]
    if unknown:
        raise AirborneError(f"no format {', '.join(map(str, unknown))}; there are: {', '.join(EXPORT_FORMATS)}")
    with report_stages(progress) as report:
        return write_export(folder_of(run), None if output is None else to_path(output), formats, report)


@explain_paths
def synthesise(
    scene: Literal["cross", "somersault", "block"],
    folder: FilePath,
    *,
    seed: int = 0,
    progress: bool | Progress = False,
    **options: Any,
) -> Path:
    """Write a synthetic trial with its truth into a new folder, and return the trial file; as `airborne synth` does.

    Options are those of `write_thrown_cross`, `write_somersault` and `block_scene` in `airborne.synthetic`. Raises
    an AirborneError for an unknown scene, and for a folder that holds anything.

    >>> read_trial(synthesise("somersault", "practice", preset="paper")).has_players
    False
    """
    require_choice(scene, _SCENES, "scene")
    if not isinstance(seed, Integral) or seed < 0:
        raise AirborneError(f"seed is {seed!r}; expected a whole number, 0 or more")
    folder, write = to_path(folder), write_thrown_cross if scene == "cross" else write_somersault
    makes = signature(block_scene if scene == "block" else write)
    names = [name for name in makes.parameters if name not in ("folder", "seed", "progress")]
    if unknown := [name for name in options if name not in names]:
        raise AirborneError(f"synthesise has no option {', '.join(unknown)}; it has: {', '.join(names)}")
    with report_progress(progress, "rendering") as report:
        if scene == "block":
            write_block(folder, block_scene(seed, **options), progress=report)
        else:
            write(folder, seed=seed, progress=report, **options)
    return folder / "trial.toml"
