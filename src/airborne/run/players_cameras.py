"""Cameras of players that are wrong: in their times, by what each alone says of the players, or altogether."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence

import numpy as np

from airborne.geometry.even_sample import EvenSample
from airborne.tracking import Status
from airborne.tracking.camera_lags import solve_lags
from airborne.tracking.capsules.camera_evidence import Moment, lag_equations, moment_of
from airborne.tracking.capsules.occlusion import shows_player
from airborne.tracking.players import PlayersStep
from airborne.video import Frames

_MOST_MOMENTS, _FEWEST_TIMES = 100, 20  # chosen: of a player that are kept; of all that say something
_EVERY = 2  # chosen, frames apart: neighbours err alike, and a moment costs a tenth of a frame's tracking
_ALARM_SDS = 3.0  # chosen: as of a body, one in 370 right cameras is accused
# chosen: share of the times in which a camera shows the players as the others see them; in ten synthetic recordings
# with three cameras 0.6 or more, of one turned by half a degree or more 0 to 0.34
_HARDLY, _MOSTLY = 0.15, 0.5
_LEAST_S = 0.003  # chosen: a body at 10 m/s moves 3 cm, as much as a joint is off


class CameraCheck:
    """What cameras say of the players at some moments of a run, spread evenly over it, and how often they show them."""

    def __init__(self) -> None:
        self._moments: defaultdict[str, EvenSample[Moment]] = defaultdict(lambda: EvenSample(_MOST_MOMENTS))
        self._n_times = 0
        self._n_found: Counter[int] = Counter()  # by camera: players found while it had an image
        self._n_shown: Counter[int] = Counter()  # and those of them that it shows

    def add(self, frames: Frames, step: PlayersStep) -> None:
        """Keep a time of the tracker `Blocker`, or not."""
        self._n_times += 1
        found = [each for each in step.players if each.status is not Status.LOST]
        for each in found:
            is_shown = shows_player(step.state.players[each.player].colours.occlusion)
            seeing = [i for i, view in enumerate(frames.views) if view is not None]
            self._n_found.update(seeing)
            self._n_shown.update(i for i in seeing if is_shown[i])
        for each in found if self._n_times % _EVERY == 0 else ():
            self._moments[each.player].offer(lambda name=each.player: moment_of(step.state, name, frames))

    def describe(self, names: Sequence[str]) -> list[str]:
        """Say which cameras are wrong; `names` are the rig's, whose first one is the clock.

        Of times nothing is said where a camera hardly agrees with the others: it moves what these are compared with.
        """
        return self._describe_shown(names) or self._describe_times(names)

    def _describe_shown(self, names: Sequence[str]) -> list[str]:
        shares = {names[i]: self._n_shown[i] / n for i, n in sorted(self._n_found.items())}
        others = sum(share > _MOSTLY for share in shares.values())
        return [
            f"self-check: {name} shows the players where the other cameras see them in {share:.0%} of the frames: was "
            "it moved, is its calibration another's, or does somebody stand before it?"
            for name, share in shares.items()
            if share < _HARDLY and others >= 2
        ]

    def _describe_times(self, names: Sequence[str]) -> list[str]:
        moments = [moment for each in self._moments.values() for moment in each]
        n = len(names)
        if len({moment.time_s for moment in moments}) < _FEWEST_TIMES or n < 2:
            return []
        lag_s, sd_s = (each[:n] for each in solve_lags(lag_equations(moments)))
        is_off = np.abs(np.nan_to_num(lag_s)) > np.maximum(_ALARM_SDS * np.nan_to_num(sd_s), _LEAST_S)
        if n > 2 and is_off[1:].all() and len(set(np.sign(lag_s[1:]))) == 1:  # all but the clock agree
            lag_s, is_off = np.array([-lag_s[1:].mean(), *[0.0] * (n - 1)]), np.arange(n) == 0
        return [
            f"self-check: {name} shows the players {'later' if lag > 0 else 'earlier'} than its times say; by how much "
            "is not known here: run `airborne sync`, then track again"
            for name, lag, off in zip(names, lag_s, is_off, strict=True)
            if off
        ]
