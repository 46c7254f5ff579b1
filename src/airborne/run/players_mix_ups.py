"""Mix-ups of the videos of players, before they are tracked: exchanged, mirrored, upside down.

Where a camera does not show the players at the start, they are fitted to the first images once more: with those of two
cameras exchanged, and with those of one mirrored or turned by 180 degrees. Their colours and edges tell
more than what moves, which may be little before a jump.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from airborne.cameras.finding import Finding
from airborne.errors import MistakesError, TrialError
from airborne.run.mix_ups import possible_mix_ups
from airborne.tracking.capsules.first_frame import FirstFrameFit, start_state
from airborne.tracking.capsules.occlusion import count_unoccluded
from airborne.tracking.capsules.track import evidence_per_px
from airborne.tracking.capsules.tracker import fit_starts
from airborne.tracking.players import PlayerStart
from airborne.types import Array
from airborne.video import Frames

# times the evidence as named, nats a pixel, and share of cameras that show each player, of the images as they would be
# without a mix-up. Chosen on twelve synthetic blocks of 9001 to 9103 and block_jump: of 72 mix-ups 62 are named, and in
# 235 recordings with at most one camera turned by 0.5 to 2 degrees 2
_MORE, _LEAST_EVIDENCE, _LEAST_SHOWN = 1.3, 1.5, 0.5
_MANY = 10.0  # chosen: times, of which the figure says nothing more


def refuse_players_mix_ups(starts: Sequence[PlayerStart], first: Frames | None) -> None:
    """Raise MistakesError, naming the cameras, where the players fit the first images of other cameras better."""
    finding = None if first is None else players_mix_up_in(starts, first)
    if finding is not None:
        raise MistakesError("the videos", [finding.sentence])


def players_mix_up_in(starts: Sequence[PlayerStart], first: Frames) -> Finding | None:
    """Return the mix-up without which the players fit the first images clearly better; None without a sign of one.

    Nothing is tried where three cameras or more all show the players; of two, none could be told from the other.
    """
    with_legs = [start for start in starts if start.has_legs]
    n_views = sum(view is not None for view in first.views)
    if n_views < 2:
        return None
    try:
        states = [start_state(start.name, start.joints_m) for start in with_legs]
    except TrialError:
        return None
    named = _fit(with_legs, states, first)
    if not named or (_shown(named, first) == 1 and n_views > 2):
        return None
    nats, names = max(_nats(named), 1.0), [view.camera.name if view else "" for view in first.views]
    best, most, found = None, _MORE, named
    for mix_up in possible_mix_ups(len(names)):
        right = mix_up.undo(first)
        fits = [] if right is None else _fit(with_legs, states, right)
        if fits and _nats(fits) > most * nats:
            best, most, found = mix_up, _nats(fits) / nats, fits
    if best is None or _evidence(found) < _LEAST_EVIDENCE or _shown(found, first) <= _LEAST_SHOWN:
        return None
    times = f"{most:.1f}" if most < _MANY else "many"
    what = f"with {best.describe(names)}, the players at the start fit them {times} times as well"
    return best.finding(names, what)


def _fit(starts: Sequence[PlayerStart], states: Sequence[Array], frames: Frames) -> list[FirstFrameFit]:
    """Fit the players from their start states (35,); empty where an image shows none of somebody."""
    try:
        return fit_starts(starts, states, frames)
    except TrialError:
        return []


def _evidence(fits: Sequence[FirstFrameFit]) -> float:
    """Return the mean evidence of the players' pixels [nat]."""
    return float(np.mean([evidence_per_px(fit.fit.owned) for fit in fits]))


def _shown(fits: Sequence[FirstFrameFit], frames: Frames) -> float:
    """Return the share of the cameras with an image that shows a player, of all players."""
    views = [i for i, view in enumerate(frames.views) if view is not None]
    return float(np.mean([count_unoccluded(fit.colours.occlusion, views) / len(views) for fit in fits]))


def _nats(fits: Sequence[FirstFrameFit]) -> float:
    return sum(fit.fit.total for fit in fits)
