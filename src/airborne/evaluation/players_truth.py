"""The true paths of several players, and reference numbers of their jumps."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from airborne.constants import GRAVITY_M_S2
from airborne.errors import ResultError
from airborne.evaluation.table import read_table
from airborne.io.text import read_json
from airborne.motion.players import PlayersMotion
from airborne.tracking import Status

_EXPECTED = "a truth table of players: frame, time_s, player, then x, y, z of every joint, as l_hip_x, l_hip_y, l_hip_z"
_SIDES = {"l": "left", "r": "right"}
_TRUTH_SD_M = 1e-3  # a truth counts as exact to a millimetre
_EVENTS = {"takeoff_frame": "last_contact_frame", "landing_frame": "first_contact_frame"}
_HEIGHTS = {
    "hip_height_m": "hip_rise_over_standing_m",
    "foot_height_m": "foot_rise_m",
    "takeoff_speed_height_m": "com_rise_from_takeoff_m",
    "hip_rise_m": "hip_rise_from_takeoff_m",
}


def read_players_truth(path: Path) -> PlayersMotion:
    """Read a truth table with one row for each player and frame; `l_hip_x` becomes the x of `hip_left`.

    Raises ResultError in one line if columns are missing or some frame lacks a player.
    """
    table = read_table(path, _EXPECTED)
    stems = [name.removesuffix("_x") for name in table.names if name.endswith("_x")]
    wanted = ["frame", "time_s", "player", *(f"{stem}_{axis}" for stem in stems for axis in "yz")]
    missing = [name for name in wanted if name not in table.names]
    if missing or not stems:
        raise ResultError(f"{path} has no column {missing[0] if missing else 'l_hip_x'}; expected {_EXPECTED}")
    positions, times_s = table.numbers([f"{stem}_{axis}" for stem in stems for axis in "xyz"]), table.times_s()
    if np.isnan(positions).all():
        raise ResultError(f"{path} holds no position of any point; expected {_EXPECTED}")
    frames, row = np.unique(table.whole_numbers("frame"), return_inverse=True)
    names = [cells[table.names.index("player")].strip() for cells in table.lines]
    players = tuple(dict.fromkeys(names))
    column = np.array([players.index(name) for name in names])
    shape = len(frames), len(players)
    cell, count = np.unique(row * len(players) + column, return_counts=True)
    if len(cell) != shape[0] * shape[1] or (count > 1).any():
        raise ResultError(f"{path} has not one row for each of {len(players)} players in every frame; correct it")
    time_s = np.empty(shape)
    points = np.empty((*shape, len(stems), 3))
    time_s[row, column] = times_s
    points[row, column] = positions.reshape(-1, len(stems), 3)
    if np.ptp(time_s, axis=1).max() > 0 or (np.diff(time_s[:, 0]) <= 0).any():
        raise ResultError(f"{path}: time_s must be one number in each frame, and grow with the frames; correct it")
    return PlayersMotion(
        index=frames,
        time_s=time_s[:, 0],
        rate=1 / float(np.median(np.diff(time_s[:, 0]))) if len(frames) > 1 else np.nan,
        players=players,
        joints=tuple(_joint(stem) for stem in stems),
        points=points,
        covariance=np.broadcast_to(_TRUTH_SD_M**2 * np.eye(3), (*points.shape, 3)),
        joint_status=np.full(points.shape[:3], Status.TRACKED.value),
        score=np.full(shape, np.nan),
        n_views=np.zeros(shape, np.int64),
    )


def read_reference_jumps(path: Path) -> dict[str, dict[str, float]]:
    """Read each player's reference numbers of the jump from players.json, named as in `Jump`; empty without the file.

    Contact frames may have fractions. Raises ResultError if the file is no such list.
    """
    if not path.is_file():
        return {}
    try:
        players = read_json(path)
        facts = {str(player["name"]): player["jump"] for player in players if player.get("jump")}
        return {name: reference_jump(jump) for name, jump in facts.items()}
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError):
        raise ResultError(f"{path} is no list of players with name and jump; write it so, or remove it") from None


def reference_jump(jump: Mapping[str, float]) -> dict[str, float]:
    """Convert the facts of a jump, as a scene generator states them, to numbers of our jump table."""
    reference = {name: float(jump[key]) for name, key in (_EVENTS | _HEIGHTS).items() if key in jump}
    if "flight_s" in jump:
        reference["flight_time_height_m"] = GRAVITY_M_S2 * float(jump["flight_s"]) ** 2 / 8
    return reference


def _joint(stem: str) -> str:
    side, _, part = stem.partition("_")
    return f"{part}_{_SIDES[side]}" if side in _SIDES and part else stem
