"""Quantiles and even samples, of SciPy's special functions alone: its statistics take half a second to import."""

from __future__ import annotations

from typing import Any

from scipy.special import chdtri

from airborne.types import Array


def chi2_quantile(share: float, freedom: Any) -> Any:
    """Return the value below which this share of a chi-squared distribution lies."""
    return chdtri(freedom, 1 - share)


def sobol_points(dimensions: int, n: int, *, seed: int) -> Array:
    """Return n points (n, dimensions) that fill the unit cube evenly (scrambled Sobol sequence)."""
    from scipy.stats import qmc

    return qmc.Sobol(dimensions, rng=seed).random(n)
