"""Paths of joints from other systems: a long table, or a TRC file."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from airborne.errors import ResultError
from airborne.evaluation.table import read_table
from airborne.io.text import read_text
from airborne.types import Array

_LONG = "a table with the columns time_s, joint, x_m, y_m, z_m, one line for each time and joint"
_TRC = "a TRC file of markers: PathFileType, rates and units, marker names, then tab-separated lines"
_LARGEST_TRC_BYTES = 50_000_000  # larger files are refused
_METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
_SIDES = {"l": "left", "left": "left", "r": "right", "right": "right"}
_PAIRED = {name: name for name in ("hip", "knee", "ankle", "foot", "shoulder", "elbow", "wrist", "hand")}
_PAIRED |= {"bigtoe": "foot", "footindex": "foot"}
_SINGLE = {name: name for name in ("pelvis", "torso", "neck")}
_SINGLE |= {"hip": "pelvis", "midhip": "pelvis", "chip": "pelvis"}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointPaths:
    """Positions of joints over time: from another system, true, or smoothed."""

    names: tuple[str, ...]  # as in the file
    time_s: Array  # (n,) increasing [s]
    points: Array  # (n, joints, 3) world [m]; NaN where not known
    sd: Array | None = None  # (n, joints) [m], root mean square over the axes; None where the file has none


def read_joint_paths(path: Path) -> JointPaths:
    """Read paths of joints: a `.trc` file, or else a long table like joints.csv. Raises ResultError in one line."""
    return _read_trc(path) if path.suffix.lower() == ".trc" else _read_long(path)


def landmark_of(marker: str) -> str | None:
    """Return the landmark for a pose network's keypoint name (RHip, left_hip, hip_left, RBigToe), or None.

    Handles the names of HALPE, BODY_25, COCO and BlazePose. The big toe stands for the ball of the foot. The landmark
    `head` lies between the ears; networks' Head is the top of it.
    """
    if marker == "head":
        return marker
    words = [word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", marker)]
    sides = [_SIDES[word] for word in words if word in _SIDES]
    stem = "".join(word for word in words if word not in _SIDES)
    if len(sides) == 1 and stem in _PAIRED:
        return f"{_PAIRED[stem]}_{sides[0]}"
    return None if sides else _SINGLE.get(stem)


def _read_long(path: Path) -> JointPaths:
    table = read_table(path, f"{_LONG}; or a .trc file")
    missing = [name for name in ("time_s", "joint", "x_m", "y_m", "z_m") if name not in table.names]
    if missing:
        raise ResultError(f"{path} has no column {', '.join(missing)}; expected {_LONG}, or a .trc file")
    positions, times_s = table.numbers(["x_m", "y_m", "z_m"]), table.times_s()
    if "player" in table.names:
        players = sorted({cells[table.names.index("player")] for cells in table.lines})
        if len(players) > 1:
            raise ResultError(f"{path} holds {len(players)} players ({', '.join(players[:3])}...); leave one in")
    labels = [cells[table.names.index("joint")].strip() for cells in table.lines]
    names = tuple(dict.fromkeys(labels))
    time_s, at = np.unique(times_s, return_inverse=True)
    joint = np.array([names.index(label) for label in labels])
    cell, count = np.unique(at * len(names) + joint, return_counts=True)
    if (count > 1).any():
        when, who = divmod(int(cell[np.argmax(count)]), len(names))
        raise ResultError(f"{path} has {names[who]} {count.max()} times at {time_s[when]:g} s; give each joint once")
    points = np.full((len(time_s), len(names), 3), np.nan)
    points[at, joint] = positions
    sd = None
    if "sd_m" in table.names:
        sd = np.full(points.shape[:2], np.nan)
        sd[at, joint] = table.numbers(["sd_m"], or_infinite=True)[:, 0]
    return JointPaths(names=names, time_s=time_s, points=points, sd=sd)


def _read_trc(path: Path) -> JointPaths:
    """Read a TRC file, whose y points up: world x, y, z are its z, x, y."""
    try:
        lines = [line.rstrip("\r").split("\t") for line in read_text(path, _LARGEST_TRC_BYTES).split("\n")]
    except OSError as error:
        raise ResultError(f"{path} cannot be read ({error.strerror}); expected {_TRC}") from None
    except ValueError as error:
        raise ResultError(f"{path}: {error}; expected {_TRC}") from None
    if len(lines) < 6 or lines[0][0] != "PathFileType" or lines[3][:1] != ["Frame#"]:
        raise ResultError(f"{path} does not begin like a TRC file; expected {_TRC}")
    header = dict(zip(lines[1], lines[2], strict=False))
    unit = header.get("Units", "").strip()
    if unit not in _METRES:
        raise ResultError(f"{path}: Units is '{unit}'; expected m, cm or mm")
    names = tuple(name.strip() for name in lines[3][2:] if name.strip())
    width = 2 + 3 * len(names)
    rows = [(number, cells) for number, cells in enumerate(lines[5:], start=6) if any(cell.strip() for cell in cells)]
    values = np.array([_numbers(path, number, cells, width) for number, cells in rows]).reshape(-1, width)
    if not len(values) or not names:
        raise ResultError(f"{path} has no lines of numbers, or no markers; expected {_TRC}")
    time_s = values[:, 1]
    for before, (number, _) in enumerate(rows[1:]):
        if not time_s[before] < time_s[before + 1]:
            raise ResultError(f"{path} line {number}: its time is not after the line before; sort by time")
    points = _METRES[unit] * values[:, 2:].reshape(len(values), -1, 3)[..., [2, 0, 1]]
    return JointPaths(names=names, time_s=time_s, points=points)


def _numbers(path: Path, line: int, cells: list[str], width: int) -> list[float]:
    """Read one line of a TRC file; blank cells, and those left out at its end, are NaN."""
    if any(cell.strip() for cell in cells[width:]):
        raise ResultError(f"{path} line {line} has {len(cells)} cells, expected {width}; correct it")
    cells = [*cells[:width], *[""] * (width - len(cells))]
    try:
        return [float(cell) if cell.strip() else np.nan for cell in cells]
    except ValueError:
        raise ResultError(f"{path} line {line}: a cell is not a number; correct it") from None
