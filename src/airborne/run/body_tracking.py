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

from airborne.body import BodyModel, Pose, PosedBody, geometry
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
from airborne.run.first_pose import first_pose
from airborne.run.opening import (
    Progress,
    begin,
    cameras_of,
    circumstances,
    holds_run_of,
    identity_of,
    inputs_of,
    open_trial,
    past_the_end,
)
from airborne.tracking import Estimate
from airborne.tracking.methods import sampled, tracker_of
from airborne.trial.file import Trial
from airborne.video import Recording, View

__all__ = ["Run", "cameras_of", "holds_run_of", "inputs_of", "open_trial", "track"]

UNCERTAINTY = (
    "Standard deviations hold what the pictures leave open: noise, light, and edges that are not where the drawn body "
    "has them. They do not hold a body measured wrongly all over, or wrong times of the cameras."
)
OF_POINTS = " They hold how far the control points leave each camera's picture open."


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """What a finished run leaves; the same lies in its folder."""

    motion: Motion
    summary: dict[str, Any]


def track(
    trial: Trial, folder: Path, *, resume: bool = False, pictures: bool = True, progress: Progress | None = None
) -> Run:
    """Track a trial and leave the results in a folder.

    A run that was killed goes on with `resume`, to the same result. `pictures=False` leaves out videos, figures and
    report. Raises an AirborneError for input that cannot be used, and for a folder that holds another run.
    """
    begun_s = time.monotonic()
    recording, calibration = open_trial(trial)
    model = trial.model()
    start = first_pose(trial, model, recording.rig)
    recording.events.extend(start.notes)
    identity = identity_of(trial)
    done = read_estimates(folder / "motion.csv") if begin(folder, identity, "motion.csv", resume=resume) else []
    _keep_inputs(folder, trial, model, recording.rig)
    read_s = time.monotonic()
    model = _track_frames(trial, model, start.pose, recording, folder, done, pictures, progress)
    tracked_s = time.monotonic()
    motion = read_motion(folder / "motion.csv")
    _write_tables(folder, motion, model)
    summary = _summary(trial, calibration, recording, motion, model, identity["inputs"])
    if pictures:
        write_figures(folder, motion, model)
    summary["timings_s"] = {
        "opening": read_s - begun_s,
        "tracking": tracked_s - read_s,
        "writing": time.monotonic() - tracked_s,
    }
    write_json(folder / "summary.json", summary)
    if pictures:
        write_report(folder, summary)
    return Run(motion, summary)


def _keep_inputs(folder: Path, trial: Trial, model: BodyModel, rig: Rig) -> None:
    """Leave the cameras and the body beside the results, for `airborne evaluate` and for other tools."""
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
    folder: Path,
    done: list[Estimate],
    pictures: bool,
    progress: Progress | None,
) -> BodyModel:
    """Track every frame and write it as soon as it is found; of frames in `done` the tracker only learns."""
    with ExitStack() as stack:
        frames = stack.enter_context(closing(iter(recording)))
        first = next(frames, None)
        if first is None:
            raise past_the_end(trial)
        model = sampled(model, start, first)
        tracker = tracker_of(trial.settings, model, start)
        joints = tuple(segment.name for segment in model.segments[1:])
        writer = stack.enter_context(MotionWriter(folder / "motion.csv", joints, resume=bool(done)))
        artists = [stack.enter_context(artist) for artist in _artists(folder, recording, pictures)]
        state, finished, missing = tracker.init(), iter(done), Counter[str]()
        if not np.any([_shows(view, model.with_pose(start)) for view in first.views]):
            recording.events.append("the start pose lies in no camera's picture; check start.position_m, in metres")
        for number, seen in enumerate(chain([first], frames), start=1):
            estimate = next(finished, None)
            if estimate is None:
                estimate = tracker.search(state, seen)
                writer.append(estimate)
            state = tracker.learn(state, seen, estimate)
            missing.update(camera.name for camera, view in zip(recording.rig, seen.views, strict=True) if view is None)
            pose = start if number == 1 and estimate.pose is None else estimate.pose  # show a start that failed
            posed = None if pose is None else model.with_pose(pose)
            for artist in artists:
                artist.write(seen, posed, estimate.status)
            if progress is not None:
                progress(number, recording.n_frames)
        for name, n in missing.items():
            recording.events.append(f"{name}: no picture at {n} of {number} frames")
    return model


def _shows(view: View | None, posed: PosedBody) -> bool:
    """Say whether any of the body lies in a view."""
    return view is not None and bool(render(geometry(posed.model), posed, view.camera, FLAT).mask.any())


def _artists(folder: Path, recording: Recording, pictures: bool) -> Iterator[Any]:
    """Return what draws the frames as they go by: context managers with `write`."""
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
    motion: Motion,
    model: BodyModel,
    inputs: dict[str, str],
) -> dict[str, Any]:
    return {
        "name": trial.name,
        **headline(motion),
        **({"flight": flight_summary(motion, model).to_dict()} if motion.joints and has_inertias(model) else {}),
        "uncertainty": UNCERTAINTY if calibration is None else UNCERTAINTY + OF_POINTS,
        **circumstances(trial, calibration, recording, inputs),
    }
