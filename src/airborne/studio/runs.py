"""Runs as they are looked at: read once, and what a run that goes on has added since."""

from __future__ import annotations

from collections import OrderedDict
from functools import lru_cache
from pathlib import Path
from threading import Lock
from typing import Any

from airborne.body import BodyModel
from airborne.body.files import read_body
from airborne.cameras import Rig, read_rig
from airborne.errors import ResultError, count
from airborne.motion import PlayersMotion
from airborne.motion.rows import MotionRows, read_rows
from airborne.motion.run_folder import BODY, CALIBRATION, JOINTS, MOTION, RUN_RECORD, holds_players, read_players_run
from airborne.studio.folder import file_stamp
from airborne.trial.file import Trial

_MOST_KEPT = 8  # runs
_LONGEST_FRAME = 200_000  # chosen: bytes of a table that hold all joints of twenty players in a frame
_rows: OrderedDict[Path, tuple[Any, MotionRows]] = OrderedDict()  # run -> stamp of its file, and what was read then
_rows_lock = Lock()


def run_rows(run: Path) -> MotionRows:
    """Return the frames of a run of one body so far. Raises ResultError."""
    with _rows_lock:
        stamp, known = _rows.pop(run, (None, None))
        now = file_stamp(run / MOTION)
        if known is None or stamp != now:
            known = read_rows(run / MOTION, known)
        _rows[run] = now, known
        if len(_rows) > _MOST_KEPT:
            _rows.popitem(last=False)
        return known


def count_rows(run: Path) -> tuple[int, int | None]:
    """Return how many frames a run holds so far, and which is the newest; none before it has begun."""
    if holds_players(run):
        return _count_players(run / JOINTS)
    try:
        rows = run_rows(run)
    except ResultError:
        return 0, None
    return len(rows), rows.newest


def _count_players(path: Path) -> tuple[int, int | None]:
    """Return what `count_rows` does of a table of players' joints, which has as many lines for each frame."""
    try:
        text = path.read_bytes()
        _, *first = text[:_LONGEST_FRAME].split(b"\n")
        frames = [line.split(b",", 2)[1] for line in first if line.count(b",") > 1]
        _, _, last = text[: text.rindex(b"\n")].rpartition(b"\n")
        return (text.count(b"\n") - 1) // frames.count(frames[0]), int(last.split(b",", 2)[1])
    except (OSError, ValueError, IndexError):
        return 0, None


def run_body(run: Path) -> BodyModel:
    """Return the body of a run."""
    return _read_body(run / BODY, file_stamp(run / BODY))


def run_rig(run: Path) -> Rig:
    """Return the cameras of a run."""
    return _read_rig(run / CALIBRATION, file_stamp(run / CALIBRATION))


def run_players(run: Path) -> PlayersMotion:
    """Return the motion of a run of players. Raises ResultError."""
    return _read_players(run, file_stamp(run / JOINTS))


@lru_cache(maxsize=_MOST_KEPT)
def _read_body(path: Path, stamp: Any) -> BodyModel:
    return read_body(path)


@lru_cache(maxsize=_MOST_KEPT)
def _read_rig(path: Path, stamp: Any) -> Rig:
    return read_rig(path)


@lru_cache(maxsize=2)  # of 20 players, 100 MB each
def _read_players(run: Path, stamp: Any) -> PlayersMotion:
    return read_players_run(run)


def note_if_older(run: Path, path: Path) -> str:
    """Say of a file that is older than the run in whose folder it lies, from its beginning, that another left it."""
    made_ns, begun_ns = (file_stamp(each)[1] for each in (path, run / RUN_RECORD))
    return " (of the run before)" if 0 < made_ns < begun_ns else ""


def count_frames(trial: Trial, n_images: int) -> int:
    """Return how many frames a run of a trial has in all; its videos have this many."""
    return len(_frames_of(trial, n_images))


def last_frame(trial: Trial, n_images: int) -> int:
    """Return the last of them; the start where there is none."""
    return (_frames_of(trial, n_images) or [trial.start.frame])[-1]


def _frames_of(trial: Trial, n_images: int) -> range:
    stop = n_images if trial.track.stop is None else min(n_images, trial.track.stop)
    return range(trial.first_frame, stop, trial.track.every)


def describe_progress(n_done: int, n_frames: int) -> str:
    """Say how far a run is that goes on."""
    if n_done < n_frames:
        return f"{n_done} of {count(n_frames, 'frame')}" if n_done else "opening videos"
    return f"{count(n_frames, 'frame')} tracked, writing tables and report"
