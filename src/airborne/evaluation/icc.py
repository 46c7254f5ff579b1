"""Intraclass correlation: which share of the variance of measurements is that of what is measured.

Models and intervals: McGraw and Wong 1996, "Forming inferences about some intraclass correlation coefficients", tables
4 and 7; Shrout and Fleiss 1979, whose (1,1), (2,1), (3,1) are `one_way`, `agreement` and `consistency` here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, f

from airborne.motion.jumps.jump import UNKNOWN, Measured

Array = NDArray[np.floating]


@dataclass(frozen=True, slots=True, kw_only=True)
class Reliability:
    """Intraclass correlations of single measurements and of means over all ways; NaN where there are too few."""

    one_way: Measured  # ICC(1), one-way random effects
    agreement: Measured  # ICC(A,1), two-way, absolute agreement: a bias between the ways counts
    consistency: Measured  # ICC(C,1), two-way, consistency: it does not
    one_way_mean: Measured  # ICC(k)
    agreement_mean: Measured  # ICC(A,k)
    consistency_mean: Measured  # ICC(C,k)
    sem: Measured  # square root of the residual mean square


def reliability(ratings: Array, n_effective: float | None = None) -> Reliability:
    """Analyse ratings (n targets, k ways), all known. `n_effective` targets count in the intervals, all if None."""
    n, k = ratings.shape if ratings.ndim == 2 else (0, 0)
    m = n if n_effective is None else n_effective
    if n < 2 or k < 2 or m <= 1:
        return Reliability(**dict.fromkeys(Reliability.__slots__, UNKNOWN))
    rows, columns, residual, within = mean_squares(ratings)
    one_way = _by_ratio(rows, within, m - 1, m * (k - 1), k)
    consistent = _by_ratio(rows, residual, m - 1, (m - 1) * (k - 1), k)
    agreeing = _agreement(rows, columns, residual, n=n, k=k, freedom=m - 1)
    freedom = (m - 1) * (k - 1)
    return Reliability(
        one_way=one_way,
        agreement=agreeing,
        consistency=consistent,
        one_way_mean=_of_means(one_way, k),
        agreement_mean=_of_means(agreeing, k),
        consistency_mean=_of_means(consistent, k),
        sem=standard_deviation(residual, freedom),
    )


def mean_squares(ratings: Array) -> tuple[float, float, float, float]:
    """Return the mean squares of ratings (n, k): between targets, between ways, residual, within targets."""
    n, k = ratings.shape
    whole, by_row, by_column = ratings.mean(), ratings.mean(axis=1), ratings.mean(axis=0)
    rows = k * float(((by_row - whole) ** 2).sum()) / (n - 1)
    columns = n * float(((by_column - whole) ** 2).sum()) / (k - 1)
    rest = ratings - by_row[:, None] - by_column + whole
    residual = float((rest**2).sum()) / ((n - 1) * (k - 1))
    within = float(((ratings - by_row[:, None]) ** 2).sum()) / (n * (k - 1))
    return rows, columns, residual, within


def standard_deviation(variance: float, freedom: float) -> Measured:
    """Return the root of an estimated variance with its interval."""
    if not freedom > 0:
        return UNKNOWN
    low, high = (math.sqrt(variance * freedom / float(chi2.ppf(p, freedom))) for p in (0.975, 0.025))
    return Measured(math.sqrt(variance), low, high)


def _by_ratio(rows: float, error: float, row_freedom: float, error_freedom: float, k: int) -> Measured:
    if not error > 0:
        return Measured(1.0, 1.0, 1.0) if rows > 0 else UNKNOWN
    ratio = rows / error
    low = ratio / float(f.ppf(0.975, row_freedom, error_freedom))
    high = ratio * float(f.ppf(0.975, error_freedom, row_freedom))
    return Measured(*((each - 1) / (each + k - 1) for each in (ratio, low, high)))


def _agreement(rows: float, columns: float, residual: float, *, n: int, k: int, freedom: float) -> Measured:
    whole = rows + (k - 1) * residual + k / n * (columns - residual)
    if not whole > 0:
        return UNKNOWN
    value = (rows - residual) / whole
    if not value < 1 or not residual > 0:
        return Measured(value, math.nan, math.nan)
    a, b = k * value / (n * (1 - value)), 1 + k * value * (n - 1) / (n * (1 - value))
    v = (a * columns + b * residual) ** 2 / ((a * columns) ** 2 / (k - 1) + (b * residual) ** 2 / (freedom * (k - 1)))
    above, below = float(f.ppf(0.975, freedom, v)), float(f.ppf(0.975, v, freedom))
    shared = k * columns + (k * n - k - n) * residual
    low = n * (rows - above * residual) / (above * shared + n * rows)
    high = n * (below * rows - residual) / (shared + n * below * rows)
    return Measured(value, low, high)


def _of_means(single: Measured, k: int) -> Measured:
    """Return the correlation of means over k ways (Spearman and Brown)."""
    return Measured(*(k * each / (1 + (k - 1) * each) for each in single))
