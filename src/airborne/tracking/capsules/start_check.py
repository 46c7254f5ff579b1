"""Whether the images of the first frame show players' legs where their starts have them."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from airborne.body.legs import LEG_POINTS
from airborne.errors import TrialError
from airborne.tracking.capsules.bystanders import LEAST_EVIDENCE, occluding_capsules
from airborne.tracking.capsules.first_frame import fit_first_frame, points_of, start_state
from airborne.tracking.capsules.jumper import JOINTS
from airborne.tracking.capsules.track import evidence_per_px
from airborne.tracking.players import PlayerStart
from airborne.types import Array
from airborne.video import Frames

# times as uncertain as by hand are joints and legs' lengths here, and how far off a start is then said to be [m].
# Chosen between 14 right starts, of synthetic blocks and block_jump, 21 to 38 mm off and one of a hard scene 47, and
# twelve with mistakes, 59 to 187 mm off
_LOOSER, _FREER, MOST_MISS_M = 6.0, 4.0, 0.05


def start_misses_m(starts: Sequence[PlayerStart], frames: Frames) -> Array:
    """Return how far the images put hips, knees and ankles from where each start with legs has them: (players,) [m].

    The mean of the six; NaN where the images show nobody there. About 0.1 s a player.
    """
    misses_m = np.full(len(starts), np.nan)
    states = [start_state(start.name, start.joints_m) for start in starts]
    for i, (start, state) in enumerate(zip(starts, states, strict=True)):
        others = occluding_capsules(state, [*states[:i], *states[i + 1 :]])
        with suppress(TrialError):
            args = start.name, start.joints_m, frames, others
            fitted = fit_first_frame(*args, looser=_LOOSER, freer=_FREER, start=state)
            if evidence_per_px(fitted.fit.owned) <= LEAST_EVIDENCE:
                continue
            found = points_of(fitted.fit.state)[[JOINTS.index(name) for name in LEG_POINTS]]
            given = np.array([start.joints_m[name] for name in LEG_POINTS])
            misses_m[i] = np.linalg.norm(found - given, axis=1).mean()
    return misses_m
