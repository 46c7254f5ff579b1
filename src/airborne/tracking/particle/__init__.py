"""Particle filters of legs: `Frames`, hand-set players and torsos in; six points per player out.

The three methods of the block-jump paper's Table I. `resampling`, `swing` and `jump_state` are functions of arrays.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from airborne.body.legs import LEG_POINTS, Legs
from airborne.cameras import Rig
from airborne.errors import TrialError
from airborne.tracking.particle.block_jump import BlockJump
from airborne.tracking.particle.framework import Framework
from airborne.tracking.particle.mixture import Mixture, RandomWalk
from airborne.tracking.particle.settings import LegsMethod, LegsSettings
from airborne.tracking.particle.situation import Filter
from airborne.tracking.particle.torso import GivenTorsos, TorsoInput, TorsoTracker, start_torso, torso_tracker
from airborne.tracking.particle.tracker import LegsPlayer, LegsTracker
from airborne.tracking.players import PlayerStart

__all__ = [
    "GivenTorsos",
    "LegsMethod",
    "LegsSettings",
    "LegsTracker",
    "TorsoInput",
    "TorsoTracker",
    "legs_tracker",
    "torso_tracker",
]


def legs_tracker(
    settings: LegsSettings, rig: Rig, starts: Sequence[PlayerStart], torso: TorsoInput | None = None
) -> LegsTracker:
    """Make the tracker of one of the block-jump paper's methods.

    starts: players with a torso and all LEG_POINTS are tracked; those with only a torso are bystanders. torso supplies
    the torsos of all players, in this order; None tracks them in the images. Raises TrialError if no player has legs or
    a torso is missing, BodyError if legs are incomplete or implausible.
    """
    torsos = [start_torso(start) for start in starts]
    players = []
    for i, start in enumerate(starts):
        if start.has_legs:
            points = np.array([np.asarray(start.joints_m.get(name, np.full(3, np.nan)), float) for name in LEG_POINTS])
            players.append(LegsPlayer(start.name, i, Legs.from_points(torsos[i], points), points))
    if not players:
        raise TrialError(f"no player has legs; give at least one of them a torso and {', '.join(LEG_POINTS)}")
    return LegsTracker(
        settings, rig, torso or torso_tracker(rig, starts, settings.seed), tuple(players), _filter(settings)
    )


def _filter(settings: LegsSettings) -> Filter:
    if settings.method == "framework":
        return Framework(settings)
    return Mixture(settings, RandomWalk() if settings.method == "mixture" else BlockJump(settings.swing))
