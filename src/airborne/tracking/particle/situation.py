"""What a filter of one player's legs knows before it looks, and what it says after."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from airborne.body.legs import Legs
from airborne.tracking.particle.bootstrap import Particles
from airborne.tracking.particle.observations import Look
from airborne.tracking.particle.settings import EstimateAs

Array = NDArray[np.floating]

FASTEST_M_S = {"hips": 3.5, "knees": 4.5, "ankles": 7.0}
GAUSSIAN_Z_SD_M = 0.05  # of the random walk, each frame
TOP = 10  # combinations in the mean "top10_mean"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Situation:
    """One player at one time, before the pictures are looked at."""

    legs: Legs
    previous: Array  # (6, 3) the last estimate, as LEG_POINTS [m]
    torso: Array  # (3,)
    torso_before: Array  # (3,) at the last frame
    shift: Array  # (3,) by which everything is moved along; zero if only random steps are taken
    others: Array  # (k, 3) other players' torsos
    dt_s: float
    share_above: float  # of particles to draw above their reference
    is_airborne: bool

    def most_m(self, joint: str) -> float:
        """Return how far "hips", "knees" or "ankles" can go in x and y since the last frame [m]."""
        return FASTEST_M_S[joint] * self.dt_s


class Found(NamedTuple):
    """What one frame says of one player."""

    points: Array  # (6, 3) [m]
    covariance: Array  # (6, 3, 3) [m²], about the points


class Filter(Protocol):
    """A filter of one player's legs; what it believes goes from frame to frame."""

    def begin(self, points: Array) -> Any:
        """Return the belief that the legs are at points (6, 3)."""
        ...

    def move(self, rng: np.random.Generator, belief: Any, now: Situation) -> Any:
        """Resample, and predict this frame's particles."""
        ...

    def cloud(self, belief: Any) -> Array:
        """Return all points of all particles (n, 3): what has to be seen."""
        ...

    def weigh(self, belief: Any, look: Look, now: Situation) -> tuple[Any, Found]:
        """Weigh the particles with the pictures."""
        ...


def walk(rng: np.random.Generator, points: Array, most_m: Array, shift: Array) -> Array:
    """Move points (n, joints, 3) at random, as a Gaussian of sd most_m / 2 (joints,) in x and y and 0.05 m in z."""
    sd = np.stack([most_m / 2, most_m / 2, np.full_like(most_m, GAUSSIAN_Z_SD_M)], axis=-1)
    return points + shift + sd * rng.standard_normal(points.shape)


def chosen(particles: Particles, how: EstimateAs) -> Array:
    """Return one value (...) of particles (n, ...): the likeliest, the mean, or the mean of the ten likeliest."""
    if how == "max":
        return particles.values[np.argmax(particles.log_weights)]
    if how == "mean":
        return particles.mean
    top = np.argsort(-particles.log_weights, kind="stable")[:TOP]
    weights = np.exp(particles.log_weights[top] - particles.log_weights[top[0]])
    return np.tensordot(weights / weights.sum(), particles.values[top], 1)


def spread(values: Array, weights: Array, about: Array) -> Array:
    """Return the weighted second moments of points (n, joints, 3) about (joints, 3): (joints, 3, 3)."""
    away = values - about
    return np.einsum("n,nji,njk->jik", weights, away, away)
