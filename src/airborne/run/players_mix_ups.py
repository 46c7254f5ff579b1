"""Mix-ups of the videos of players, before they are tracked: files exchanged, mirrored images.

Where a camera does not show the players at the start, they are fitted to the first images once more: with those of two
cameras exchanged, and with those of one mirrored. Their colours and edges tell more than what moves, which may be
little before a jump.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing

import numpy as np

from airborne.cameras.finding import Finding
from airborne.errors import MistakesError, TrialError
from airborne.run.mix_ups import possible_mix_ups
from airborne.tracking.capsules.bystanders import LEAST_EVIDENCE
from airborne.tracking.capsules.first_frame import FirstFrameFit, start_state
from airborne.tracking.capsules.occlusion import count_unoccluded
from airborne.tracking.capsules.track import evidence_per_px
from airborne.tracking.capsules.tracker import fit_starts
from airborne.tracking.players import PlayerStart
from airborne.video import Frames, Recording

# times the evidence as named: of wrong orders 0.9 at most on synthetic blocks 9001 to 9006, of the right one 1.15 at
# least where two cameras were exchanged or one mirrored
_MORE = 1.1
_MANY = 10.0  # times, of which the figure says nothing more


def refuse_players_mix_ups(starts: Sequence[PlayerStart], recording: Recording) -> None:
    """Raise MistakesError, naming the cameras, where the players fit the first images of other cameras better."""
    with closing(iter(recording)) as frames:
        first = next(frames, None)
    finding = None if first is None else players_mix_up_in(starts, first)
    if finding is not None:
        raise MistakesError("the videos", [finding.sentence])


def players_mix_up_in(starts: Sequence[PlayerStart], first: Frames) -> Finding | None:
    """Return the mix-up without which the players fit the first images clearly better; None without a sign of one.

    Nothing is tried where three cameras or more all show the players; of two, none could be told from the other.
    """
    with_legs = [start for start in starts if start.has_legs]
    named = _fit(with_legs, first)
    shown = [i for i, view in enumerate(first.views) if view is not None]
    is_shown = all(count_unoccluded(fit.colours.occlusion, shown) == len(shown) for fit in named)
    if not named or len(shown) < 2 or (is_shown and len(shown) > 2):
        return None
    nats, names = max(_nats(named), 1.0), [view.camera.name if view else "" for view in first.views]
    best, most = None, _MORE
    for mix_up in possible_mix_ups(len(names)):
        right = mix_up.undo(first)
        fits = [] if right is None else _fit(with_legs, right)
        if fits and np.mean([evidence_per_px(fit.fit.owned) for fit in fits]) > LEAST_EVIDENCE:
            best, most = max((best, most), (mix_up, _nats(fits) / nats), key=lambda each: each[1])
    if best is None:
        return None
    times = f"{most:.1f}" if most < _MANY else "many"
    what = f"with {best.describe(names)}, the players at the start fit them {times} times as well"
    return best.finding(names, what)


def _fit(starts: Sequence[PlayerStart], frames: Frames) -> list[FirstFrameFit]:
    """Fit the players; empty where an image shows none of somebody."""
    try:
        return fit_starts(starts, [start_state(start.name, start.joints_m) for start in starts], frames)
    except TrialError:
        return []


def _nats(fits: Sequence[FirstFrameFit]) -> float:
    return sum(fit.fit.total for fit in fits)
