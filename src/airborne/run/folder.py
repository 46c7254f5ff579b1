"""The rules of a run's folder: whose run it holds, and who may write into it."""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from airborne.errors import ResultError, RunThereError
from airborne.export import write_json
from airborne.io.folder_lock import LOCK, refuse_links, sole_writer
from airborne.motion import drop_rows
from airborne.motion.covariance_file import COVARIANCE_FILE, LASTING_FILE
from airborne.motion.files import copy_motion, remove_motion
from airborne.motion.frame_file import FRAME_SD_FILE
from airborne.motion.run_folder import (
    AGREEMENT,
    AGREEMENT_METHODS,
    BODY,
    CALIBRATION,
    CANDIDATES,
    CANDIDATES_PICTURE,
    FIGURES,
    JOINTS,
    JUMPS,
    MOTION,
    REPEATABILITY,
    REPORT,
    RUN_RECORD,
    SMOOTH_RECORD,
    SUMMARY,
    TABLES,
    TRACKED_MOTION,
    VIDEOS,
    read_record,
)
from airborne.run.identity import START, corrections_by_frame, is_first_frame_alone, run_identity
from airborne.trial.file import Trial

_BEFORE_A_RUN = {CANDIDATES, CANDIDATES_PICTURE}  # what a start that is undecided leaves


@contextmanager
def open_results(folder: Path) -> Iterator[None]:
    """Be the sole writer into a folder whose results are added to."""
    with sole_writer(folder):
        refuse_links(folder)
        yield


def refuse_full_folder(folder: Path, table: str, *, resume: bool, overwrite: bool) -> None:
    """Raise ResultError for a folder that holds something else, or a run that is neither resumed nor replaced."""
    rows, record = folder / table, folder / RUN_RECORD
    foreign = {path.name for path in folder.iterdir()} - {LOCK, f"{RUN_RECORD}.part", *_BEFORE_A_RUN}
    if not record.exists() and not rows.exists() and foreign:
        raise ResultError(f"{folder} is not empty and holds no run; give a new or empty folder")
    refuse_links(folder)
    if resume or not (record.exists() or rows.exists()):
        return
    recorded = read_record(record) if record.exists() else None  # what is damaged is not removed
    is_replaced = recorded is not None and (overwrite or is_first_frame_alone(recorded))
    if rows.exists() and not is_replaced:
        raise RunThereError(
            f"{folder} already holds a run; resume it (--resume), overwrite it (--overwrite), or give another folder"
        )


def prepare_folder(
    folder: Path, identity: dict[str, Any], table: str, *, resume: bool = False, overwrite: bool = False
) -> bool:
    """Prepare a run's folder; return whether it holds rows of its `table` from which to resume.

    Whoever calls it is the folder's `sole_writer`. `overwrite` removes the run that the folder holds, finished or not;
    one of the first frame alone goes without being asked.
    A run of one body that differs in keys and masks alone loses the rows that these touch, which are then tracked
    again. What was made of another motion than the last goes: report, pictures, smoothed tables, comparisons. Raises
    ResultError for a folder that holds something else, a run with neither `resume` nor `overwrite`, or a run of other
    inputs.
    """
    rows, record = folder / table, folder / RUN_RECORD
    refuse_full_folder(folder, table, resume=resume, overwrite=overwrite)
    if record.exists() and not resume and (overwrite or is_first_frame_alone(read_record(record))):
        _remove_run(folder)
    if not rows.exists():
        write_json(record, identity)
        return False
    recorded = _read_identity(folder, identity)
    changed = [name for name in identity if recorded.get(name) != identity[name]]
    is_corrected = table == MOTION and bool(changed) and set(changed) <= {"keys", "masks"}
    if changed and not is_corrected:
        differences = "; ".join(_describe_change(name, recorded, identity) for name in changed)
        raise ResultError(
            f"{folder} holds another run ({differences}); "
            "go on with its options and files, or track into another folder"
        )
    if is_corrected or not (folder / SUMMARY).is_file():
        _remove_made(folder)
    tracked = folder / TRACKED_MOTION
    if is_corrected or tracked.is_file():
        (folder / SUMMARY).unlink(missing_ok=True)  # it is not finished until it is tracked, and fitted, again
    if tracked.is_file():  # a run goes on from what was tracked
        copy_motion(tracked, rows)
        remove_motion(tracked)
    if is_corrected:
        again = stretches_between(recorded, identity)
        drop_rows(rows, lambda frame: any(before < frame < after for before, after in again))
        write_json(record, identity)
    return True


def is_finished(folder: Path, identity: dict[str, Any]) -> bool:
    """Say whether a folder holds a run of this identity that has its summary."""
    is_whole = (folder / RUN_RECORD).is_file() and (folder / SUMMARY).is_file()
    return is_whole and _read_identity(folder, identity) == identity


def _read_identity(folder: Path, identity: dict[str, Any]) -> dict[str, Any]:
    """Return the identity of the run in a folder, written as this one is."""
    return _with_settings(_with_keys(read_record(folder / RUN_RECORD), identity), identity)


def _describe_change(name: str, recorded: Mapping[str, Any], identity: Mapping[str, Any]) -> str:
    """Name what differs between two identities: the settings with their values there and now, the input files."""
    before, now = recorded.get(name), identity[name]
    if not (isinstance(before, dict) and isinstance(now, dict)):
        return f"{name} {before}, now {now}" if isinstance(now, str | int) else f"other {name}"
    differing = [key for key in {**before, **now} if before.get(key) != now.get(key)]
    if name == "settings":
        return "; ".join(f"{key} = {before.get(key)}, now {now.get(key)}" for key in differing)
    if name != "inputs":
        return f"other {name}"
    gone, added = ([key for key in each if key not in other] for each, other in ((before, now), (now, before)))
    changed = [key for key in differing if key in before and key in now]
    parts = (("other ", changed), ("without ", added), ("with ", gone))
    return "; ".join(f"{word}{', '.join(keys)}" for word, keys in parts if keys)


def stretches_between(recorded: dict[str, Any], identity: dict[str, Any]) -> list[tuple[float, float]]:
    """Return what is tracked again between two identities that differ in keys and masks alone; see `stretches_of`."""
    recorded = _with_keys(recorded, identity)
    masks = [(mask["first"], mask["last"]) for mask in _mask_changes(recorded, identity)]
    return stretches_of(recorded["keys"], identity["keys"], masks)


def _with_keys(recorded: dict[str, Any], identity: dict[str, Any]) -> dict[str, Any]:
    """Return a record with keys and masks; older ones have neither, and only the start of what they are beside."""
    first = {frame: digest for frame, digest in identity["keys"].items() if digest == START}
    return {"keys": first, "masks": [], **recorded}


def _with_settings(recorded: dict[str, Any], identity: dict[str, Any]) -> dict[str, Any]:
    """Return a record with the settings that did not exist when it was written, as if none had been given."""
    settings = recorded.get("settings")
    known = settings if isinstance(settings, dict) else {}
    return {**recorded, "settings": {**dict.fromkeys(identity["settings"]), **known}}


def _mask_changes(*identities: Mapping[str, Any]) -> list[dict[str, Any]]:
    every = [mask for identity in identities for mask in identity["masks"]]
    return [mask for mask in every if not all(mask in identity["masks"] for identity in identities)]


def stretches_of(
    old: Mapping[str, str], new: Mapping[str, str], masked: Sequence[tuple[int, int]] = ()
) -> list[tuple[float, float]]:
    """Return what changed keys, and changed masks, touch: between which frames, both outside, is tracked again.

    Keys are digests by their frames, the start's among them: those that stay the same bound the stretches. Masks are
    the first and last frame of each that changed.
    """
    same = [int(frame) for frame in new if old.get(frame) == new[frame]]
    moved = [(int(frame), int(frame)) for frame in {*old, *new} if old.get(frame) != new.get(frame)]
    return [
        (
            max((each for each in same if each < first), default=-math.inf),
            min((each for each in same if each > last), default=math.inf),
        )
        for first, last in (*moved, *masked)
    ]


def _remove_made(folder: Path) -> None:
    """Remove what is made of a motion: report, pictures, smoothed tables and comparisons."""
    made = (REPORT, SMOOTH_RECORD, AGREEMENT, REPEATABILITY, AGREEMENT_METHODS)
    for path in (*(folder / name for name in made), *(folder / TABLES).glob("smooth_*")):
        path.unlink(missing_ok=True)
    for name in (FIGURES, VIDEOS):
        shutil.rmtree(folder / name, ignore_errors=True)


def _remove_run(folder: Path) -> None:
    """Remove what commands leave in a run's folder; exports and what others put there stay."""
    _remove_made(folder)
    shutil.rmtree(folder / TABLES, ignore_errors=True)
    made = (MOTION, JOINTS, JUMPS, SUMMARY, CALIBRATION, BODY, COVARIANCE_FILE, LASTING_FILE, FRAME_SD_FILE)
    for name in (*made, *_BEFORE_A_RUN, RUN_RECORD):
        (folder / name).unlink(missing_ok=True)


def holds_run_of(trial: Trial, folder: Path) -> bool:
    """Say whether a folder holds a run of exactly this trial, finished or not."""
    record = folder / RUN_RECORD
    return record.is_file() and read_record(record) == run_identity(trial)


def read_choice(folder: Path) -> int | None:
    """Return which of the poses that were found the run in a folder was told to take; None where it was told none."""
    record = folder / RUN_RECORD
    return read_record(record).get("take") if record.is_file() else None


class PendingCorrections(NamedTuple):
    """The corrections of a trial that are others than those its run was tracked with."""

    keys: list[int]  # frames of keys that are new, changed or gone
    masks: list[dict[str, Any]]  # that are new or gone
    stretches: list[tuple[float, float]]  # that are tracked again; see `stretches_of`


def pending_corrections(trial: Trial, folder: Path) -> PendingCorrections:
    """Return the corrections that a trial got since its run in a folder was tracked; none without a record."""
    if not (folder / RUN_RECORD).is_file():
        return PendingCorrections([], [], [])
    now = json.loads(json.dumps(corrections_by_frame(trial)))
    recorded = _with_keys(read_record(folder / RUN_RECORD), now)
    if trial.start.find:  # as it was found then
        found = {frame: digest for frame, digest in recorded["keys"].items() if digest == START}
        now["keys"] = found | {frame: digest for frame, digest in now["keys"].items() if digest != START}
    old, new = recorded["keys"], now["keys"]
    keys = sorted(int(frame) for frame in {*old, *new} if old.get(frame) != new.get(frame))
    return PendingCorrections(keys, _mask_changes(recorded, now), stretches_between(recorded, now))


def list_tables(folder: Path) -> list[str]:
    """Return the paths of the tables in a run's folder, relative to it."""
    return sorted(
        path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.suffix in (".csv", ".parquet")
    )
