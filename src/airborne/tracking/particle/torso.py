"""Places of the players' torsos, which the filters of legs start from: tracked in the pictures, or given.

A reading of Huang et al. 2016, the block-jump paper's reference 1, of which only the title's ideas are known: particles
about a least-squares prediction, an HSV histogram of an upright window, views dropped where another player is in front.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from airborne.cameras import Rig
from airborne.errors import TrialError
from airborne.tracking.particle.bootstrap import equal, weighed
from airborne.tracking.particle.image_regions import LEARNING_MARGIN_M, centre_of, in_picture, regions_of
from airborne.tracking.particle.observations import look_at
from airborne.tracking.particle.occlusion import is_torso_hidden
from airborne.tracking.particle.references import Parts, References, learn
from airborne.tracking.particle.view_likelihood import detection
from airborne.tracking.players import PlayerStart
from airborne.video import Frames

Array = NDArray[np.floating]

N_PARTICLES = 200
SPREAD_M = np.array([0.04, 0.04, 0.06])  # of the particles about the prediction
WINDOW_M = (0.45, 0.65)  # width and height of the upright window
MEMORY = 6  # frames that the prediction fits
INNER = 0.5  # of the window's width and height: where the references are learned, as there is surely torso
_STREAM = 1  # tells the torsos' random numbers from the legs'


class TorsoInput(Protocol):
    """Gives every player's torso at every time, in the order of the starts."""

    def init(self) -> Any:
        """Return the state before the first frame."""
        ...

    def step(self, state: Any, frames: Frames) -> tuple[Any, Array]:
        """Return the next state and the torsos (players, 3) [m]; always finite."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class GivenTorsos:
    """Torsos from elsewhere: positions (frames, players, 3) [m], the first for the frame of index `first`.

    Where one is NaN or past the end, the last that was known holds.
    """

    positions: Array
    first: int = 0

    def __post_init__(self) -> None:
        shape = np.shape(self.positions)
        if len(shape) != 3 or shape[2] != 3 or not shape[0] or not np.isfinite(self.positions[0]).all():
            raise TrialError(
                f"given torsos are (frames, players, 3), found {shape}; all must be known in the first frame"
            )

    def init(self) -> Array:
        """Return the first torsos (players, 3)."""
        return np.asarray(self.positions[0], float)

    def step(self, state: Array, frames: Frames) -> tuple[Array, Array]:
        """Return the torsos of this frame, also as the state."""
        at = min(max(frames.index - self.first, 0), len(self.positions) - 1)
        known = np.where(np.isfinite(self.positions[at]).all(axis=-1, keepdims=True), self.positions[at], state)
        return known, known


class TorsoState(NamedTuple):
    """What the next frame needs to know."""

    times_s: Array  # (k,) of the last frames
    torsos: Array  # (k, players, 3)
    unseen: NDArray[np.int64]  # (players,) frames since the torso was looked at
    references: tuple[References | None, ...]  # a player's, once learned


@dataclass(frozen=True, slots=True, eq=False)
class TorsoTracker:
    """Follows the torsos of all players and bystanders together, from where they were set by hand.

    The prediction is a line through the last six estimates. A parabola (`degree=2`) feeds on its own errors: where the
    pictures correct it by less than 40 % a frame, its characteristic roots lie outside the unit circle, up to 1.08 a
    frame; those of the line lie inside at every correction. Gravity costs the line 13 mm at 60 frames a second.
    """

    rig: Rig
    starts: tuple[Array, ...]  # (3,) each
    seed: int = 0
    degree: int = 1  # of the fit through the last places

    def init(self) -> TorsoState:
        """Return the state before the first frame."""
        n = len(self.starts)
        return TorsoState(np.zeros(0), np.zeros((0, n, 3)), np.zeros(n, int), (None,) * n)

    def step(self, state: TorsoState, frames: Frames) -> tuple[TorsoState, Array]:
        """Return the next state and the torsos (players, 3) [m].

        A torso that no camera shows goes on as predicted, and after as many frames as the fit remembers it stays.
        """
        time_s = float(frames.time_s)
        predicted = np.array(self.starts) if not len(state.times_s) else self._predicted(state, time_s)
        torsos, unseen, references = predicted.copy(), state.unseen.copy(), list(state.references)
        for i, place in enumerate(predicted):
            known = references[i]
            if known is None:
                references[i] = self._learn(frames, predicted, i)
                continue
            found = self._found(frames, predicted, i, known)
            unseen[i] = 0 if found is not None else unseen[i] + 1
            torsos[i] = place if found is None else found
        state = TorsoState(
            np.append(state.times_s, time_s)[-MEMORY:],
            np.concatenate([state.torsos, torsos[None]])[-MEMORY:],
            unseen,
            tuple(references),
        )
        return state, torsos

    def _predicted(self, state: TorsoState, time_s: float) -> Array:
        torsos = predicted(state.times_s, state.torsos, time_s, self.degree)
        stays = (state.unseen >= MEMORY) | np.array([known is None for known in state.references])
        return np.where(stays[:, None], state.torsos[-1], torsos)

    def _learn(self, frames: Frames, torsos: Array, i: int) -> References | None:
        ends = _window(torsos[i : i + 1], INNER)[0]
        regions = regions_of(frames, ends[0], LEARNING_MARGIN_M)
        if all(region is None for region in regions):
            return None
        references = learn(regions, ends, _parts(INNER), used=self._unhidden(torsos, i), drops_background=True)
        return replace(references, parts=_parts())

    def _found(self, frames: Frames, torsos: Array, i: int, references: References) -> Array | None:
        """Return the weighted mean of particles about the predicted torso; None where no camera shows it."""
        used = self._unhidden(torsos, i) & in_picture(frames, torsos[i : i + 1])
        if not used.any():
            return None
        rng = np.random.default_rng((self.seed, frames.index, i, _STREAM))
        values = torsos[i] + rng.normal(0, SPREAD_M, (N_PARTICLES, 3))
        look = look_at(references, regions_of(frames, _window(values).reshape(-1, 3)), used)
        if not look.used.any():
            return None
        overlap, _ = look.read(_window(values), [0])
        return weighed(equal(values), detection(overlap)[:, 0, look.used[0]].sum(axis=-1))[0].mean

    def _unhidden(self, torsos: Array, i: int) -> NDArray[np.bool_]:
        others = np.delete(torsos, i, axis=0)
        return np.array([[not is_torso_hidden(torsos[i], centre_of(camera), others) for camera in self.rig]])


def torso_tracker(rig: Rig, starts: Sequence[PlayerStart], seed: int = 0) -> TorsoTracker:
    """Make the tracker of the torsos of the starts; raises TrialError where one has no torso."""
    return TorsoTracker(rig, tuple(start_torso(start) for start in starts), seed)


def start_torso(start: PlayerStart) -> Array:
    """Return the torso (3,) of a start; raises TrialError where it has none."""
    if "torso" not in start.joints_m:
        raise TrialError(f"player '{start.name}' has no torso in the start; every player and bystander needs one")
    return np.asarray(start.joints_m["torso"], float)


def predicted(times_s: Array, torsos: Array, time_s: float, degree: int) -> Array:
    """Extrapolate torsos (k, players, 3) by a least-squares polynomial, of a lower degree while k is small."""
    k = len(times_s)
    powers = (times_s - time_s)[:, None] ** np.arange(min(degree, k // 2) + 1)
    fitted = np.linalg.lstsq(powers, torsos.reshape(k, -1), rcond=None)[0]
    return fitted[0].reshape(torsos.shape[1:])


def _window(torsos: Array, share: float = 1.0) -> Array:
    """Return the upright windows as rods: torsos (n, 3) -> (n, 1, 2, 3)."""
    half = np.array([0, 0, share * WINDOW_M[1] / 2])
    return np.stack([torsos + half, torsos - half], axis=1)[:, None]


def _parts(share: float = 1.0) -> Parts:
    return Parts(np.array([share * WINDOW_M[0]]), np.zeros(1, np.int64), ())
