"""One recording from files to results: video + calibration -> frames -> poses -> motion -> report."""

from __future__ import annotations

import hashlib
import json
import platform
import shutil
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from importlib.metadata import version
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from airborne import __version__
from airborne.body import BodyModel, Pose, PosedBody, geometry
from airborne.body.files import body_toml, mesh_files
from airborne.cameras import Calibration, Camera, Rig, calibrate, read_control_points, read_rig, write_pose2sim
from airborne.errors import ResultError, TrialError
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
from airborne.start import first_pose, mended_rig
from airborne.tracking import Estimate
from airborne.tracking.methods import FIELDS_AS, sampled, tracker_of
from airborne.trial import CameraTable, Trial
from airborne.video import Recording, VideoSource, View, inspect, open_recording

Progress = Callable[[int, int | None], None]  # frames done, frames expected

UNCERTAINTY = (
    "Standard deviations hold what the pictures leave open: noise, light, and edges that are not where the drawn body "
    "has them. They do not hold a body measured wrongly all over, or wrong times of the cameras."
)
OF_POINTS = " They hold how far the control points leave each camera's picture open."
OF_FILE = "the calibration comes from a file that does not say how good it is; the standard deviations take it as exact"
_HASHED_BYTES = 8 << 20  # larger files are told apart by their first and last so many bytes and their length


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
    identity = _identity(trial)
    done = _begin(folder, identity, resume)
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


def open_trial(trial: Trial) -> tuple[Recording, Calibration | None]:
    """Open a trial's videos with its cameras, fields as its method sees them; and the calibration, if one is made."""
    rig, calibration, notes = _cameras_of(trial)
    recording = open_recording(
        [_source(trial, camera) for camera in trial.camera],
        rig,
        fields_as=FIELDS_AS[trial.track.method],
        every=trial.track.every,
        start=trial.start.frame,
        stop=trial.track.stop,
    )
    recording.events.extend(notes)
    return recording, calibration


def cameras_of(trial: Trial) -> tuple[Rig, Calibration | None]:
    """Return the cameras of the trial's videos in its order, and the calibration if control points gave them."""
    return _cameras_of(trial)[:2]


def _cameras_of(trial: Trial) -> tuple[Rig, Calibration | None, tuple[str, ...]]:
    """Return also what mending said of them."""
    rig, calibration = _calibrated(trial)
    rig, notes = mended_rig(trial, rig)
    return rig, calibration, notes


def _calibrated(trial: Trial) -> tuple[Rig, Calibration | None]:
    sizes = {camera.name: inspect(_source(trial, camera)).size for camera in trial.camera}
    if trial.calibration.control_points is not None:
        points = read_control_points(trial.path(trial.calibration.control_points))
        missing = [name for name in sizes if name not in points.cameras]
        if missing:
            raise TrialError(
                f"{trial.calibration.control_points} has no points clicked in {', '.join(missing)}; "
                f"it has: {', '.join(points.cameras)}"
            )
        calibration = calibrate(points.select(list(sizes)), sizes, method=trial.calibration.method)
        return calibration.rig, calibration
    rig = read_rig(trial.path(trial.calibration.file or ""))
    return Rig(tuple(_as_saved(rig, camera, sizes[camera.name]) for camera in trial.camera)), None


def _as_saved(rig: Rig, table: CameraTable, size: tuple[int, int]) -> Camera:
    """Return a calibrated camera as the camera of its video's own pixels."""
    camera = replace(rig[table.calibrated_as or table.name], name=table.name)
    du, dv = table.saved_offset_px
    if table.saved_scale == 1 and (du, dv) == (0, 0):
        return camera
    return camera.resampled(scale=(table.saved_scale, table.saved_scale), offset=(du, dv), size=size)


def _source(trial: Trial, camera: CameraTable) -> VideoSource:
    return VideoSource(camera.name, trial.path(camera.video), camera.fields, camera.offset_s)


def _begin(folder: Path, identity: dict[str, Any], resume: bool) -> list[Estimate]:
    """Make the folder ready and return the frames that are finished already."""
    motion, record = folder / "motion.csv", folder / "run.json"
    folder.mkdir(parents=True, exist_ok=True)
    if not record.exists() and not motion.exists() and any(folder.iterdir()):
        raise ResultError(f"{folder} is not empty and holds no run; give a new or empty folder")
    if motion.exists() and not resume:
        raise ResultError(f"{folder} already holds a run; give --resume to go on with it, or another folder")
    if not motion.exists():
        write_json(record, identity)
        return []
    known = _read_record(record)
    changed = [name for name in identity if known.get(name) != identity[name]]
    if changed:
        raise ResultError(f"{folder} holds another run (other {', other '.join(changed)}); track into another folder")
    return read_estimates(motion)


def holds_run_of(trial: Trial, folder: Path) -> bool:
    """Say whether a folder holds a run of exactly this trial, finished or not."""
    record = folder / "run.json"
    return record.is_file() and _read_record(record) == _identity(trial)


def _identity(trial: Trial) -> dict[str, Any]:
    settings = {"inputs": inputs_of(trial), "settings": trial.track.model_dump(), "version": __version__}
    return json.loads(json.dumps(settings))


def _read_record(path: Path) -> dict[str, Any]:
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        return record if isinstance(record, dict) else {}
    except (OSError, ValueError) as error:
        raise ResultError(
            f"{path} is missing or damaged, so it cannot be told whose run this is; use another folder"
        ) from error


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
            raise TrialError(f"{trial.name}: there is no frame {trial.start.frame}; start.frame lies past the end")
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
    fits = {} if calibration is None else {fit.name: fit for fit in calibration.fits}
    cameras = [
        {
            "name": camera.name,
            "position_m": [round(float(x), 4) for x in camera.centre],
            "focal_px": round(float(camera.K[0, 0]), 2),
            "calibration_rms_px": fits[camera.name].rms_px if camera.name in fits else None,
            "held_out_rms_mm": fits[camera.name].held_out_m * 1e3 if camera.name in fits else None,
        }
        for camera in recording.rig
    ]
    return {
        "name": trial.name,
        **headline(motion),
        **({"flight": flight_summary(motion, model).to_dict()} if motion.joints and has_inertias(model) else {}),
        "uncertainty": UNCERTAINTY if calibration is None else UNCERTAINTY + OF_POINTS,
        "warnings": [OF_FILE] if calibration is None else list(calibration.warnings),
        "events": recording.events,
        "method": trial.track.model_dump(),
        "cameras": cameras,
        "versions": versions(),
        "inputs": inputs,
    }


def versions() -> dict[str, str]:
    """Return the versions of everything that a result may depend on."""
    packages = ("numpy", "scipy", "numba", "av", "opencv-python-headless")
    return {"airborne": __version__, "python": platform.python_version(), **{name: version(name) for name in packages}}


def inputs_of(trial: Trial) -> dict[str, str]:
    """Return the SHA-256 of each input file, by the name that the trial gives it."""
    given = (trial.body.given_file, trial.calibration.file, trial.calibration.control_points, *trial.start.given_files)
    names = [*(camera.video for camera in trial.camera), *(name for name in given if name)]
    rest = [trial.start, trial.lights, trial.calibration, trial.body]
    start = json.dumps([table and table.model_dump() for table in rest])
    hashes = {name: _sha256(trial.path(name)) for name in names}
    return {**hashes, "start and lights": hashlib.sha256(start.encode()).hexdigest()}


def _sha256(path: Path) -> str:
    digest = hashlib.sha256()
    if path.is_dir():
        for file in sorted(path.rglob("*.json")):
            digest.update(f"{file.relative_to(path).as_posix()} {_sha256(file)}\n".encode())
        return digest.hexdigest()
    size = path.stat().st_size
    with path.open("rb") as file:
        if size <= 2 * _HASHED_BYTES:
            digest.update(file.read())
        else:
            digest.update(file.read(_HASHED_BYTES))
            file.seek(-_HASHED_BYTES, 2)
            digest.update(file.read())
            digest.update(str(size).encode())
    return digest.hexdigest()
