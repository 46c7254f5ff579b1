"""Quantiles and even samples; SciPy's statistics, half a second of imports, only where needed. Arrays only."""

from __future__ import annotations

from functools import cache
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


@cache
def sobol_points(dimensions: int, n: int, *, seed: int) -> Array:
    """Return n points (n, dimensions) of a scrambled Sobol sequence, even in many coordinates together, as limbs need.

    Of a limb's nine coordinates a Latin hypercube missed poses that this finds. The array is made once and read-only.
    """
    from scipy.stats import qmc

    points = qmc.Sobol(dimensions, rng=seed).random(n)
    points.flags.writeable = False
    return points
