"""How each joint of a body, or each player, went in every frame of a run, also of one that goes on."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airborne.motion import JointStatus, Motion, known_landmarks
from airborne.motion.covariance_file import COVARIANCE_FILE, LASTING_FILE, read_covariances
from airborne.motion.files import parse_line
from airborne.motion.run_folder import BODY, JOINTS, MOTION, holds_players
from airborne.studio.runs import run_body, run_players, run_rows

FROM_GOOD = np.array([status.value for status in JointStatus])  # to bad
_RANK_OF_LETTER = np.full(256, len(FROM_GOOD), np.uint8)  # by a status's last letter but one; no status: beyond all
_RANK_OF_LETTER[[ord(status.value[-2]) for status in JointStatus]] = range(len(FROM_GOOD))
_CHUNK = 1 << 22  # of a table [bytes]
_MOST_TABLES = 8  # kept: 4 MB of 200,000 frames
_MOST_ROWS = 3000  # of a body, before its run is finished: half a millisecond each, once
_BLOCK, _RIM = 32, 2  # rows computed at once; and beside them, since a joint is strained in three frames on end
_MOST_BLOCKS = 300  # kept: of three runs


def run_strips(run: Path) -> tuple[tuple[str, ...], NDArray[np.uint8]]:
    """Return the names of joints or players, and how each went: (frames, names), places in `FROM_GOOD`.

    Without names for a thing, and for a body's run of more than 3000 frames until it is finished. Raises ResultError.
    """
    if holds_players(run):
        motion = run_players(run)
        return motion.players, ranks_of(motion.status)
    rows = run_rows(run)
    if rows.joints and (finished := _ranks_of_joints(run, len(rows))) is not None:
        return finished
    if not rows.joints or len(rows) > _MOST_ROWS or not (run / BODY).is_file():
        return (), np.zeros((len(rows), 0), np.uint8)
    names, n = tuple(landmark.name for landmark in run_body(run).landmarks), len(rows)
    order = np.argsort(rows.starts)  # by frame -> as in the file
    bounds, ranks = np.append(rows.starts[order], rows.end), np.zeros((n, len(names)), np.uint8)
    with rows.path.open("rb") as file:
        data = file.read(rows.end)
    for first in range(0, n, _BLOCK):
        begin, end = max(first - _RIM, 0), min(first + _BLOCK + _RIM, n)
        block = order[first : first + _BLOCK]
        found = _block_ranks(run, begin, data[bounds[begin] : bounds[end]], rows.joints)
        ranks[block] = found[first - begin :][: len(block)]
    return names, ranks


def doubtful_frames(run: Path) -> dict[str, NDArray[np.int64]]:
    """Return the frames in which the body, a joint of it or a player is uncertain, and those in which one is lost.

    A joint that no picture shows counts as lost here. Raises ResultError.
    """
    if holds_players(run):
        motion = run_players(run)
        index, ranks = motion.index, ranks_of(motion.status)
    else:
        rows, (_, of_joints) = run_rows(run), run_strips(run)
        n = min(len(rows), len(of_joints))  # a run that goes on has grown meanwhile
        index, ranks = rows.index[:n], np.column_stack([ranks_of(rows.status[:n]), of_joints[:n]])
    uncertain, unknown = (ranks_of(np.array(status.value)) for status in (JointStatus.UNCERTAIN, JointStatus.UNKNOWN))
    is_doubtful = {"uncertain": ranks == uncertain, "lost": ranks >= unknown}
    return {name: index[of_any.any(axis=1)] for name, of_any in is_doubtful.items()}


def _ranks_of_joints(run: Path, n: int) -> tuple[tuple[str, ...], NDArray[np.uint8]] | None:
    """Return what a finished run's table says of its n frames; None where it has none, or one of another motion."""
    try:
        status, motion = (run / JOINTS).stat(), (run / MOTION).stat()
    except OSError:
        return None
    if status.st_mtime_ns < motion.st_mtime_ns:  # it is tracked again
        return None
    names, ranks = _read_ranks(run / JOINTS, status.st_mtime_ns, status.st_size)
    return (names, ranks) if len(ranks) == n else None


@lru_cache(maxsize=_MOST_TABLES)
def _read_ranks(path: Path, *stamp: int) -> tuple[tuple[str, ...], NDArray[np.uint8]]:
    """Read the last column of a joints.csv, which begins with all joints of one frame, and so on; none of another file.

    A gigabyte a second: lines are not taken apart, as the last letter but one tells the statuses apart.
    """
    names: list[str] = []
    with path.open("rb") as file:
        is_known = file.readline().rstrip().endswith(b",status")
        begin, first = file.tell(), b""
        for line in file:
            cells = line.split(b",", 3)
            if (first := first or cells[0]) != cells[0]:
                break
            names.append(cells[2].decode(errors="replace") if len(cells) == 4 else "")
        file.seek(begin)
        tail, letters = b"\0\0", []
        while chunk := file.read(_CHUNK):
            data = np.frombuffer(tail + chunk, np.uint8)
            letters.append(data[np.flatnonzero(data[2:] == ord("\n"))])
            tail = (tail + chunk)[-2:]
    ranks = _RANK_OF_LETTER[np.concatenate([np.zeros(0, np.uint8), *letters])]
    if not names or not is_known or len(ranks) % len(names) or (ranks == len(FROM_GOOD)).any():
        return (), np.zeros((0, 0), np.uint8)
    return tuple(names), ranks.reshape(-1, len(names))


@lru_cache(maxsize=_MOST_BLOCKS)
def _block_ranks(run: Path, first: int, lines: bytes, joints: tuple[str, ...]) -> NDArray[np.uint8]:
    """Return how each joint went in rows of a motion.csv, of which the first is that many rows below its header."""
    model = run_body(run)
    motion = Motion.collect([parse_line(run / MOTION, line, joints) for line in lines.splitlines()], joints)
    covariance = read_covariances(run / COVARIANCE_FILE, len(motion), size=6 + 3 * len(joints), first=first)
    lasting = read_covariances(run / LASTING_FILE, len(motion), size=6, first=first)
    motion = replace(motion, covariance=covariance, lasting=None if np.isnan(lasting).any() else lasting)
    return ranks_of(known_landmarks(motion, model)[-1])


def ranks_of(status: NDArray[np.str_]) -> NDArray[np.uint8]:
    """Return the places of statuses in `FROM_GOOD`, of the same shape."""
    return (status[..., None] == FROM_GOOD).argmax(axis=-1).astype(np.uint8)
