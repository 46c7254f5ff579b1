"""A run, finished or not, as files for other programs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path

import numpy as np

from airborne.body import BodyModel
from airborne.errors import ResultError
from airborne.export.bvh import write_bvh
from airborne.export.c3d import write_c3d
from airborne.export.gltf import write_animation
from airborne.export.opensim_model import write_osim
from airborne.export.opensim_motion import write_mot
from airborne.export.tables import Columns, body_columns, players_columns, write_csv, write_wide_parquet
from airborne.export.takes import Take, body_take, player_takes, portable_names, with_axis_markers
from airborne.export.trc import write_trc
from airborne.io.parquet import CAN_WRITE_PARQUET
from airborne.io.writing import explain_full_disk
from airborne.motion import Motion, has_inertias, landmarks
from airborne.motion.flight.momentum_table import state_centres_of_mass
from airborne.motion.run_folder import EXPORTS, holds_players, note_if_unfinished, read_body_run, read_players_run
from airborne.tracking import Status
from airborne.types import Array, Progress, StageProgress

EXPORT_FORMATS = ("c3d", "trc", "mot", "osim", "gltf", "bvh", "csv", "parquet")
_TABLE_FORMATS = ("csv", "parquet")
_UNIFORM_FORMATS = ("c3d", "bvh")  # uniform sampling: hold a rate and no times
_LARGEST_JITTER = 0.05  # of a frame: how far such a file may shift one in time
_ROWS_AT_A_TIME = 10  # poses in memory at once
# how unknown points show in each format
_UNKNOWN_IN = {"trc": "gaps in .trc", "c3d": "the largest residual in .c3d"}
_UNMARKED_IN = {"mot": ".mot", "bvh": ".bvh", "gltf": ".glb"}
_NO_PARQUET = "Parquet needs pyarrow, which is not installed: pip install pyarrow"


@dataclass(frozen=True, slots=True, eq=False)
class ExportResult:
    """The files that were written, and notes for the user, one line each."""

    files: tuple[Path, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _RunData:
    """A run in the form that the writers need."""

    takes: Sequence[Take]
    columns: Columns
    notes: tuple[str, ...] = ()


def export_run(
    folder: Path, output: Path | None = None, formats: Sequence[str] = (), progress: StageProgress | None = None
) -> ExportResult:
    """Write a run's files in `formats`, by default all EXPORT_FORMATS, into `output` or the run's folder `export`.

    Files are named after the run's folder; those of the same names are replaced. Frames that are lost or were never
    tracked stay gaps. Raises ResultError where the folder holds no run, nothing was found in it, or a requested
    format cannot hold it.
    """
    if "parquet" in formats and not CAN_WRITE_PARQUET:
        raise ResultError(f"{_NO_PARQUET}, or write csv")
    wanted = [format for format in EXPORT_FORMATS if format in formats] or list(EXPORT_FORMATS)
    say = progress or (lambda what, done, total: None)
    read = _read(folder, any(format in _TABLE_FORMATS for format in wanted), partial(say, "measuring"))
    jitter, notes = max(take.jitter_s * float(take.rate) for take in read.takes), list(read.notes)
    if "parquet" in wanted and not CAN_WRITE_PARQUET:
        wanted.remove("parquet")
        notes.append(f"not written: {_NO_PARQUET}")
    if jitter > _LARGEST_JITTER:
        unfit = [format for format in wanted if format in _UNIFORM_FORMATS]
        reason = f"frames are off an even rate by up to {jitter:.2f} frames"
        if formats and unfit:
            raise ResultError(f"{reason}, and {' and '.join(unfit)} hold no times; write trc, mot, gltf or csv")
        notes += [f"{reason}: left out {', '.join(unfit)}, which hold no times"] if unfit else []
        wanted = [format for format in wanted if format not in unfit]
    target = folder / EXPORTS if output is None else output
    target.mkdir(parents=True, exist_ok=True)
    stem = portable_names([folder.resolve().name])[0]
    files: list[Path] = []
    for done, format in enumerate(wanted):
        say(f"writing {format}", done, len(wanted))
        files += _write(format, target, stem, read)
    unfinished = [note for note in [note_if_unfinished(folder)] if note is not None]
    gaps = _gap_notes(read.takes, wanted)
    return ExportResult(tuple(files), (*notes, *gaps, *unfinished))


def _gap_notes(takes: Sequence[Take], wanted: Sequence[str]) -> Iterator[str]:
    """Say for each body in how many frames it has no pose, and how many of its points are unknown."""
    in_parts = [f".{each}" for each in ("mot", "bvh") if each in wanted]
    shown = [how for each, how in _UNKNOWN_IN.items() if each in wanted]
    if unmarked := [extension for each, extension in _UNMARKED_IN.items() if each in wanted]:
        shown.append(f"unmarked in {', '.join(unmarked)}")
    for take in takes:
        n, n_parts = int(np.sum(~take.has_pose)), len(take.stretches())
        who = f"{take.name}: " if take.name else ""
        parts = ""
        if in_parts and n_parts > 1:
            verb = "are" if len(in_parts) > 1 else "is"
            parts = f"; {' and '.join(in_parts)} {verb} in {n_parts} parts, one a stretch without a gap"
        if n:
            yield f"{who}{n} of {len(take)} frames have no pose and stay gaps{parts}"
        n_unknown = int(np.sum(np.isinf(take.sd)))
        if n_unknown and shown:
            share = f"{n_unknown} of {take.sd.size} points are unknown, what stands for them is a guess"
            yield f"{who}{share}: {', '.join(shown)}"


def _read(folder: Path, has_tables: bool, progress: Progress) -> _RunData:
    return _read_players(folder) if holds_players(folder) else _read_body(folder, has_tables, progress)


def _read_body(folder: Path, has_tables: bool, progress: Progress) -> _RunData:
    motion, body = read_body_run(folder)
    model = with_axis_markers(body)
    if not motion.has_pose.any():
        raise ResultError(f"{folder}: the body was found in no frame, so there is nothing to export; track again")
    has_com = has_tables and has_inertias(model)
    total = len(motion) * (2 if has_com else 1)
    points, sd = _measure_landmarks(motion, model, lambda done: progress(done, total))
    com = state_centres_of_mass(motion, model) if has_com else None  # of the whole run: its fall tells where it is
    progress(total, total)
    columns = body_columns(motion, model, points, sd, com=com) if has_tables else {}
    return _RunData([body_take(motion, model, points, sd)], columns)


def _read_players(folder: Path) -> _RunData:
    motion = read_players_run(folder)
    takes = player_takes(motion)
    if not takes:
        raise ResultError(f"{folder}: no player was found in any frame, so there is nothing to export; track again")
    exported, names = {take.name for take in takes}, portable_names(motion.players)
    lost = [name for name, plain in zip(motion.players, names, strict=True) if plain not in exported]
    notes = [f"found in no frame and left out: {', '.join(lost)}"] if lost else []
    for k, name in enumerate(names):
        n = int(np.sum(motion.joint_status[:, k] == Status.UNCERTAIN.value))
        if n:
            share = f"{n} of {motion.joint_status[:, k].size} points are uncertain"
            marked = "status in .csv, sd as residual in .c3d, unmarked in .trc, .mot, .bvh and .glb"
            notes.append(f"{name}: {share}: {marked}")
    return _RunData(takes, players_columns(motion), tuple(notes))


def _measure_landmarks(motion: Motion, model: BodyModel, progress: Callable[[int], None]) -> tuple[Array, Array]:
    """Return `landmarks`, some rows at a time, reporting how many are done."""
    parts = []
    for first in range(0, len(motion), _ROWS_AT_A_TIME):
        rows = slice(first, first + _ROWS_AT_A_TIME)
        arrays = {each.name: getattr(motion, each.name) for each in fields(motion)}
        chunk = {name: array[rows] for name, array in arrays.items() if isinstance(array, np.ndarray)}
        parts.append(landmarks(replace(motion, **chunk), model))
        progress(min(rows.stop, len(motion)))
    values, sd = (np.concatenate(each) for each in zip(*parts, strict=True))
    return values, sd


def _write(format: str, folder: Path, stem: str, read: _RunData) -> list[Path]:
    """Write the files of one format: one for all bodies, or one each."""
    together: dict[str, Callable[[Path], None]] = {
        "c3d": lambda path: write_c3d(path, read.takes),
        "gltf": lambda path: write_animation(path, read.takes),
        "csv": lambda path: write_csv(path, read.columns),
        "parquet": lambda path: write_wide_parquet(path, read.columns),
    }
    if format in together:
        path = folder / f"{stem}.{'glb' if format == 'gltf' else format}"
        try:
            with explain_full_disk(path):
                together[format](path)
        except BaseException:
            path.unlink(missing_ok=True)
            raise
        return [path]
    written: list[Path] = []
    for take in read.takes:
        path = folder / f"{f'{stem}_{take.name}' if take.name else stem}.{format}"
        if format == "trc":
            write_trc(path, take)
            written.append(path)
        elif format == "osim":
            write_osim(path, take.model)
            written.append(path)
        else:
            written += write_mot(path, take) if format == "mot" else write_bvh(path, take)
    return written
