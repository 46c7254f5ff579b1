"""A run's curves over its frames, no finer than a screen shows them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from airborne.errors import ResultError
from airborne.motion import PlayersMotion
from airborne.motion.run_folder import ANGLES, FLIGHT, JOINT_ANGLES, SUMMARY, holds_players
from airborne.studio.runs import run_body, run_players, run_rows
from airborne.studio.strips import FROM_GOOD, ranks_of, run_strips
from airborne.types import Array

LIMBS = ("hip", "knee", "ankle", "foot")  # in order down a leg
_MOST_POINTS = 4000  # of a curve: more than a screen has columns
_FEET = "feet"  # of players: what curves show instead of their hips
_JOINT = "joint:"  # before a joint's name, in what curves show
_TABLES = {  # what curves show besides: the table, words, unit, columns and their names
    "rotation": (ANGLES, "rotation", "°", {f"{name}_deg": name for name in ("somersault", "tilt", "twist")}),
    "com": (FLIGHT, "centre of mass", "m", {f"com_{axis}_m": axis for axis in "xyz"}),
    "momentum": (FLIGHT, "angular momentum", "kg m²/s", {f"L_{axis}_kg_m2_s": axis for axis in "xyz"}),
}
_OF_JOINT = (JOINT_ANGLES, "", "°", {f"{axis}_deg": axis for axis in "xyz"})


def curve_kinds(run: Path) -> dict[str, str]:
    """Return what a run's curves can show: its name in an address, and in words."""
    if holds_players(run):
        return {"": "how high the hips are", _FEET: "how high the feet are"}
    found = {"": "position", **{name: words for name, (file, words, *_) in _TABLES.items() if (run / file).is_file()}}
    limbs = run_body(run).segments[1:] if (run / JOINT_ANGLES).is_file() else ()
    return found | {f"{_JOINT}{limb.name}": limb.name.replace("_", " ") for limb in limbs}


def run_curves(run: Path, what: str = "") -> dict[str, Any]:
    """Return a run's curves: times, frames, statuses, and series with their standard deviations.

    `what` is one of `curve_kinds`; raises ResultError for another. A strip is how a joint or a player went: a digit a
    frame, its place in `strips.FROM_GOOD`.
    `is_provisional`: deviations of a body grow once its run ends, with what all of its frames say of the cameras.
    Of a long run several frames share a point: the least and the greatest of their values, the worst of their statuses.
    """
    unit = "m"
    if holds_players(run):
        motion = run_players(run)
        index, time_s, status = motion.index, motion.time_s, motion.status
        names, values, sd = _lower_legs(motion) if what == _FEET else _hips(motion)
    else:
        rows = run_rows(run)
        index, time_s, status = rows.index, rows.time_s, rows.status[:, None]
        names, values, sd = ["x", "y", "z"], rows.position, rows.position_sd
        if what:
            names, unit, values, sd = _read_series(run, what, index)
    strips, ranks = run_strips(run)
    is_thinned = len(index) > _MOST_POINTS
    worst = ranks_of(status).max(axis=1, initial=0)
    if is_thinned:
        starts = np.arange(0, len(index), -(-2 * len(index) // _MOST_POINTS))
        middles = np.append((starts[:-1] + starts[1:]) // 2, len(index) - 1)
        ends = [np.fmin.reduceat(values, starts), np.fmax.reduceat(values, starts)]
        shown = _interleave(starts, middles)
        index, time_s, values = index[shown], time_s[shown], _interleave(*ends)
        sd, worst = np.fmax.reduceat(sd, starts).repeat(2, axis=0), np.maximum.reduceat(worst, starts).repeat(2)
        ranks = np.maximum.reduceat(ranks, starts).repeat(2, axis=0)
    return {
        "is_thinned": is_thinned,
        "is_provisional": not (holds_players(run) or (run / SUMMARY).is_file()),
        "frame": index.tolist(),
        "time_s": time_s.tolist(),
        "status": FROM_GOOD[worst].tolist(),
        "strips": [{"name": name, "rank": "".join(map(str, ranks[:, k]))} for k, name in enumerate(strips)],
        "series": [
            {"name": name, "unit": unit, "value": _plain(values[:, k]), "sd": _plain(sd[:, k])}
            for k, name in enumerate(names)
        ],
    }


def _read_series(run: Path, what: str, index: NDArray[np.int64]) -> tuple[list[str], str, Array, Array]:
    """Read columns of a run's tables: names, unit, values and deviations (n, columns), NaN where a frame has none."""
    joint = what.removeprefix(_JOINT) if what.startswith(_JOINT) else None
    if what not in _TABLES and joint is None:
        raise ResultError(f"no curve is called {what}; reload this page")
    file, _, unit, columns = _TABLES.get(what, _OF_JOINT)
    found = np.full((len(index), 2 * len(columns)), np.nan)
    try:
        with (run / file).open(encoding="utf-8") as lines:
            header = next(lines).rstrip("\n").split(",")
            at = [header.index(name) for name in (*columns, *(f"{name}_sd" for name in columns))]
            for line in lines:
                cells = line.rstrip("\n").split(",")
                row = int(np.searchsorted(index, frame := int(cells[0])))
                if joint in (None, cells[2]) and row < len(index) and index[row] == frame:
                    found[row] = [float(cells[k] or "nan") for k in at]
    except (OSError, ValueError, IndexError, StopIteration):
        raise ResultError(f"{run.name}/{file} cannot be read; track again") from None
    return list(columns.values()), unit, found[:, : len(columns)], found[:, len(columns) :]


@dataclass(frozen=True, slots=True, eq=False)
class Momenta:
    """The angular momentum about the centre of mass in each frame of a run."""

    index: NDArray[np.int64]  # (n,) frames, ascending
    com_m: Array  # (n, 3) centres of mass, NaN where not known
    L: Array  # (n, 3) [kg m²/s]
    L_sd: Array  # (n, 3)
    greatest: float  # of all [kg m²/s]

    def at(self, frame: int) -> tuple[Array, Array, float] | None:
        """Return the centre of mass (3,), the momentum (3,) and its size's standard deviation; None where not known."""
        row = int(np.searchsorted(self.index, frame))
        if row >= len(self.index) or self.index[row] != frame or not np.isfinite([self.com_m[row], self.L[row]]).all():
            return None
        L, sd = self.L[row], np.nan_to_num(self.L_sd[row])
        return self.com_m[row], L, float(np.linalg.norm(L * sd) / max(float(np.linalg.norm(L)), 1e-9))


def run_momenta(run: Path) -> Momenta | None:
    """Return the angular momenta of a run of one body; None where it has no table of them. Raises ResultError."""
    if not (run / FLIGHT).is_file():
        return None
    index = run_rows(run).index
    (_, _, com_m, _), (_, _, L, L_sd) = (_read_series(run, what, index) for what in ("com", "momentum"))
    return Momenta(index, com_m, L, L_sd, float(np.nanmax(np.linalg.norm(L, axis=1), initial=1e-9)))


def describe_distance(run: Path, other: Path) -> str:
    """Say how far two runs are apart, in the frames, players and joints that both have."""
    (own, a), (frames, b) = _points(run), _points(other)
    names = [name for name in a if name in b]
    common, rows, others = np.intersect1d(own, frames, return_indices=True)
    if not len(common) or not names:
        return "they share no frame"
    far_m = np.stack([np.linalg.norm(a[name][rows] - b[name][others], axis=1) for name in names], axis=1)
    far_m = np.where(np.isfinite(far_m), far_m, -1.0).max(axis=1)
    if far_m.max() < 0:
        return "no frame is tracked in both"
    median, most, frame = np.median(far_m[far_m >= 0]), far_m.max(), int(common[far_m.argmax()])
    what = "the bodies' positions" if names == [""] else "the joints that differ most"
    return f"{what} are {1e3 * median:.0f} mm apart, the median; at most {1e3 * most:.0f} mm, in frame {frame}"


def _points(run: Path) -> tuple[NDArray[np.int64], dict[str, Array]]:
    """Return a run's frames (n,), and by name where its points are, (n, 3) [m]: a body's root, players' joints."""
    if not holds_players(run):
        rows = run_rows(run)
        return rows.index, {"": rows.position}
    motion = run_players(run)
    pairs = [(p, j) for p in range(len(motion.players)) for j in range(len(motion.joints))]
    return motion.index, {f"{motion.players[p]} {motion.joints[j]}": motion.points[:, p, j] for p, j in pairs}


def _hips(motion: PlayersMotion) -> tuple[Sequence[str], Array, Array]:
    """Return how high the middle of each player's hips is, names, values and deviations (n, players) [m]."""
    height, variance = _limb_heights(motion, "hip")
    return [f"{name}: hips" for name in motion.players], height.mean(axis=2), np.sqrt(variance.mean(axis=2))


def _lower_legs(motion: PlayersMotion) -> tuple[Sequence[str], Array, Array]:
    """Return how high the lower of each player's legs is, and which joint of it, as `_hips` does."""
    limb = next((limb for limb in reversed(LIMBS) if f"{limb}_left" in motion.joints), LIMBS[0])
    height, variance = _limb_heights(motion, limb)
    lower = np.argmin(np.where(np.isfinite(height), height, np.inf), axis=2)[..., None]
    height, variance = (np.take_along_axis(each, lower, axis=2)[..., 0] for each in (height, variance))
    return [f"{name}: lower {limb}" for name in motion.players], height, np.sqrt(variance)


def _limb_heights(motion: PlayersMotion, limb: str) -> tuple[Array, Array]:
    """Return heights and variances (n, players, 2) of a joint on both sides. Raises ResultError where it is missing."""
    sides = [f"{limb}_{side}" for side in ("left", "right")]
    if not set(sides) <= set(motion.joints):
        raise ResultError("the run holds no legs; track again")
    both = [motion.joints.index(side) for side in sides]
    return motion.points[:, :, both, 2], motion.covariance[:, :, both, 2, 2]


def _interleave(first: NDArray, second: NDArray) -> NDArray:
    return np.stack([first, second], axis=1).reshape(-1, *first.shape[1:])


def _plain(values: Iterable[float]) -> list[float | None]:
    return [round(float(value), 5) if np.isfinite(value) else None for value in values]
