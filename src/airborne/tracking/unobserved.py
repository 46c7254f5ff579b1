"""Covariances with infinite variances, of what images do not show, made fit to be inverted, and back."""

from __future__ import annotations

import numpy as np

from airborne.types import Array

_WIDE_VARIANCE = 1e4  # stands for an infinite one [m², rad²]


def without_unobserved(covariance: Array, n: int) -> Array:
    """Return a covariance (n, n) with a wide variance where it is infinite, unknown or missing."""
    wide, known = np.diag(np.full(n, _WIDE_VARIANCE)), np.flatnonzero(np.isfinite(np.diagonal(covariance)))
    wide[np.ix_(known, known)] = covariance[np.ix_(known, known)]
    return wide


def with_unobserved(covariance: Array) -> Array:
    """Return a covariance (n, n) in which variances that are still as wide are infinite again."""
    covariance = (covariance + covariance.T) / 2
    unobserved = np.diagonal(covariance) > _WIDE_VARIANCE / 10
    covariance[unobserved] = covariance[:, unobserved] = 0
    covariance[unobserved, unobserved] = np.inf
    return covariance
