"""Resampling: in come the log-weights of n particles, out come the indices of those that go on.

Every scheme is `(rng, log_weights, n) -> index (n,)`, ascending, and draws particle i n w_i times on average. Weights
that say nothing (all -inf, or NaN) count as equal.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]
Scheme = Literal["systematic", "stratified", "residual", "multinomial"]
Resample = Callable[[np.random.Generator, Array, int], NDArray[np.intp]]


def normalised(log_weights: Array) -> tuple[Array, float, bool]:
    """Scale weights to sum 1: log-weights (n,), the log of their sum, and whether they said anything at all.

    NaN counts as -inf. Where every weight is zero the weights come out equal, the log of the sum is -inf, and the
    flag is False.
    """
    log_weights = np.where(np.isnan(log_weights), -np.inf, log_weights)
    most = log_weights.max()
    if not np.isfinite(most):
        if most == np.inf:
            return normalised(np.where(log_weights == np.inf, 0.0, -np.inf))
        return np.full(len(log_weights), -np.log(len(log_weights))), -np.inf, False
    log_sum = float(most + np.log(np.sum(np.exp(log_weights - most))))
    return log_weights - log_sum, log_sum, True


def effective_sample_size(log_weights: Array) -> float:
    """Return 1 / sum w²: how many equal weights would be worth as much; n where no weight says anything."""
    return float(1 / np.sum(np.exp(2 * normalised(log_weights)[0])))


def multinomial(rng: np.random.Generator, log_weights: Array, n: int) -> NDArray[np.intp]:
    """Draw n times, each for itself."""
    return _at(np.sort(rng.random(n)), log_weights)


def stratified(rng: np.random.Generator, log_weights: Array, n: int) -> NDArray[np.intp]:
    """Draw once in each of n equal strata."""
    return _at((np.arange(n) + rng.random(n)) / n, log_weights)


def systematic(rng: np.random.Generator, log_weights: Array, n: int) -> NDArray[np.intp]:
    """Draw n times at equal distances, from one random number."""
    return _at((np.arange(n) + rng.random()) / n, log_weights)


def residual(rng: np.random.Generator, log_weights: Array, n: int) -> NDArray[np.intp]:
    """Take floor(n w) copies of each, and draw the rest from what is left over."""
    shares = n * np.exp(normalised(log_weights)[0])
    copies = np.floor(shares + 1e-9).astype(int)  # a share of 3 - 1e-16 is 3
    kept = np.repeat(np.arange(len(shares)), copies)
    missing = n - len(kept)
    if missing <= 0:
        return kept[:n]
    with np.errstate(divide="ignore"):
        left_over = np.log(np.maximum(shares - copies, 0.0))
    return np.sort(np.concatenate([kept, multinomial(rng, left_over, missing)]))


SCHEMES: dict[Scheme, Resample] = {
    "systematic": systematic,
    "stratified": stratified,
    "residual": residual,
    "multinomial": multinomial,
}


def _at(places: Array, log_weights: Array) -> NDArray[np.intp]:
    """Return whose share of the unit interval each place (n,) lies in."""
    edges = np.cumsum(np.exp(normalised(log_weights)[0]))
    edges /= edges[-1]
    last = np.searchsorted(edges, edges[-1])  # the last particle that has a weight
    return np.minimum(np.searchsorted(edges, places, side="right"), last)
