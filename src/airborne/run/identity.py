"""What makes two runs the same: their inputs, settings and corrections, as a run's record has them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from airborne import __version__
from airborne.body.files import find_mesh_files
from airborne.cameras.files import files_beside
from airborne.io.files import file_digest
from airborne.motion.run_folder import RUN_RECORD, read_record
from airborne.trial.file import Trial

START = "start"  # stands for the digest of the first key, which other digests hold


def run_identity(trial: Trial, *, live: bool = False, take: int | None = None) -> dict[str, Any]:
    """Return what two runs share if one can resume the other; `take` is which of the poses found was chosen."""
    settings = {
        "inputs": input_hashes(trial, live=live),
        **corrections_by_frame(trial),
        "settings": trial.track.model_dump(),
        "version": __version__,
        **({} if take is None else {"take": take}),
    }
    return json.loads(json.dumps(settings))


def is_first_frame_alone(record: Mapping[str, Any]) -> bool:
    """Whether a run looked at its first frame alone, as `--first-frame` does."""
    settings, keys = record.get("settings"), record.get("keys")
    stop = settings.get("stop") if isinstance(settings, dict) else None
    return isinstance(stop, int) and isinstance(keys, dict) and keys.get(str(stop - 1)) == START


def corrections_by_frame(trial: Trial) -> dict[str, Any]:
    """Return digests of a trial's keys, by their frames, and its masks."""
    return {"keys": _key_digests(trial), "masks": [mask.model_dump() for mask in trial.mask]}


def _key_digests(trial: Trial) -> dict[str, str]:
    """Return a digest of each key and its files, by its frame; the start, which other digests hold, is the first."""
    digests = {str(trial.start.frame): START}
    for key in trial.key:
        files = {name: file_digest(trial.path(name)) for name in key.source_files}
        said = json.dumps([key.model_dump(), files])
        digests[str(key.frame)] = hashlib.sha256(said.encode()).hexdigest()
    return digests


def input_hashes(trial: Trial, *, live: bool = False) -> dict[str, str]:
    """Return the SHA-256 of each input file, by the name that the trial gives it, and of tables that it holds itself.

    Live video has none.
    """
    names = [*(camera.video for camera in trial.camera if not live), *trial.input_files, *_further_files(trial)]
    return {name: file_digest(trial.path(name)) for name in names} | _table_digests(trial)


def find_changed_tables(trial: Trial, folder: Path) -> list[str]:
    """Return which of a trial's [start], [lights], [calibration], [body], [[camera]] changed since its run in a folder.

    Not of what lies in files; nor of a start that is found, as the run holds it as it was found.
    """
    record = folder / RUN_RECORD
    inputs = read_record(record).get("inputs") if record.is_file() else None
    recorded = inputs if isinstance(inputs, dict) else {}
    digests = _table_digests(trial).items()
    changed = [name for name, digest in digests if recorded.get(name, digest) != digest]
    return [name for name in changed if not (trial.start.find and name == "[start]")]


def _table_digests(trial: Trial) -> dict[str, str]:
    tables = {
        "[start]": trial.start.model_dump(),
        "[lights]": trial.lights and trial.lights.model_dump(),
        "[calibration]": trial.calibration.model_dump(),
        "[body]": trial.body.model_dump(),
        "[[camera]]": [camera.model_dump() for camera in trial.camera],
    }
    return {name: hashlib.sha256(json.dumps(table).encode()).hexdigest() for name, table in tables.items()}


def _further_files(trial: Trial) -> list[str]:
    """Return what the named files name in turn: a body's meshes, the other half of a calibration in two files."""
    body, calibration = trial.body.file, trial.calibration.file
    meshes = [] if body is None else [str(Path(body).parent / name) for name in find_mesh_files(trial.path(body))]
    halves = [] if calibration is None else [path.name for path in files_beside(trial.path(calibration))]
    return meshes + [str(Path(calibration or "").parent / name) for name in halves]
