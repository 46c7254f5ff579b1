"""How much numbers scatter: among strays, and as sums of terms that are not independent. Arrays only."""

from __future__ import annotations

import numpy as np

from airborne.types import Array

SD_OF_MEDIAN_DEVIATION = 1.4826  # of normal noise


def robust_sd(values: Array) -> float:
    """Return the standard deviation of normal noise with strays in it, from the median distance to the median."""
    return SD_OF_MEDIAN_DEVIATION * float(np.median(np.abs(values - np.median(values))))


def covariance_of_sum(terms: Array, reach: int) -> Array:
    """Return the covariance (d, d) of the sum of terms (n, d) of mean zero, up to `reach` neighbours being alike.

    Products of terms further apart count less and less (Newey and West 1987).
    """
    total = terms.T @ terms
    for apart in range(1, min(reach, len(terms) - 1) + 1):
        both = terms[apart:].T @ terms[:-apart]
        total += (1 - apart / (reach + 1)) * (both + both.T)
    return total
