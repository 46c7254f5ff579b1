"""A run's curves over its frames, no finer than a screen shows them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from airborne.errors import ResultError
from airborne.motion import PlayersMotion
from airborne.motion.run_folder import holds_players
from airborne.studio.runs import run_players, run_rows
from airborne.tracking import Status
from airborne.types import Array

LIMBS = ("hip", "knee", "ankle", "foot")  # in order down a leg
_MOST_POINTS = 4000  # of a curve: more than a screen has columns
_FROM_GOOD = np.array([Status.TRACKED.value, Status.UNCERTAIN.value, Status.LOST.value])  # to bad


def run_curves(run: Path) -> dict[str, Any]:
    """Return a run's curves: times, frames, statuses, and series with their standard deviations.

    Of a long run several frames share a point: the least and the greatest of their values, the worst of their statuses.
    """
    if holds_players(run):
        motion = run_players(run)
        index, time_s, status = motion.index, motion.time_s, motion.status
        names, values = _lower_legs(motion)
        sd = np.empty((len(index), 0))
    else:
        rows = run_rows(run)
        index, time_s, status = rows.index, rows.time_s, rows.status[:, None]
        names, values, sd = ["x", "y", "z"], rows.position, rows.position_sd
    worst = (status[..., None] == _FROM_GOOD).argmax(axis=-1).max(axis=1, initial=0)
    if len(index) > _MOST_POINTS:
        starts = np.arange(0, len(index), -(-2 * len(index) // _MOST_POINTS))
        middles = np.append((starts[:-1] + starts[1:]) // 2, len(index) - 1)
        ends = [np.fmin.reduceat(values, starts), np.fmax.reduceat(values, starts)]
        shown = _interleave(starts, middles)
        index, time_s, values = index[shown], time_s[shown], _interleave(*ends)
        sd, worst = np.fmax.reduceat(sd, starts).repeat(2, axis=0), np.maximum.reduceat(worst, starts).repeat(2)
    return {
        "frame": index.tolist(),
        "time_s": time_s.tolist(),
        "status": _FROM_GOOD[worst].tolist(),
        "series": [
            {"name": name, "unit": "m", "value": _plain(values[:, k]), "sd": _plain(sd[:, k]) if sd.shape[1] else []}
            for k, name in enumerate(names)
        ],
    }


def _lower_legs(motion: PlayersMotion) -> tuple[Sequence[str], Array]:
    """Return how high the lower of each player's legs is, and which joint of it: (n, players) [m]."""
    limb = next((limb for limb in reversed(LIMBS) if {f"{limb}_left", f"{limb}_right"} <= set(motion.joints)), None)
    if limb is None:
        raise ResultError("the run holds no legs; track again")
    lower = [motion.joints.index(f"{limb}_{side}") for side in ("left", "right")]
    return [f"{name}: lower {limb}" for name in motion.players], np.min(motion.points[:, :, lower, 2], axis=2)


def _interleave(first: NDArray, second: NDArray) -> NDArray:
    return np.stack([first, second], axis=1).reshape(-1, *first.shape[1:])


def _plain(values: Iterable[float]) -> list[float | None]:
    return [round(float(value), 5) if np.isfinite(value) else None for value in values]
