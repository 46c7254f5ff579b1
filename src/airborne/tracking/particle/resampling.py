"""Resampling: log-weights of particles in, indices of the survivors out.

Every scheme is `(rng, log_weights, n) -> index (n,)`, ascending, and draws particle i on average n w_i times.
Uninformative weights (all -inf, or NaN) count as equal.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from airborne.types import Array

Scheme = Literal["systematic", "stratified", "residual", "multinomial"]
Resampler = Callable[[np.random.Generator, Array, int], NDArray[np.intp]]


def normalise(log_weights: Array) -> Array:
    """Normalise weights to sum 1: return log-weights (n,). NaN counts as -inf; weights all zero become equal."""
    log_weights = np.where(np.isnan(log_weights), -np.inf, log_weights)
    most = log_weights.max()
    if not np.isfinite(most):
        if most == np.inf:
            return normalise(np.where(log_weights == np.inf, 0.0, -np.inf))
        return np.full(len(log_weights), -np.log(len(log_weights)))
    return log_weights - float(most + np.log(np.sum(np.exp(log_weights - most))))


def effective_sample_size(log_weights: Array) -> float:
    """Return 1 / sum w²; n for uninformative weights."""
    return float(1 / np.sum(np.exp(2 * normalise(log_weights))))


def multinomial(rng: np.random.Generator, log_weights: Array, n: int) -> NDArray[np.intp]:
    """Draw n times independently."""
    return _invert(np.sort(rng.random(n)), log_weights)


def stratified(rng: np.random.Generator, log_weights: Array, n: int) -> NDArray[np.intp]:
    """Draw once in each of n equal strata."""
    return _invert((np.arange(n) + rng.random(n)) / n, log_weights)


def systematic(rng: np.random.Generator, log_weights: Array, n: int) -> NDArray[np.intp]:
    """Draw at n equal spacings from one random offset."""
    return _invert((np.arange(n) + rng.random()) / n, log_weights)


def residual(rng: np.random.Generator, log_weights: Array, n: int) -> NDArray[np.intp]:
    """Take floor(n w) copies of each particle, and draw the rest from the remainders."""
    shares = n * np.exp(normalise(log_weights))
    copies = np.floor(shares + 1e-9).astype(int)  # a share of 3 - 1e-16 is 3
    copied = np.repeat(np.arange(len(shares)), copies)
    missing = n - len(copied)
    if missing <= 0:
        return copied[:n]
    with np.errstate(divide="ignore"):
        log_remainders = np.log(np.maximum(shares - copies, 0.0))
    return np.sort(np.concatenate([copied, multinomial(rng, log_remainders, missing)]))


SCHEMES: dict[Scheme, Resampler] = {
    "systematic": systematic,
    "stratified": stratified,
    "residual": residual,
    "multinomial": multinomial,
}


def _invert(points: Array, log_weights: Array) -> NDArray[np.intp]:
    """Invert the cumulative distribution at points (n,) of the unit interval."""
    edges = np.cumsum(np.exp(normalise(log_weights)))
    edges /= edges[-1]
    last = np.searchsorted(edges, edges[-1])  # the last particle that has a weight
    return np.minimum(np.searchsorted(edges, points, side="right"), last)
