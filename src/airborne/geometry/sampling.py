"""Quantiles and even samples, without SciPy's statistics, which take half a second to import. Arrays only."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.special import chdtri

from airborne.types import Array


def chi2_quantile(share: float, freedom: Any) -> Any:
    """Return the value below which this share of a chi-squared distribution lies."""
    return chdtri(freedom, 1 - share)


def latin_hypercube(dimensions: int, n: int, *, seed: int) -> Array:
    """Return n points (n, dimensions) in the unit cube, one in each n-th of every coordinate (McKay et al. 1979)."""
    rng = np.random.default_rng(seed)
    strata = rng.permuted(np.tile(np.arange(n), (dimensions, 1)), axis=1).T
    return (strata + rng.random((n, dimensions))) / n
