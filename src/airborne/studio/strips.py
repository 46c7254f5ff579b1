"""How each joint of a body, or each player, went in every frame of a run, also of one that goes on."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airborne.motion import JointStatus, Motion, joint_statuses, landmarks
from airborne.motion.covariance_file import COVARIANCE_FILE, LASTING_FILE, read_covariances
from airborne.motion.files import parse_line
from airborne.motion.run_folder import BODY, MOTION, holds_players
from airborne.studio.runs import run_body, run_players, run_rows

FROM_GOOD = np.array([status.value for status in JointStatus])  # to bad
_MOST_ROWS = 3000  # of a body: half a millisecond each, once
_BLOCK, _RIM = 32, 2  # rows computed at once; and beside them, since a joint is strained in three frames on end
_MOST_BLOCKS = 300  # kept: of three runs


def run_strips(run: Path) -> tuple[tuple[str, ...], NDArray[np.int64]]:
    """Return the names of joints or players, and how each went: (frames, names), places in `FROM_GOOD`.

    Without names for a thing, and for a body's run of more than 3000 frames. Raises ResultError.
    """
    if holds_players(run):
        motion = run_players(run)
        return motion.players, ranks_of(motion.status)
    rows = run_rows(run)
    if not rows.joints or len(rows) > _MOST_ROWS or not (run / BODY).is_file():
        return (), np.zeros((len(rows), 0), np.int64)
    names, n = tuple(landmark.name for landmark in run_body(run).landmarks), len(rows)
    order = np.argsort(rows.starts)  # by frame -> as in the file
    bounds, ranks = np.append(rows.starts[order], rows.end), np.zeros((n, len(names)), np.int64)
    with rows.path.open("rb") as file:
        data = file.read(rows.end)
    for first in range(0, n, _BLOCK):
        begin, end = max(first - _RIM, 0), min(first + _BLOCK + _RIM, n)
        block = order[first : first + _BLOCK]
        found = _block_ranks(run, begin, data[bounds[begin] : bounds[end]], rows.joints)
        ranks[block] = found[first - begin :][: len(block)]
    return names, ranks


@lru_cache(maxsize=_MOST_BLOCKS)
def _block_ranks(run: Path, first: int, lines: bytes, joints: tuple[str, ...]) -> NDArray[np.int64]:
    """Return how each joint went in rows of a motion.csv, of which the first is that many rows below its header."""
    model = run_body(run)
    motion = Motion.collect([parse_line(run / MOTION, line, joints) for line in lines.splitlines()], joints)
    covariance = read_covariances(run / COVARIANCE_FILE, len(motion), size=6 + 3 * len(joints), first=first)
    lasting = read_covariances(run / LASTING_FILE, len(motion), size=6, first=first)
    motion = replace(motion, covariance=covariance, lasting=None if np.isnan(lasting).any() else lasting)
    return ranks_of(joint_statuses(motion, model, landmarks(motion, model)[1]))


def ranks_of(status: NDArray[np.str_]) -> NDArray[np.int64]:
    """Return the places of statuses in `FROM_GOOD`, of the same shape."""
    return (status[..., None] == FROM_GOOD).argmax(axis=-1)
