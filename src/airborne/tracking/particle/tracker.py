"""The tracker of several players' legs: torsos first, then a particle filter for each player."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.body.legs import LEG_POINTS, Legs
from airborne.cameras import Rig
from airborne.tracking.estimate import Status
from airborne.tracking.particle.image_regions import LEARNING_MARGIN_M, centre_of, in_picture, regions_of
from airborne.tracking.particle.jump_state import FRAMES, share_above, vertical_speed
from airborne.tracking.particle.observations import Look, look_at
from airborne.tracking.particle.occlusion import covered_share
from airborne.tracking.particle.parts import N_PARTS, PARTS, ends_of
from airborne.tracking.particle.references import References, learn
from airborne.tracking.particle.settings import LegsSettings
from airborne.tracking.particle.situation import Filter, Found, Situation
from airborne.tracking.particle.torso import TorsoInput
from airborne.tracking.players import PlayerEstimate, lost_player
from airborne.video import Frames

Array = NDArray[np.floating]

SET_BY_HAND_SD_M = 0.015  # of the points in the first frame
UNCERTAIN_SD_M = 0.10  # a joint less certain than this is not claimed to be known
UNCERTAIN_SHARE = 0.25  # of a part's samples that must look like it in a typical camera
AIRBORNE_M = 0.08  # both ankles this far above their first places
HIDDEN_SHARE = 0.5  # of a part, from which on `views = "visible"` leaves the camera out
_RAYS = 7  # points along a part that may be hidden


@dataclass(frozen=True, slots=True, eq=False)
class LegsPlayer:
    """A player with legs, as set by hand in the first frame."""

    name: str
    at: int  # which of the torsos is theirs
    legs: Legs
    points: Array  # (6, 3), as LEG_POINTS


class PlayerState(NamedTuple):
    """What the next frame needs of one player."""

    references: References | None  # None until a camera has shown the player
    belief: Any
    points: Array  # (6, 3) the last estimate


class LegsState(NamedTuple):
    """What the next frame needs."""

    torso: Any
    times_s: tuple[float, ...]  # of the last frames
    torsos: tuple[Array, ...]  # (all players, 3) at each of them
    players: tuple[PlayerState, ...]


@dataclass(frozen=True, slots=True, eq=False)
class LegsTracker:
    """Tracks the legs of all players that have any; a `PlayersTracker`.

    The colours are learned in the first frame that shows a player, where the estimate is the start itself. Covariances
    are the particles' spread about the estimate: they leave out what all particles share, such as references learned
    while somebody stood in front, and the pull of the last estimate. Where legs are hidden errors are several times
    larger.
    """

    settings: LegsSettings
    rig: Rig
    torso: TorsoInput
    players: tuple[LegsPlayer, ...]
    filter: Filter

    @property
    def joints(self) -> tuple[str, ...]:
        """Hips, knees and ankles."""
        return LEG_POINTS

    def init(self) -> LegsState:
        """Return the state before the first frame."""
        players = tuple(PlayerState(None, self.filter.begin(p.points), p.points) for p in self.players)
        return LegsState(self.torso.init(), (), (), players)

    def step(self, state: LegsState, frames: Frames) -> tuple[LegsState, tuple[PlayerEstimate, ...]]:
        """Track one time: the torsos, then each player."""
        torso_state, now = self.torso.step(state.torso, frames)
        times_s = (*state.times_s, float(frames.time_s))[-FRAMES:]
        torsos = (*state.torsos, now)[-FRAMES:]
        past = np.array(times_s), np.array(torsos)
        done = [self._step_player(i, player, frames, *past) for i, player in enumerate(state.players)]
        players, estimates = tuple(player for player, _ in done), tuple(estimate for _, estimate in done)
        return LegsState(torso_state, times_s, torsos, players), estimates

    def _step_player(
        self, i: int, state: PlayerState, frames: Frames, times_s: Array, torsos: Array
    ) -> tuple[PlayerState, PlayerEstimate]:
        if state.references is None:
            return self._learned(i, state, frames, torsos[-1])
        player, settings = self.players[i], self.settings
        now = self._situation(player, state, times_s, torsos)
        rng = np.random.default_rng((settings.seed, frames.index, player.at))
        belief = self.filter.move(rng, state.belief, now)
        used = self._used(frames, state.points + now.torso - now.torso_before, now.others)
        regions = regions_of(frames, self.filter.cloud(belief))
        look = look_at(
            state.references,
            regions,
            used,
            tempered=settings.tempered,
            may_be_hidden=settings.views == "robust",
        )
        if not look.n_views:
            return state._replace(belief=belief), lost_player(player.name, frames, len(LEG_POINTS))
        belief, found = self.filter.weigh(belief, look, now)
        estimate = _estimate(player.name, frames, found, look)
        return PlayerState(state.references, belief, found.points), estimate

    def _situation(self, player: LegsPlayer, state: PlayerState, times_s: Array, torsos: Array) -> Situation:
        torso, before = torsos[-1, player.at], torsos[-2, player.at]
        speed_m_s = vertical_speed(times_s, torsos[:, player.at, 2])
        return Situation(
            legs=player.legs,
            previous=state.points,
            torso=torso,
            torso_before=before,
            shift=torso - before if self.settings.torso_shift else np.zeros(3),
            others=np.delete(torsos[-1], player.at, axis=0),
            dt_s=float(times_s[-1] - times_s[-2]),
            share_above=share_above(speed_m_s),
            is_airborne=bool(np.all(state.points[4:6, 2] > player.points[4:6, 2] + AIRBORNE_M)),
        )

    def _used(self, frames: Frames, points: Array, others: Array) -> NDArray[np.bool_]:
        """Say which cameras count for which part of a player whose points (6, 3) are about here: (parts, views)."""
        used = np.repeat(in_picture(frames, points)[None], N_PARTS, axis=0)
        if self.settings.views == "visible" and len(others):
            ends = ends_of(points[None])[0]
            along = np.linspace(0, 1, _RAYS)[:, None]
            rods = ends[:, 0, None] + along * (ends[:, 1] - ends[:, 0])[:, None]
            covered = [covered_share(rods, centre_of(camera), others) for camera in self.rig]
            used &= np.stack(covered, axis=-1) <= HIDDEN_SHARE
        return used

    def _learned(self, i: int, state: PlayerState, frames: Frames, torsos: Array) -> tuple[PlayerState, PlayerEstimate]:
        player = self.players[i]
        points, ends = player.points, ends_of(player.points[None])[0]
        used = self._used(frames, points, np.delete(torsos, player.at, axis=0))
        in_view = in_picture(frames, points)
        regions = [
            region if in_view[v] else None for v, region in enumerate(regions_of(frames, points, LEARNING_MARGIN_M))
        ]
        if all(region is None for region in regions):
            return state, lost_player(player.name, frames, len(LEG_POINTS))
        references = learn(regions, ends, PARTS, used=used)
        found = Found(points, np.tile(SET_BY_HAND_SD_M**2 * np.eye(3), (len(points), 1, 1)))
        look = look_at(references, regions, used if used.any() else np.broadcast_to(in_view, used.shape))
        return state._replace(references=references), _estimate(player.name, frames, found, look)


def _estimate(name: str, frames: Frames, found: Found, look: Look) -> PlayerEstimate:
    parts = look.log_likelihood(ends_of(found.points[None]), range(N_PARTS))[0]
    score = float(parts.mean())
    sd_m = np.sqrt(np.trace(found.covariance, axis1=-2, axis2=-1))
    least = look.n_views * np.log(UNCERTAIN_SHARE)
    is_sure = score > least and sd_m.max() < UNCERTAIN_SD_M and look.n_views > 1
    return PlayerEstimate(
        player=name,
        index=frames.index,
        time_s=frames.time_s,
        status=Status.TRACKED if is_sure else Status.UNCERTAIN,
        points=found.points,
        covariance=found.covariance,
        score=score,
        n_views=look.n_views,
    )
