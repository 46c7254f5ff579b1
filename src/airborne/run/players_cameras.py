"""Cameras of players that are wrong: in their times, by what each alone says of the players, or altogether."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence

import numpy as np

from airborne.constants import ALARM_SDS
from airborne.geometry.even_sample import EvenSample
from airborne.tracking import Status
from airborne.tracking.camera_lags import solve_lags
from airborne.tracking.capsules.camera_evidence import LagMoment, lag_equations, moment_of
from airborne.tracking.capsules.occlusion import shows_player
from airborne.tracking.players import PlayersStep
from airborne.video import Frames

_MOST_MOMENTS, _FEWEST_TIMES = 100, 20  # chosen: of a player that are kept; of all that say something
_EVERY = 2  # chosen, frames apart: neighbours err alike, and a moment costs a tenth of a frame's tracking
# chosen: share of the times in which a camera shows the players as the others see them; in ten synthetic recordings
# with three cameras 0.6 or more, of one turned by half a degree or more 0 to 0.34
_HARDLY, _MOSTLY = 0.15, 0.5
_LEAST_S = 0.003  # chosen: a body at 10 m/s moves 3 cm, as much as a joint is off


class _Shifted:
    """When a camera, or one of several, was shifted, and how far at some of these times."""

    def __init__(self, first_s: float) -> None:
        self.first_s, self.last_s, self.n_times = first_s, first_s, 0
        self.suspects: Counter[int] = Counter()
        self.right_down_px: EvenSample[tuple[float, float]] = EvenSample(_MOST_MOMENTS)

    def add(self, time_s: float, suspects: Sequence[int | None], right_down_px: tuple[float, float]) -> None:
        """Keep a time, in their order."""
        self.last_s, self.n_times = time_s, self.n_times + 1
        self.suspects.update(view for view in suspects if view is not None)
        self.right_down_px.offer(lambda: right_down_px)

    def describe(self, names: Sequence[str], n_times: int) -> str:
        """Say it of a run of so many times."""
        when = f"from {self.first_s:.2f} to {self.last_s:.2f} s, in {self.n_times} of {n_times} frames"
        who = [names[view] for view, _ in self.suspects.most_common()]
        if len(who) > 1:
            return (
                f"self-check: the cameras disagree where the players are {when}: {', '.join(who[:-1])} or {who[-1]} "
                "was moved, or calibrated wrongly; joints are uncertain there; leave out each (--cameras) and compare"
            )
        right, down = np.median([*self.right_down_px], axis=0).tolist()
        ways = (abs(right), "right of" if right > 0 else "left of"), (abs(down), "below" if down > 0 else "above")
        where = " and ".join(f"{px:.0f} px {way}" for px, way in ways if px >= 0.5)
        return (
            f"self-check: {who[0]} shows the players {where} where the other cameras see them {when}, and is left out "
            "there: was it moved, or is its calibration another's?"
        )


class CameraCheck:
    """What cameras say of the players at some moments of a run, spread evenly over it, and how often they show them."""

    def __init__(self) -> None:
        self._moments: defaultdict[str, EvenSample[LagMoment]] = defaultdict(lambda: EvenSample(_MOST_MOMENTS))
        self._n_times = 0
        self._n_found: Counter[int] = Counter()  # by camera: players found while it had an image
        self._n_shown: Counter[int] = Counter()  # and those of them that it shows
        self._shifted: dict[int | None, _Shifted] = {}  # by camera; None: where it is open which one

    def add(self, frames: Frames, step: PlayersStep) -> None:
        """Keep a time of the tracker `Blocker`, or not."""
        self._n_times += 1
        registration, time_s = step.state.registration, float(frames.time_s)
        shift = registration.shift
        if shift is not None and shift.right_down_px is not None:
            self._shifted.setdefault(registration.left_out, _Shifted(time_s)).add(
                time_s, (shift.view, shift.or_view), shift.right_down_px
            )
        found = [each for each in step.players if each.status is not Status.LOST]
        for each in found:
            is_shown = shows_player(step.state.players[each.player].colours.occlusion)
            seeing = [i for i, view in enumerate(frames.views) if view is not None]
            self._n_found.update(seeing)
            self._n_shown.update(i for i in seeing if is_shown[i] and i != registration.left_out)
        for each in found if self._n_times % _EVERY == 0 else ():
            self._moments[each.player].offer(lambda name=each.player: moment_of(step.state, name, frames))

    def describe(self, names: Sequence[str]) -> list[str]:
        """Say which cameras are wrong; `names` are the rig's, whose first one is the clock.

        Of times nothing is said where a camera hardly agrees with the others: it moves what these are compared with.
        One that is late shows the players elsewhere too, where they move.
        """
        clear = [each.describe(names, self._n_times) for view, each in self._shifted.items() if view is not None]
        unclear = [self._shifted[None].describe(names, self._n_times)] if None in self._shifted else []
        if hidden := self._describe_shown(names):
            return clear or [*hidden, *unclear]
        return self._describe_times(names) or clear or unclear

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
        is_off = np.abs(np.nan_to_num(lag_s)) > np.maximum(ALARM_SDS * np.nan_to_num(sd_s), _LEAST_S)
        if n > 2 and is_off[1:].all() and len(set(np.sign(lag_s[1:]))) == 1:  # all but the clock agree
            lag_s, is_off = np.array([-lag_s[1:].mean(), *[0.0] * (n - 1)]), np.arange(n) == 0
        return [
            f"self-check: {name} shows the players {'later' if lag > 0 else 'earlier'} than its times say; by how much "
            "is not known here: run `airborne sync`, then track again"
            for name, lag, off in zip(names, lag_s, is_off, strict=True)
            if off
        ]
