"""The tracker of several players' legs: torsos first, then a particle filter for each player."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.body.legs import LEG_POINTS, Legs
from airborne.cameras import Rig
from airborne.tracking.estimate import Status
from airborne.tracking.particle.image_regions import LEARNING_MARGIN_M, centre_of, is_in_image, regions_of
from airborne.tracking.particle.jump_state import SPEED_FRAMES, share_above, vertical_speed
from airborne.tracking.particle.observations import LegsObservation, observe
from airborne.tracking.particle.occlusion import occlusion_share
from airborne.tracking.particle.parts import N_PARTS, PARTS, ends_of
from airborne.tracking.particle.references import References, learn_references
from airborne.tracking.particle.settings import LegsSettings
from airborne.tracking.particle.situation import Filter, LegsEstimate, Situation
from airborne.tracking.particle.torso import TorsoInput
from airborne.tracking.players import PlayerEstimate, lost_player_estimate
from airborne.types import Array
from airborne.video import Frames

_HAND_SET_SD_M = 0.015  # of the points in the first frame
UNCERTAIN_SD_M = 0.10 / 3**0.5  # RMS over the axes; a joint less certain than this makes the estimate uncertain
_UNCERTAIN_SHARE = 0.25  # of a part's samples that must match it in a typical camera
_AIRBORNE_M = 0.08  # both ankles this far above their first positions
_OCCLUDED_SHARE = 0.5  # of a part, above which `views = "visible"` leaves the camera out
_N_RAYS = 7  # points along a part that are tested for occlusion


@dataclass(frozen=True, slots=True, eq=False)
class LegsPlayer:
    """A player with legs, as set by hand in the first frame."""

    name: str
    torso_index: int  # row of the player's torso
    legs: Legs
    points: Array  # (6, 3), as LEG_POINTS


class PlayerState(NamedTuple):
    """What the next frame needs of one player."""

    references: References | None  # None until a camera has shown the player
    particles: Any
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

    The colours are learned in the first frame that shows a player; the estimate there is the start itself. Covariances
    are the particles' second moments about the estimate: they leave out errors that all particles share, such as
    references learned under occlusion, and the bias towards the last estimate. Where legs are occluded, errors are
    several times larger.
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
        players = tuple(PlayerState(None, self.filter.init(p.points), p.points) for p in self.players)
        return LegsState(self.torso.init(), (), (), players)

    def step(self, state: LegsState, frames: Frames) -> tuple[LegsState, tuple[PlayerEstimate, ...]]:
        """Track one time: the torsos, then each player."""
        torso_state, now = self.torso.step(state.torso, frames)
        times_s = (*state.times_s, float(frames.time_s))[-SPEED_FRAMES:]
        torsos = (*state.torsos, now)[-SPEED_FRAMES:]
        history = {"times_s": np.array(times_s), "torsos": np.array(torsos)}
        results = [self._step_player(i, player, frames, **history) for i, player in enumerate(state.players)]
        players, estimates = tuple(player for player, _ in results), tuple(estimate for _, estimate in results)
        return LegsState(torso_state, times_s, torsos, players), estimates

    def _step_player(
        self, i: int, state: PlayerState, frames: Frames, *, times_s: Array, torsos: Array
    ) -> tuple[PlayerState, PlayerEstimate]:
        if state.references is None:
            return self._learn(i, state, frames, torsos[-1])
        player, settings = self.players[i], self.settings
        now = self._situation(player, state, times_s, torsos)
        rng = np.random.default_rng((settings.seed, frames.index, player.torso_index))
        particles = self.filter.predict(rng, state.particles, now)
        used = self._usable_views(frames, state.points + now.torso - now.torso_before, now.others)
        regions = regions_of(frames, self.filter.all_points(particles))
        observation = observe(
            state.references,
            regions,
            used,
            tempered=settings.tempered,
            is_robust=settings.views == "robust",
        )
        if not observation.n_views:
            return state._replace(particles=particles), lost_player_estimate(player.name, frames, len(LEG_POINTS))
        particles, legs = self.filter.update(particles, observation, now)
        estimate = _estimate(player.name, frames, legs, observation)
        return PlayerState(state.references, particles, legs.points), estimate

    def _situation(self, player: LegsPlayer, state: PlayerState, times_s: Array, torsos: Array) -> Situation:
        torso, before = torsos[-1, player.torso_index], torsos[-2, player.torso_index]
        speed_m_s = vertical_speed(times_s, torsos[:, player.torso_index, 2])
        return Situation(
            legs=player.legs,
            previous=state.points,
            torso=torso,
            torso_before=before,
            shift=torso - before if self.settings.torso_shift else np.zeros(3),
            others=np.delete(torsos[-1], player.torso_index, axis=0),
            dt_s=float(times_s[-1] - times_s[-2]),
            share_above=share_above(speed_m_s),
            is_airborne=bool(np.all(state.points[4:6, 2] > player.points[4:6, 2] + _AIRBORNE_M)),
        )

    def _usable_views(self, frames: Frames, points: Array, others: Array) -> NDArray[np.bool_]:
        """Return which cameras count for which part of a player near points (6, 3): (parts, views)."""
        used = np.repeat(is_in_image(frames, points)[None], N_PARTS, axis=0)
        if self.settings.views == "visible" and len(others):
            ends = ends_of(points[None])[0]
            along = np.linspace(0, 1, _N_RAYS)[:, None]
            rods = ends[:, 0, None] + along * (ends[:, 1] - ends[:, 0])[:, None]
            occluded = [occlusion_share(rods, centre_of(camera), others) for camera in self.rig]
            used &= np.stack(occluded, axis=-1) <= _OCCLUDED_SHARE
        return used

    def _learn(self, i: int, state: PlayerState, frames: Frames, torsos: Array) -> tuple[PlayerState, PlayerEstimate]:
        player = self.players[i]
        points, ends = player.points, ends_of(player.points[None])[0]
        used = self._usable_views(frames, points, np.delete(torsos, player.torso_index, axis=0))
        in_view = is_in_image(frames, points)
        regions = [
            region if in_view[v] else None for v, region in enumerate(regions_of(frames, points, LEARNING_MARGIN_M))
        ]
        if all(region is None for region in regions):
            return state, lost_player_estimate(player.name, frames, len(LEG_POINTS))
        references = learn_references(regions, ends, PARTS, used=used)
        legs = LegsEstimate(points, np.tile(_HAND_SET_SD_M**2 * np.eye(3), (len(points), 1, 1)))
        observation = observe(references, regions, used if used.any() else np.broadcast_to(in_view, used.shape))
        return state._replace(references=references), _estimate(player.name, frames, legs, observation)


def _estimate(name: str, frames: Frames, legs: LegsEstimate, observation: LegsObservation) -> PlayerEstimate:
    parts = observation.log_likelihood(ends_of(legs.points[None]), range(N_PARTS))[0]
    score = float(parts.mean())
    sd_m = np.sqrt(np.trace(legs.covariance, axis1=-2, axis2=-1) / 3)
    least = observation.n_views * np.log(_UNCERTAIN_SHARE)
    is_certain = score > least and sd_m.max() < UNCERTAIN_SD_M and observation.n_views > 1
    return PlayerEstimate(
        player=name,
        index=frames.index,
        time_s=frames.time_s,
        joint_status=(Status.TRACKED if is_certain else Status.UNCERTAIN,) * len(LEG_POINTS),
        points=legs.points,
        covariance=legs.covariance,
        score=score,
        n_views=observation.n_views,
    )
