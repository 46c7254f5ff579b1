"""What became of corrections: the frames of a run that were tracked again, and how near the body came to each key."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from airborne.cameras.finding import join_names
from airborne.errors import count
from airborne.export.methods_text import name_stretch
from airborne.motion.run_folder import MOTION, RUN_RECORD, read_record
from airborne.run.folder import pending_corrections, stretches_between
from airborne.run.key_misses import miss_by_hand
from airborne.studio.folder import file_stamp
from airborne.studio.runs import run_body, run_rig, run_rows
from airborne.tracking import Status
from airborne.trial.file import Trial
from airborne.trial.keys import KeyTable
from airborne.trial.masks import MaskTable

_MOST_KEYS = 2  # that are told, the worst first
_LOST = "the pictures show no body near its key; undo it, or drag the body onto what they show, and track again"


@dataclass(frozen=True, slots=True, eq=False)
class RunBefore:
    """A run of one body before it is tracked again."""

    record: dict[str, Any]
    index: NDArray[np.int64]  # (n,) its frames
    stamp: Any  # of its file

    @classmethod
    def of(cls, run: Path) -> RunBefore:
        """Take a run as it is now. Raises ResultError."""
        return cls(read_record(run / RUN_RECORD), run_rows(run).index, file_stamp(run / MOTION))

    def is_changed(self, run: Path) -> bool:
        """Say whether the run is another since."""
        return file_stamp(run / MOTION) != self.stamp


def describe_tracked_again(before: RunBefore, run: Path, trial: Trial) -> str:
    """Say which frames were tracked again, which of them are lost, and how near the body is to the keys that changed.

    Raises AirborneError.
    """
    record, rows, step = read_record(run / RUN_RECORD), run_rows(run), trial.track.every
    is_new = ~np.isin(rows.index, before.index)
    is_new |= _lies_in(rows.index, stretches_between(before.record, record))
    if not is_new.any():
        return f"no frame was tracked again: the corrections touch none of {name_frames(rows.index, step)}"
    old, new = before.record.get("keys", {}), record["keys"]
    changed = [key for key in trial.key if old.get(str(key.frame)) != new.get(str(key.frame))]
    told = _describe_keys(run, trial, [key for key in changed if rows.row(key.frame) is not None])
    at_keys = [key.frame for key in changed]
    lost = rows.index[is_new & (rows.status == Status.LOST.value) & ~np.isin(rows.index, at_keys)]
    if len(lost):
        told.append(f"{name_frames(lost, step)} {'is' if len(lost) == 1 else 'are'} lost")
    return "; ".join([f"{name_frames(rows.index[is_new], step)} tracked again", *told])


def describe_pending(trial: Trial, run: Path) -> str:
    """Name the corrections that a run was tracked without, and the frames that they touch; empty where there are none.

    Raises AirborneError.
    """
    pending, index = pending_corrections(trial, run), run_rows(run).index
    held = {key.frame for key in trial.key}
    what = [f"frame {frame}{'' if frame in held else ', no longer corrected'}" for frame in pending.keys]
    for mask in pending.masks:
        verb = "left out of" if MaskTable(**mask) in trial.mask else "used again in"
        what.append(f"{mask['camera']} {verb} {name_stretch(mask['first'], mask['last'])}")
    if not what:
        return ""
    touched = index[_lies_in(index, pending.stretches)]
    frames = name_frames(touched, trial.track.every) if len(touched) else "no frame of this run"
    return f"Not tracked yet: {'; '.join(what)}. Tracking again goes over {frames}."


def _lies_in(index: NDArray[np.int64], stretches: Sequence[tuple[float, float]]) -> NDArray[np.bool_]:
    """Say which frames (n,) lie between the ends, both outside, of any stretch."""
    found = np.zeros(len(index), bool)
    for first, last in stretches:
        found |= (first < index) & (index < last)
    return found


def _describe_keys(run: Path, trial: Trial, keys: Sequence[KeyTable]) -> list[str]:
    """Say of each key how near the body is to it: the worst first, and how many more there are."""
    rows, model, rig, told = run_rows(run), run_body(run), run_rig(run), []
    for key in keys:
        pose, status = rows.pose(key.frame), rows.status[rows.row(key.frame)]
        if pose is None:
            told.append((np.inf, f"frame {key.frame} is now lost: {_LOST}"))
            continue
        doubt = "" if status == Status.TRACKED.value else f", which is {status},"
        far = miss_by_hand(trial, key, model, pose, rig=rig)
        words = f"at frame {key.frame}{doubt}" + ("" if far is None else f" {far.words}{far.advice}")
        told.append((0.0 if far is None else far.sds, words))
    told = [words for _, words in sorted(told, key=lambda each: -each[0])]
    more = len(told) - _MOST_KEYS
    return told if more <= 0 else [*told[:_MOST_KEYS], f"nearer at {count(more, 'more key')}"]


def name_frames(frames: NDArray[np.int64], step: int = 1) -> str:
    """Name frames (n,), ascending, by the stretches in which they lie, as frames 3 and 5 to 7; `step` joins them."""
    rows = np.split(frames, np.flatnonzero(np.diff(frames) > step) + 1)
    names = [name_stretch(row[0], row[-1]) for row in rows]
    return f"{'frame' if len(frames) == 1 else 'frames'} {join_names(names)}"
