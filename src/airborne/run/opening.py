"""How every run begins: a trial's videos and cameras, its identity, and the rules of its folder."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from airborne import __version__
from airborne.calibration.from_points import Calibration, calibrate
from airborne.calibration.sources.control_points import read_control_points
from airborne.cameras import Camera, Rig, read_rig
from airborne.errors import ResultError, TrialError
from airborne.export import write_json
from airborne.motion.run_folder import RUN_RECORD, read_record
from airborne.run.first_pose import resect_moved_cameras
from airborne.tracking.methods import FIELD_MODES
from airborne.trial.file import CameraTable, Trial
from airborne.video import (
    LiveRecording,
    Recording,
    VideoFacts,
    VideoSource,
    connect,
    inspect,
    live_recording,
    open_recording,
)

_EXACT_CALIBRATION = (
    "the calibration comes from a file that does not say how good it is; the standard deviations take it as exact"
)
_HASHED_BYTES = 8 << 20  # larger files are identified by their first and last so many bytes and their length


def open_trial(trial: Trial) -> tuple[Recording, Calibration | None]:
    """Open a trial's videos with its cameras, fields as its method takes them; and the calibration, if one is made.

    Images of players are decoded lazily: only the regions that are used.
    """
    sources = [video_source(trial, camera) for camera in trial.camera]
    facts = [inspect(source) for source in sources]
    rig, calibration, notes = _cameras_of(trial, facts)
    recording = open_recording(
        sources,
        rig,
        facts=facts,
        fields_as="rows" if trial.has_players else FIELD_MODES[trial.settings.method],
        every=trial.track.every,
        start=trial.start.frame,
        stop=trial.track.stop,
        lazy=trial.has_players,
    )
    recording.events.extend(notes)
    return recording, calibration


@contextmanager
def open_live(
    trial: Trial, waiting: Callable[[], None] = lambda: None
) -> Iterator[tuple[LiveRecording, Calibration | None]]:
    """Connect to a trial's live cameras and find where they are; `waiting` is called until all deliver frames."""
    with connect([video_source(trial, camera) for camera in trial.camera], waiting) as cameras:
        sizes = {camera.source.name: camera.facts.size for camera in cameras if camera.facts is not None}
        rig, calibration = _calibrated_cameras(trial, sizes)
        yield (
            live_recording(cameras, rig, every=trial.track.every, start=trial.start.frame, stop=trial.track.stop),
            calibration,
        )


def cameras_of(trial: Trial) -> tuple[Rig, Calibration | None]:
    """Return the cameras of the trial's videos in its order, and the calibration if it was made from control points."""
    return _cameras_of(trial, [inspect(video_source(trial, camera)) for camera in trial.camera])[:2]


def _cameras_of(trial: Trial, facts: Sequence[VideoFacts]) -> tuple[Rig, Calibration | None, tuple[str, ...]]:
    """Return also the notes of the resection."""
    sizes = {camera.name: each.size for camera, each in zip(trial.camera, facts, strict=True)}
    rig, calibration = _calibrated_cameras(trial, sizes)
    rig, notes = resect_moved_cameras(trial, rig)
    return rig, calibration, notes


def _calibrated_cameras(trial: Trial, sizes: dict[str, tuple[int, int]]) -> tuple[Rig, Calibration | None]:
    """Return the calibrated cameras of images of these sizes (width, height) [px]."""
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
    return Rig(tuple(_camera_as_saved(rig, camera, sizes[camera.name]) for camera in trial.camera)), None


def _camera_as_saved(rig: Rig, table: CameraTable, size: tuple[int, int]) -> Camera:
    """Return a calibrated camera as the camera of its video's own pixels."""
    name = table.calibrated_as or table.name
    if name not in rig.names:
        raise TrialError(
            f"the calibration file has no camera '{name}'; it has: {', '.join(rig.names)}; say which of them the "
            "video is of: calibrated_as under [[camera]]"
        )
    camera = replace(rig[name], name=table.name)
    du, dv = table.saved_offset_px
    if table.saved_scale == 1 and (du, dv) == (0, 0):
        return camera
    return camera.resample(scale=(table.saved_scale, table.saved_scale), offset=(du, dv), size=size)


def video_source(trial: Trial, camera: CameraTable) -> VideoSource:
    """Return a camera's video."""
    return VideoSource(camera.name, trial.path(camera.video), camera.fields, camera.offset_s, camera.drift_ppm)


def prepare_folder(folder: Path, identity: dict[str, Any], table: str, *, resume: bool) -> bool:
    """Prepare a run's folder; return whether it holds rows of its `table` from which to resume.

    Raises ResultError for a folder that holds something else, a run without `resume`, or a run of other inputs.
    """
    rows, record = folder / table, folder / RUN_RECORD
    folder.mkdir(parents=True, exist_ok=True)
    if not record.exists() and not rows.exists() and any(folder.iterdir()):
        raise ResultError(f"{folder} is not empty and holds no run; give a new or empty folder")
    if rows.exists() and not resume:
        raise ResultError(f"{folder} already holds a run; give --resume to go on with it, or another folder")
    if not rows.exists():
        write_json(record, identity)
        return False
    recorded = read_record(record)
    changed = [name for name in identity if recorded.get(name) != identity[name]]
    if changed:
        raise ResultError(f"{folder} holds another run (other {', other '.join(changed)}); track into another folder")
    return True


def holds_run_of(trial: Trial, folder: Path) -> bool:
    """Say whether a folder holds a run of exactly this trial, finished or not."""
    record = folder / RUN_RECORD
    return record.is_file() and read_record(record) == run_identity(trial)


def run_identity(trial: Trial, *, live: bool = False) -> dict[str, Any]:
    """Return what two runs share if one can resume the other."""
    settings = {
        "inputs": input_hashes(trial, live=live),
        "settings": trial.track.method_settings,
        "version": __version__,
    }
    return json.loads(json.dumps(settings))


def past_the_end_error(trial: Trial) -> TrialError:
    """Return the error of a recording that ends before its first frame to track."""
    return TrialError(f"{trial.name}: there is no frame {trial.start.frame}; start.frame lies past the end")


def provenance(
    trial: Trial, calibration: Calibration | None, recording: Recording | LiveRecording, inputs: dict[str, str]
) -> dict[str, Any]:
    """Return the end of every summary: warnings, events, method, cameras, versions, inputs."""
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
        "warnings": [_EXACT_CALIBRATION] if calibration is None else list(calibration.warnings),
        "events": recording.events,
        "method": trial.track.method_settings,
        "cameras": cameras,
        "versions": versions(),
        "inputs": inputs,
    }


def list_tables(folder: Path) -> list[str]:
    """Return the names of the tables in a run's folder."""
    return sorted(path.name for path in folder.iterdir() if path.suffix in (".csv", ".parquet"))


def versions() -> dict[str, str]:
    """Return the versions of everything that a result may depend on."""
    packages = ("numpy", "scipy", "numba", "av", "opencv-python-headless")
    return {"airborne": __version__, "python": platform.python_version(), **{name: version(name) for name in packages}}


def input_hashes(trial: Trial, *, live: bool = False) -> dict[str, str]:
    """Return the SHA-256 of each input file, by the name that the trial gives it; live video has none."""
    optional = (
        trial.body.source_file,
        trial.calibration.file,
        trial.calibration.control_points,
        trial.track.torso,
        *trial.start.source_files,
    )
    names = [*(camera.video for camera in trial.camera if not live), *(name for name in optional if name)]
    rest = [trial.start, trial.lights, trial.calibration, trial.body, *trial.camera]
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
