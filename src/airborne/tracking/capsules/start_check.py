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

# chosen: times as uncertain as by hand are joints and legs' lengths here
_LOOSER, _FREER = 6.0, 4.0
# how far off a start is then said to be [m]; nearer than the second, where that explains the images better by a share.
# Chosen between 39 right starts, of synthetic blocks and block_jump, 21 to 51 mm off and one 66, which that explains by
# 2 % better, and 35 with mistakes: 20 are farther off, of 12 between the two 9 are explained by 3 % better or more
MOST_MISS_M, _FAR_MISS_M, _LEAST_GAIN = 0.05, 0.08, 0.03


def start_misses_m(starts: Sequence[PlayerStart], frames: Frames) -> Array:
    """Return how far the images put hips, knees and ankles from where each start with legs has them: (players,) [m].

    The mean of the six; NaN where the images show nobody there, or are explained as well at the start. About
    0.1 s a player.
    """
    misses_m = np.full(len(starts), np.nan)
    states = [start_state(start.name, start.joints_m) for start in starts]
    for i, (start, state) in enumerate(zip(starts, states, strict=True)):
        others = occluding_capsules(state, [*states[:i], *states[i + 1 :]])
        with suppress(TrialError):
            args = start.name, start.joints_m, frames, others
            fit = fit_first_frame(*args, looser=_LOOSER, freer=_FREER, start=state).fit
            if evidence_per_px(fit.owned) <= LEAST_EVIDENCE:
                continue
            found = points_of(fit.state)[[JOINTS.index(name) for name in LEG_POINTS]]
            given = np.array([start.joints_m[name] for name in LEG_POINTS])
            miss_m = np.linalg.norm(found - given, axis=1).mean()
            if MOST_MISS_M < miss_m <= _FAR_MISS_M:
                there = fit_first_frame(*args, start=state).fit
                if fit.nats < there.nats + _LEAST_GAIN * abs(there.nats):
                    continue
            misses_m[i] = miss_m
    return misses_m
