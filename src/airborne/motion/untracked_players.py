"""Players of whom no frame is tracked: none of their joints is called tracked either, in their table joints.csv too."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from airborne.motion.players import PLAYERS_COLUMNS, PlayersMotion
from airborne.tracking import Status

_PLAYER, _STATUS = (PLAYERS_COLUMNS.index(name) for name in ("player", "status"))


def without_untracked(motion: PlayersMotion) -> PlayersMotion:
    """Return the motion with every joint uncertain that is tracked of a player of whom no frame is."""
    is_untracked = ~(motion.status == Status.TRACKED.value).any(axis=0)
    is_doubted = is_untracked[:, None] & (motion.joint_status == Status.TRACKED.value)
    return replace(motion, joint_status=np.where(is_doubted, Status.UNCERTAIN.value, motion.joint_status))


def has_untracked_player(path: Path) -> bool:
    """Tell whether some player has no tracked row in a joints.csv, finished or not, as in one that was revised."""
    if not path.exists():
        return False
    _, *lines = path.read_text(encoding="utf-8", errors="replace").splitlines() or [""]
    rows = [line.split(",") for line in lines]
    tracked = {row[_PLAYER] for row in rows if row[_STATUS : _STATUS + 1] == [Status.TRACKED.value]}
    return any(row[_PLAYER] not in tracked for row in rows)
