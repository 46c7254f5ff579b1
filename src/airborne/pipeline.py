"""One recording from files to results: video + calibration -> frames -> poses -> motion -> report."""

from __future__ import annotations

import hashlib
import json
import platform
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from importlib.metadata import version
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from airborne import __version__
from airborne.body import BodyModel
from airborne.body.files import read_body
from airborne.cameras import Calibration, Camera, Rig, calibrate, read_control_points, read_rig
from airborne.errors import ResultError, TrialError
from airborne.export import ContactSheet, OverlayVideos, headline, write_figures, write_json, write_report
from airborne.motion import Motion, MotionWriter, read_estimates, read_motion
from airborne.motion import write_angles, write_joints, write_motion_parquet
from airborne.tracking import Estimate, Status
from airborne.tracking.methods import METHODS, sampled, tracker_of
from airborne.trial import CameraTable, Trial
from airborne.video import Frames, Recording, VideoSource, inspect, open_recording

Progress = Callable[[int, int | None], None]  # frames done, frames expected

_HASHED_BYTES = 8 << 20  # of a large file, its first and last half of this and its length stand for it


@dataclass(frozen=True, slots=True)
class Run:
    """What a finished run leaves in memory; the same lies in its folder."""

    motion: Motion
    model: BodyModel
    rig: Rig
    summary: dict[str, Any]


def track(trial: Trial, folder: Path, *, resume: bool = False, pictures: bool = True, progress: Progress | None = None) -> Run:
    """Track a trial and leave its results in a folder; see the docs for what is in it.

    A run that was killed goes on with `resume`, to the same result. `pictures=False` leaves out videos, figures and
    report. Raises an AirborneError for unusable input, or a folder that holds another run.
    """
    sources = [_source(trial, camera) for camera in trial.camera]
    rig, calibration = cameras_of(trial)
    model = read_body(trial.path(trial.body.file))
    recording = open_recording(
        sources, rig, fields_as=METHODS[trial.track.method].fields_as, every=trial.track.every,
        start=trial.start.frame, stop=trial.track.stop,
    )  # fmt: skip
    facts = _inputs(trial, calibration)
    done = _open_folder(folder, facts, resume)
    start_s = time.monotonic()
    model = _run(trial, model, recording, folder, done, pictures, progress)
    motion = read_motion(folder / "motion.csv")
    summary = {
        "name": trial.name,
        **headline(motion),
        **facts,
        "events": recording.events,
        "wall_s": time.monotonic() - start_s,
    }
    _write_results(folder, motion, model, summary, pictures)
    return Run(motion, model, rig, summary)


def cameras_of(trial: Trial) -> tuple[Rig, Calibration | None]:
    """Return the cameras of the trial's videos, in its order; a calibration where it is made from control points."""
    sizes = {camera.name: inspect(_source(trial, camera)).size for camera in trial.camera}
    if trial.calibration.control_points is not None:
        points = read_control_points(trial.path(trial.calibration.control_points))
        calibration = calibrate(points, sizes, method=trial.calibration.method)
        return calibration.rig.select([camera.name for camera in trial.camera]), calibration
    rig = read_rig(trial.path(trial.calibration.file or ""))
    return Rig(tuple(_as_saved(rig, camera, sizes[camera.name]) for camera in trial.camera)), None


def _as_saved(rig: Rig, table: CameraTable, size: tuple[int, int]) -> Camera:
    """Turn a calibrated camera into the camera of the video's own pixels."""
    from dataclasses import replace

    camera = replace(rig[table.calibrated_as or table.name], name=table.name)
    if table.saved_scale == 1 and table.saved_offset_px == [0, 0]:
        return camera
    du, dv = table.saved_offset_px
    return camera.resampled(scale=(table.saved_scale, table.saved_scale), offset=(du, dv), size=size)


def _source(trial: Trial, camera: CameraTable) -> VideoSource:
    return VideoSource(camera.name, trial.path(camera.video), camera.fields, camera.offset_s)


def _run(
    trial: Trial, model: BodyModel, recording: Recording, folder: Path, done: list[Estimate], pictures: bool, progress: Progress | None
) -> BodyModel:
    """Track every frame, writing each as it is finished; frames in `done` are only learned from."""
    frames = iter(recording)
    first = next(frames, None)
    if first is None:
        raise TrialError(f"{trial.name}: no frame from number {trial.start.frame} on; the start frame lies past the end")
    model = sampled(model, trial.start.pose, first)
    tracker = tracker_of(trial.track, model, trial.start.pose)
    state = tracker.init()
    finished = iter(done)
    joints = tuple(segment.name for segment in model.segments[1:])
    with ExitStack() as stack:
        stack.callback(getattr(frames, "close", lambda: None))
        writer = stack.enter_context(MotionWriter(folder / "motion.csv", joints, resume=bool(done)))
        artists = [stack.enter_context(artist) for artist in _artists(folder, recording, pictures)]
        for number, seen in enumerate(chain([first], frames), start=1):
            estimate = next(finished, None)
            if estimate is None:
                estimate = tracker.search(state, seen)
                writer.append(estimate)
            state = tracker.learn(state, seen, estimate)
            posed = None if estimate.pose is None else model.with_pose(estimate.pose)
            for artist in artists:
                artist.write(seen, posed, estimate.status)
            if progress is not None:
                progress(number, recording.n_frames)
    return model
