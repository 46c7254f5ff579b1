"""One recording from files to results: video + calibration -> frames -> poses -> motion -> report."""

from __future__ import annotations

import shutil
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from airborne.body import BodyModel, Pose, PosedBody, surface_arrays
from airborne.body.files import body_toml, mesh_files
from airborne.calibration.from_points import Calibration
from airborne.cameras import Rig, write_pose2sim
from airborne.export import (
    ContactSheet,
    MatchingPicture,
    OverlayVideos,
    headline,
    write_figures,
    write_json,
    write_report,
)
from airborne.motion import (
    Motion,
    MotionWriter,
    flight_summary,
    has_inertias,
    read_estimates,
    read_motion,
    write_angles,
    write_flight,
    write_joint_angles,
    write_joints,
    write_motion_parquet,
)
from airborne.rendering import FLAT, render
from airborne.run.first_pose import find_first_pose
from airborne.run.opening import (
    cameras_of,
    holds_run_of,
    input_hashes,
    list_tables,
    open_trial,
    past_the_end_error,
    prepare_folder,
    provenance,
    run_identity,
)
from airborne.tracking import Estimate
from airborne.tracking.methods import sample_body_colours, tracker_of
from airborne.trial.file import Trial
from airborne.types import Progress
from airborne.video import Recording, View

__all__ = ["Run", "cameras_of", "holds_run_of", "input_hashes", "open_trial", "track"]

_UNCERTAINTY = (
    "Standard deviations hold what the pictures leave open: noise, light, and edges that are not where the drawn body "
    "has them. They do not hold a body measured wrongly all over, or wrong times of the cameras."
)
_CALIBRATION_UNCERTAINTY = " They hold how far the control points leave each camera's picture open."


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """The results of a finished run; its folder holds the same."""

    motion: Motion
    summary: dict[str, Any]


def track(
    trial: Trial, folder: Path, *, resume: bool = False, pictures: bool = True, progress: Progress | None = None
) -> Run:
    """Track a trial and write the results into a folder.

    `resume` continues a run that was killed, to the same result. `pictures=False` leaves out videos, figures and
    report. Raises an AirborneError for input that cannot be used, and for a folder that holds another run.
    """
    started_s = time.monotonic()
    recording, calibration = open_trial(trial)
    model = trial.model()
    start = find_first_pose(trial, model, recording.rig)
    recording.events.extend(start.notes)
    identity = run_identity(trial)
    done = (
        read_estimates(folder / "motion.csv") if prepare_folder(folder, identity, "motion.csv", resume=resume) else []
    )
    _copy_inputs(folder, trial, model, recording.rig)
    read_s = time.monotonic()
    model = _track_frames(
        trial, model, start.pose, recording, folder=folder, done=done, pictures=pictures, progress=progress
    )
    tracked_s = time.monotonic()
    motion = read_motion(folder / "motion.csv")
    _write_tables(folder, motion, model)
    summary = _summary(trial, calibration, recording, motion=motion, model=model, inputs=identity["inputs"])
    summary["tables"] = list_tables(folder)
    if pictures:
        write_figures(folder, motion, model)
    summary["timings_s"] = {
        "opening": read_s - started_s,
        "tracking": tracked_s - read_s,
        "writing": time.monotonic() - tracked_s,
    }
    write_json(folder / "summary.json", summary)
    if pictures:
        write_report(folder, summary)
    return Run(motion, summary)


def _copy_inputs(folder: Path, trial: Trial, model: BodyModel, rig: Rig) -> None:
    """Write the cameras and the body beside the results, for `airborne evaluate` and for other tools."""
    write_pose2sim(folder / "calib.toml", rig)
    if trial.body.file is None:
        (folder / "body.toml").write_text(body_toml(model), encoding="utf-8")
        return
    body = trial.path(trial.body.file)
    shutil.copyfile(body, folder / "body.toml")
    for name in mesh_files(body):
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(body.parent / name, target)


def _track_frames(
    trial: Trial,
    model: BodyModel,
    start: Pose,
    recording: Recording,
    *,
    folder: Path,
    done: list[Estimate],
    pictures: bool,
    progress: Progress | None,
) -> BodyModel:
    """Track every frame and write its estimate at once; from frames in `done` the tracker only learns."""
    with ExitStack() as stack:
        frames = stack.enter_context(closing(iter(recording)))
        first = next(frames, None)
        if first is None:
            raise past_the_end_error(trial)
        model = sample_body_colours(model, start, first)
        tracker = tracker_of(trial.settings, model, start)
        joints = tuple(segment.name for segment in model.segments[1:])
        writer = stack.enter_context(MotionWriter(folder / "motion.csv", joints, resume=bool(done)))
        artists = [stack.enter_context(artist) for artist in _artists(folder, recording, pictures)]
        state, finished, missing = tracker.init(), iter(done), Counter[str]()
        if not np.any([_is_visible(view, model.with_pose(start)) for view in first.views]):
            recording.events.append("the start pose lies in no camera's picture; check start.position_m, in metres")
        for number, observed in enumerate(chain([first], frames), start=1):
            estimate = next(finished, None)
            if estimate is None:
                estimate = tracker.search(state, observed)
                writer.append(estimate)
            state = tracker.learn(state, observed, estimate)
            missing.update(
                camera.name for camera, view in zip(recording.rig, observed.views, strict=True) if view is None
            )
            pose = start if number == 1 and estimate.pose is None else estimate.pose  # show a start that failed
            posed = None if pose is None else model.with_pose(pose)
            for artist in artists:
                artist.write(observed, posed, estimate.status)
            if progress is not None:
                progress(number, recording.n_frames)
        for name, n in missing.items():
            recording.events.append(f"{name}: no picture at {n} of {number} frames")
    return model


def _is_visible(view: View | None, posed: PosedBody) -> bool:
    """Say whether a view shows any part of the body."""
    return view is not None and bool(render(surface_arrays(posed.model), posed, view.camera, FLAT).mask.any())


def _artists(folder: Path, recording: Recording, pictures: bool) -> Iterator[Any]:
    """Return what draws the frames while they are tracked: context managers with `write`."""
    if pictures:
        yield OverlayVideos(folder, recording.rig, recording.rate)
        yield ContactSheet(folder / "through_mask.png", recording.rig)
        yield MatchingPicture(folder / "matching.png", recording.rig)


def _write_tables(folder: Path, motion: Motion, model: BodyModel) -> None:
    write_motion_parquet(folder / "motion.parquet", motion)
    write_angles(folder / "angles.csv", motion)
    write_joints(folder / "joints.csv", motion, model)
    if motion.joints:
        write_joint_angles(folder / "joint_angles.csv", motion, model)
    if motion.joints and has_inertias(model):
        write_flight(folder / "flight.csv", motion, model)


def _summary(
    trial: Trial,
    calibration: Calibration | None,
    recording: Recording,
    *,
    motion: Motion,
    model: BodyModel,
    inputs: dict[str, str],
) -> dict[str, Any]:
    return {
        "name": trial.name,
        **headline(motion),
        **({"flight": flight_summary(motion, model).to_dict()} if motion.joints and has_inertias(model) else {}),
        "uncertainty": _UNCERTAINTY if calibration is None else _UNCERTAINTY + _CALIBRATION_UNCERTAINTY,
        **provenance(trial, calibration, recording, inputs),
    }
