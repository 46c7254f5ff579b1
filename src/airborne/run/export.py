"""A run, finished or not, as files that other programs open."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel
from airborne.errors import ResultError
from airborne.export.bvh import write_bvh
from airborne.export.c3d import write_c3d
from airborne.export.gltf import write_animation
from airborne.export.opensim_model import write_osim
from airborne.export.opensim_motion import write_mot
from airborne.export.tables import Columns, body_columns, players_columns, write_csv, write_parquet
from airborne.export.takes import Take, body_take, plain_names, player_takes, with_axis_markers
from airborne.export.trc import write_trc
from airborne.motion import Motion, flight, has_inertias, landmarks
from airborne.motion.run_folder import body_run, holds_players, players_run

Array = NDArray[np.floating]
Progress = Callable[[int, int | None], None]

KINDS = ("c3d", "trc", "mot", "osim", "gltf", "bvh", "csv", "parquet")
TABLES = ("csv", "parquet")
ONE_BEAT = ("c3d", "bvh")  # hold a rate and no times
LARGEST_STRAY = 0.05  # of a frame, that such a file may misplace one
_ROWS_AT_A_TIME = 10


@dataclass(frozen=True, slots=True, eq=False)
class Exported:
    """What an export wrote, and what the user should know, one line each."""

    files: tuple[Path, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _Read:
    """A run as the writers need it."""

    takes: Sequence[Take]
    columns: Columns
    notes: tuple[str, ...] = ()


def export_run(
    folder: Path, output: Path | None = None, kinds: Sequence[str] = (), progress: Progress | None = None
) -> Exported:
    """Write a run's files of the kinds of KINDS, all where none is given, into `output` or the run's folder `export`.

    Files are named after the run's folder; those of the same names are replaced. Frames that are lost or were never
    tracked stay gaps. Raises ResultError where the folder holds no run, nothing was found in it, or a kind that was
    asked for cannot hold it.
    """
    wanted = [kind for kind in KINDS if kind in kinds] or list(KINDS)
    read = _read(folder, any(kind in TABLES for kind in wanted), progress or (lambda done, total: None))
    stray, notes = max(take.stray_s * float(take.rate) for take in read.takes), list(read.notes)
    if stray > LARGEST_STRAY:
        uneven = [kind for kind in wanted if kind in ONE_BEAT]
        reason = f"frames stray from an even beat by up to {stray:.2f} frames"
        if kinds and uneven:
            raise ResultError(f"{reason}, and {' and '.join(uneven)} hold no times; give --trc, --mot, --gltf or --csv")
        notes += [f"{reason}: left out {', '.join(uneven)}, which hold no times"] if uneven else []
        wanted = [kind for kind in wanted if kind not in uneven]
    target = folder / "export" if output is None else output
    target.mkdir(parents=True, exist_ok=True)
    stem = plain_names([folder.resolve().name])[0]
    files = [path for kind in wanted for path in _write(kind, target, stem, read)]
    return Exported(tuple(files), (*notes, *_gaps(read.takes, bool({"mot", "bvh"} & set(wanted)))))


def _gaps(takes: Sequence[Take], has_parts: bool) -> Iterator[str]:
    """Say of each body in how many frames it has no pose."""
    for take in takes:
        n, n_parts = int(np.sum(~take.has_pose)), len(take.stretches())
        who = f"{take.name}: " if take.name else ""
        parts = f"; .mot and .bvh are in {n_parts} parts, one a stretch without a gap" * (has_parts and n_parts > 1)
        if n:
            yield f"{who}{n} of {len(take)} frames have no pose and stay gaps{parts}"


def _read(folder: Path, has_tables: bool, progress: Progress) -> _Read:
    return _read_players(folder) if holds_players(folder) else _read_body(folder, has_tables, progress)


def _read_body(folder: Path, has_tables: bool, progress: Progress) -> _Read:
    motion, body = body_run(folder)
    model = with_axis_markers(body)
    if not motion.has_pose.any():
        raise ResultError(f"{folder}: the body was found in no frame, so there is nothing to export; track again")
    has_com = has_tables and has_inertias(model)
    rounds = 2 if has_com else 1
    points, sd = _by_rows(motion, lambda part: landmarks(part, model), progress, of_rounds=(0, rounds))
    com = _by_rows(motion, lambda part: _com(part, model), progress, of_rounds=(1, rounds)) if has_com else None
    columns = body_columns(motion, model, points, sd, com) if has_tables else {}
    return _Read([body_take(motion, model, points, sd)], columns)


def _read_players(folder: Path) -> _Read:
    motion = players_run(folder)
    takes = player_takes(motion)
    if not takes:
        raise ResultError(f"{folder}: no player was found in any frame, so there is nothing to export; track again")
    found = {take.name for take in takes}
    lost = [name for name, plain in zip(motion.players, plain_names(motion.players), strict=True) if plain not in found]
    notes = (f"found in no frame and left out: {', '.join(lost)}",) if lost else ()
    return _Read(takes, players_columns(motion), notes)


def _by_rows(
    motion: Motion, measure: Callable[[Motion], tuple[Array, Array]], progress: Progress, of_rounds: tuple[int, int]
) -> tuple[Array, Array]:
    """Measure a motion some rows at a time, telling how far it is."""
    parts, (done, rounds), n = [], of_rounds, len(motion)
    for first in range(0, n, _ROWS_AT_A_TIME):
        rows = slice(first, first + _ROWS_AT_A_TIME)
        cut = {each.name: getattr(motion, each.name)[rows] for each in fields(motion) if each.name != "joints"}
        parts.append(measure(replace(motion, **cut)))
        progress(done * n + min(rows.stop, n), rounds * n)
    values, sd = (np.concatenate(each) for each in zip(*parts, strict=True))
    return values, sd


def _com(motion: Motion, model: BodyModel) -> tuple[Array, Array]:
    table = flight(motion, model)
    return table["com"].to_numpy(), table["com_sd"].to_numpy()


def _write(kind: str, folder: Path, stem: str, read: _Read) -> list[Path]:
    """Write the files of one kind: one for all bodies, or one each."""
    together: dict[str, Callable[[Path], None]] = {
        "c3d": lambda path: write_c3d(path, read.takes),
        "gltf": lambda path: write_animation(path, read.takes),
        "csv": lambda path: write_csv(path, read.columns),
        "parquet": lambda path: write_parquet(path, read.columns),
    }
    if kind in together:
        path = folder / f"{stem}.{'glb' if kind == 'gltf' else kind}"
        together[kind](path)
        return [path]
    written: list[Path] = []
    for take in read.takes:
        path = folder / f"{f'{stem}_{take.name}' if take.name else stem}.{kind}"
        if kind == "trc":
            write_trc(path, take)
            written.append(path)
        elif kind == "osim":
            write_osim(path, take.model)
            written.append(path)
        else:
            written += write_mot(path, take) if kind == "mot" else write_bvh(path, take)
    return written
