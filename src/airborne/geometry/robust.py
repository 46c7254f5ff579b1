"""Medians, standard deviations despite outliers, covariances of sums of correlated terms. Arrays only."""

from __future__ import annotations

import numpy as np

from airborne.types import Array, Floats

SD_OF_MEDIAN_DEVIATION = 1.4826  # of normal noise: 1 / 0.67449, its 75 % quantile


def robust_sd(values: Array) -> float:
    """Return the standard deviation of normal noise with outliers in it, from the median absolute deviation."""
    return SD_OF_MEDIAN_DEVIATION * float(np.median(np.abs(values - np.median(values))))


def known_median(values: Floats) -> Array:
    """Return the median over the first axis of what is not NaN; NaN where nothing is.

    As `np.nanmedian`, which takes twenty times as long where rows are few and columns many.
    """
    n_known = np.sum(~np.isnan(values), axis=0)[None]
    ordered = np.sort(values, axis=0)  # NaN last
    low, high = (np.take_along_axis(ordered, middle, axis=0)[0] for middle in ((n_known - 1) // 2, n_known // 2))
    return (low + high) / 2


def covariance_of_sum(terms: Array, reach: int) -> Array:
    """Return the covariance (d, d) of the sum of terms (n, d) of mean zero, correlated over up to `reach` neighbours.

    The weight of products falls with the distance between the terms (Newey and West 1987).
    """
    total = terms.T @ terms
    for lag in range(1, min(reach, len(terms) - 1) + 1):
        product = terms[lag:].T @ terms[:-lag]
        total += (1 - lag / (reach + 1)) * (product + product.T)
    return total
