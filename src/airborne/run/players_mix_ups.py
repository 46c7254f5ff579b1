"""Mix-ups of the videos of players, before they are tracked: files exchanged, mirrored images.

Where a camera does not show the players at the start, they are fitted to the first images once more: with those of two
cameras exchanged, and with those of one mirrored. Their colours and edges tell more than what moves, which may be
little before a jump.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from itertools import combinations

import numpy as np

from airborne.cameras.finding import Finding
from airborne.errors import MistakesError, TrialError
from airborne.run.mix_ups import exchange_finding, mirror_finding
from airborne.tracking.capsules.bystanders import LEAST_EVIDENCE
from airborne.tracking.capsules.first_frame import FirstFrameFit, start_state
from airborne.tracking.capsules.occlusion import count_unoccluded
from airborne.tracking.capsules.track import evidence_per_px
from airborne.tracking.capsules.tracker import fit_starts
from airborne.tracking.players import PlayerStart
from airborne.video import Frames, Recording, View

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
    nats = max(_nats(named), 1.0)
    findings: list[tuple[float, Finding]] = []
    for mixed, finding in _mix_ups(first):
        fits = _fit(with_legs, mixed)
        if fits and np.mean([evidence_per_px(fit.fit.owned) for fit in fits]) > LEAST_EVIDENCE:
            findings.append((_nats(fits) / nats, finding))
    times, best = max(findings, key=lambda each: each[0], default=(0.0, None))
    if best is None or times < _MORE:
        return None
    return replace(best, what=f"{best.what} {f'{times:.1f}' if times < _MANY else 'many'} times as well")


def _mix_ups(first: Frames) -> Iterator[tuple[Frames, Finding]]:
    """Yield the first images as they would be without each mix-up, and what would be said of it."""
    views = {i: view for i, view in enumerate(first.views) if view is not None}
    fit = "the players at the start fit them"
    for (i, a), (j, b) in combinations(views.items(), 2):
        if a.camera.size == b.camera.size:
            names = a.camera.name, b.camera.name
            yield (
                _with_views(first, {i: replace(a, image=b.rgb), j: replace(b, image=a.rgb)}),
                exchange_finding(*names, f"with the images of {' and '.join(names)} exchanged, {fit}"),
            )
    for i, view in views.items():
        name, image = view.camera.name, np.ascontiguousarray(view.rgb[:, ::-1])
        yield (
            _with_views(first, {i: replace(view, image=image)}),
            mirror_finding(name, f"with the images of {name} mirrored, {fit}"),
        )


def _with_views(frames: Frames, views: dict[int, View]) -> Frames:
    return replace(frames, views=tuple(views.get(i, view) for i, view in enumerate(frames.views)))


def _fit(starts: Sequence[PlayerStart], frames: Frames) -> list[FirstFrameFit]:
    """Fit the players; empty where an image shows none of somebody."""
    try:
        return fit_starts(starts, [start_state(start.name, start.joints_m) for start in starts], frames)
    except TrialError:
        return []


def _nats(fits: Sequence[FirstFrameFit]) -> float:
    return sum(fit.fit.total for fit in fits)
