"""Positions of the players' torsos, from which the filters of legs start: tracked in the images, or given.

A reading of Huang et al. 2016, the block-jump paper's reference 1, of which we know only what its title says: particles
about a least-squares prediction, an HSV histogram of an upright window, views dropped where another player occludes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from airborne.cameras import Rig
from airborne.errors import TrialError
from airborne.tracking.particle.bootstrap import reweight, uniform_particles
from airborne.tracking.particle.image_regions import LEARNING_MARGIN_M, centre_of, is_in_image, regions_of
from airborne.tracking.particle.observations import observe
from airborne.tracking.particle.occlusion import is_torso_occluded
from airborne.tracking.particle.references import Parts, References, learn_references
from airborne.tracking.particle.view_likelihood import detection
from airborne.tracking.players import PlayerStart
from airborne.types import Array
from airborne.video import Frames

_N_PARTICLES = 200  # of a torso, each frame
_PROPOSAL_SD_M = np.array([0.04, 0.04, 0.06])  # of the particles about the prediction
_WINDOW_M = (0.45, 0.65)  # width and height of the upright window
MEMORY = 6  # frames that the prediction fits
_INNER_SHARE = 0.5  # of the window's width and height: there the references are learned, as it is surely torso
_STREAM = 1  # separates the torsos' random numbers from the legs'


class TorsoInput(Protocol):
    """Supplies every player's torso at every time, in the order of the starts."""

    def init(self) -> Any:
        """Return the state before the first frame."""
        ...

    def step(self, state: Any, frames: Frames) -> tuple[Any, Array]:
        """Return the next state and the torsos (players, 3) [m]; always finite."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class GivenTorsos:
    """Torsos from elsewhere: positions (frames, players, 3) [m], the first for the frame of index `first`.

    NaN, and frames past the end, repeat the last finite position.
    """

    positions: Array
    first: int = 0

    def __post_init__(self) -> None:
        shape = np.shape(self.positions)
        if len(shape) != 3 or shape[2] != 3 or not shape[0] or not np.isfinite(self.positions[0]).all():
            raise TrialError(
                f"given torsos have shape {shape}; expected (frames, players, 3), finite in the first frame"
            )

    def init(self) -> Array:
        """Return the first torsos (players, 3)."""
        return np.asarray(self.positions[0], float)

    def step(self, state: Array, frames: Frames) -> tuple[Array, Array]:
        """Return the torsos of this frame, also as the state."""
        torsos = self.positions[min(max(frames.index - self.first, 0), len(self.positions) - 1)]
        torsos = np.where(np.isfinite(torsos).all(axis=-1, keepdims=True), torsos, state)
        return torsos, torsos


class TorsoState(NamedTuple):
    """What the next frame needs."""

    times_s: Array  # (k,) of the last frames
    torsos: Array  # (k, players, 3)
    unseen: NDArray[np.int64]  # (players,) frames since a camera last showed the torso
    references: tuple[References | None, ...]  # of each player, once learned


@dataclass(frozen=True, slots=True, eq=False)
class TorsoTracker:
    """Follows the torsos of all players and bystanders together, from their hand-set positions.

    The prediction is a line through the last six estimates. A parabola (`degree=2`) amplifies its own errors: where the
    images correct it by less than 40 % a frame, its characteristic roots lie outside the unit circle, up to 1.08 a
    frame; those of the line lie inside at every correction. Gravity costs the line 13 mm at 60 frames a second.
    """

    rig: Rig
    starts: tuple[Array, ...]  # (3,) each
    seed: int = 0
    degree: int = 1  # of the fit through the last positions

    def init(self) -> TorsoState:
        """Return the state before the first frame."""
        n = len(self.starts)
        return TorsoState(np.zeros(0), np.zeros((0, n, 3)), np.zeros(n, int), (None,) * n)

    def step(self, state: TorsoState, frames: Frames) -> tuple[TorsoState, Array]:
        """Return the next state and the torsos (players, 3) [m].

        A torso that no camera shows follows its prediction, and stops after as many frames as the fit spans.
        """
        time_s = float(frames.time_s)
        predicted = np.array(self.starts) if not len(state.times_s) else self._predict(state, time_s)
        torsos, unseen, references = predicted.copy(), state.unseen.copy(), list(state.references)
        for i, prediction in enumerate(predicted):
            own_references = references[i]
            if own_references is None:
                references[i] = self._learn(frames, predicted, i)
                continue
            estimate = self._estimate(frames, predicted, i, own_references)
            unseen[i] = 0 if estimate is not None else unseen[i] + 1
            torsos[i] = prediction if estimate is None else estimate
        state = TorsoState(
            np.append(state.times_s, time_s)[-MEMORY:],
            np.concatenate([state.torsos, torsos[None]])[-MEMORY:],
            unseen,
            tuple(references),
        )
        return state, torsos

    def _predict(self, state: TorsoState, time_s: float) -> Array:
        torsos = extrapolate(state.times_s, state.torsos, time_s, self.degree)
        stays = (state.unseen >= MEMORY) | np.array([each is None for each in state.references])
        return np.where(stays[:, None], state.torsos[-1], torsos)

    def _learn(self, frames: Frames, torsos: Array, i: int) -> References | None:
        ends = _window(torsos[i : i + 1], _INNER_SHARE)[0]
        regions = regions_of(frames, ends[0], LEARNING_MARGIN_M)
        if all(region is None for region in regions):
            return None
        references = learn_references(
            regions, ends, _parts(_INNER_SHARE), used=self._free_views(torsos, i), drops_background=True
        )
        return replace(references, parts=_parts())

    def _estimate(self, frames: Frames, torsos: Array, i: int, references: References) -> Array | None:
        """Return the weighted mean of particles about the predicted torso; None where no camera shows it."""
        used = self._free_views(torsos, i) & is_in_image(frames, torsos[i : i + 1])
        if not used.any():
            return None
        rng = np.random.default_rng((self.seed, frames.index, i, _STREAM))
        values = torsos[i] + rng.normal(0, _PROPOSAL_SD_M, (_N_PARTICLES, 3))
        observation = observe(references, regions_of(frames, _window(values).reshape(-1, 3)), used)
        if not observation.used.any():
            return None
        overlap, _ = observation.compare(_window(values), [0])
        return reweight(uniform_particles(values), detection(overlap)[:, 0, observation.used[0]].sum(axis=-1)).mean

    def _free_views(self, torsos: Array, i: int) -> NDArray[np.bool_]:
        others = np.delete(torsos, i, axis=0)
        return np.array([[not is_torso_occluded(torsos[i], centre_of(camera), others) for camera in self.rig]])


def torso_tracker(rig: Rig, starts: Sequence[PlayerStart], seed: int = 0) -> TorsoTracker:
    """Make the tracker of the torsos of the starts; raises TrialError where one has no torso."""
    return TorsoTracker(rig, tuple(start_torso(start) for start in starts), seed)


def start_torso(start: PlayerStart) -> Array:
    """Return the torso (3,) of a start; raises TrialError where it has none."""
    if "torso" not in start.joints_m:
        raise TrialError(f"player '{start.name}' has no torso in the start; every player and bystander needs one")
    return np.asarray(start.joints_m["torso"], float)


def extrapolate(times_s: Array, torsos: Array, time_s: float, degree: int) -> Array:
    """Extrapolate torsos (k, players, 3) by a least-squares polynomial, of lower degree while k is small."""
    k = len(times_s)
    powers = (times_s - time_s)[:, None] ** np.arange(min(degree, k // 2) + 1)
    coefficients = np.linalg.lstsq(powers, torsos.reshape(k, -1), rcond=None)[0]
    return coefficients[0].reshape(torsos.shape[1:])


def _window(torsos: Array, share: float = 1.0) -> Array:
    """Return the upright windows as rods: torsos (n, 3) -> (n, 1, 2, 3)."""
    half = np.array([0, 0, share * _WINDOW_M[1] / 2])
    return np.stack([torsos + half, torsos - half], axis=1)[:, None]


def _parts(share: float = 1.0) -> Parts:
    return Parts(np.array([share * _WINDOW_M[0]]), np.zeros(1, np.int64), ())
