"""The input and the output of one player's filter at one time, and what filters share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from airborne.body.legs import Legs
from airborne.tracking.particle.bootstrap import Particles
from airborne.tracking.particle.observations import LegsObservation
from airborne.tracking.particle.settings import EstimateAs
from airborne.types import Array

_MAX_SPEED_M_S = {"hips": 3.5, "knees": 4.5, "ankles": 7.0}  # of a block's approach and take-off; by hand
_RANDOM_WALK_Z_SD_M = 0.05  # of the random walk, each frame
N_TOP = 10  # combinations in the mean "top10_mean"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Situation:
    """One player at one time, before the images are observed."""

    legs: Legs
    previous: Array  # (6, 3) the last estimate, as LEG_POINTS [m]
    torso: Array  # (3,)
    torso_before: Array  # (3,) at the last frame
    shift: Array  # (3,) added to all points before the random step; may be zero
    others: Array  # (k, 3) other players' torsos
    dt_s: float
    share_above: float  # of particles to draw above their reference point
    is_airborne: bool

    def max_step_m(self, joint: str) -> float:
        """Return rule far "hips", "knees" or "ankles" can move in x and y since the last frame [m]."""
        return _MAX_SPEED_M_S[joint] * self.dt_s


class LegsEstimate(NamedTuple):
    """One player's estimate at one time."""

    points: Array  # (6, 3) [m]
    covariance: Array  # (6, 3, 3) [m²], about the points


class Filter(Protocol):
    """A filter of one player's legs; its particles pass from frame to frame."""

    def init(self, points: Array) -> Any:
        """Return particles concentrated at points (6, 3)."""
        ...

    def predict(self, rng: np.random.Generator, particles: Any, now: Situation) -> Any:
        """Resample, and predict this frame's particles."""
        ...

    def all_points(self, particles: Any) -> Array:
        """Return all points of all particles (n, 3): the region of interest."""
        ...

    def update(self, particles: Any, observation: LegsObservation, now: Situation) -> tuple[Any, LegsEstimate]:
        """Reweight the particles by the observation, and estimate the points."""
        ...


def random_walk(rng: np.random.Generator, points: Array, max_step_m: Array, shift: Array) -> Array:
    """Add Gaussian steps to points (n, joints, 3): sd max_step_m / 2 (joints,) in x and y, 0.05 m in z."""
    sd = np.stack([max_step_m / 2, max_step_m / 2, np.full_like(max_step_m, _RANDOM_WALK_Z_SD_M)], axis=-1)
    return points + shift + sd * rng.standard_normal(points.shape)


def point_estimate(particles: Particles, rule: EstimateAs) -> Array:
    """Return one value (...) of particles (n, ...): the best, the mean, or the mean of the ten best."""
    if rule == "max":
        return particles.values[np.argmax(particles.log_weights)]
    if rule == "mean":
        return particles.mean
    top = np.argsort(-particles.log_weights, kind="stable")[:N_TOP]
    weights = np.exp(particles.log_weights[top] - particles.log_weights[top[0]])
    return np.asarray(np.tensordot(weights / weights.sum(), particles.values[top], 1), float)


def second_moments(values: Array, weights: Array, about: Array) -> Array:
    """Return the weighted second moments of points (n, joints, 3) about (joints, 3): (joints, 3, 3)."""
    away = values - about
    return np.einsum("n,nji,njk->jik", weights, away, away)
