"""Intraclass correlation: the share of the variance of measurements that is due to the targets.

Models and intervals: McGraw and Wong 1996, "Forming inferences about some intraclass correlation coefficients", tables
4 and 7; Shrout and Fleiss 1979, whose (1,1), (2,1), (3,1) are `one_way`, `agreement` and `consistency` here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from scipy.special import fdtri

from airborne.geometry.sampling import chi2_quantile
from airborne.motion.jumps.jump import UNKNOWN, Measurement
from airborne.types import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Reliability:
    """Intraclass correlations of single measurements and of means over all methods; NaN where too few."""

    one_way: Measurement  # ICC(1), one-way random effects
    agreement: Measurement  # ICC(A,1), two-way, absolute agreement: a bias between methods counts
    consistency: Measurement  # ICC(C,1), two-way, consistency: it does not
    one_way_mean: Measurement  # ICC(k)
    agreement_mean: Measurement  # ICC(A,k)
    consistency_mean: Measurement  # ICC(C,k)
    sem: Measurement  # square root of the residual mean square


def reliability(ratings: Array, n_effective: float | None = None) -> Reliability:
    """Analyse ratings (n targets, k methods), all finite. Intervals use `n_effective` targets, or n if None."""
    n, k = ratings.shape if ratings.ndim == 2 else (0, 0)
    m = n if n_effective is None else n_effective
    if n < 2 or k < 2 or m <= 1:
        return Reliability(**dict.fromkeys(Reliability.__slots__, UNKNOWN))
    rows, columns, residual, within = mean_squares(ratings)
    one_way = _icc_from_f_ratio(rows, within, k=k, freedom=(m - 1, m * (k - 1)))
    consistency = _icc_from_f_ratio(rows, residual, k=k, freedom=(m - 1, (m - 1) * (k - 1)))
    agreement = _absolute_agreement(rows, columns, residual, n=n, k=k, freedom=m - 1)
    freedom = (m - 1) * (k - 1)
    return Reliability(
        one_way=one_way,
        agreement=agreement,
        consistency=consistency,
        one_way_mean=_icc_of_means(one_way, k),
        agreement_mean=_icc_of_means(agreement, k),
        consistency_mean=_icc_of_means(consistency, k),
        sem=sd_with_interval(residual, freedom),
    )


def mean_squares(ratings: Array) -> tuple[float, float, float, float]:
    """Return the mean squares of ratings (n, k): between targets, between methods, residual, within targets."""
    n, k = ratings.shape
    whole, by_row, by_column = ratings.mean(), ratings.mean(axis=1), ratings.mean(axis=0)
    rows = k * float(((by_row - whole) ** 2).sum()) / (n - 1)
    columns = n * float(((by_column - whole) ** 2).sum()) / (k - 1)
    residuals = ratings - by_row[:, None] - by_column + whole
    residual = float((residuals**2).sum()) / ((n - 1) * (k - 1))
    within = float(((ratings - by_row[:, None]) ** 2).sum()) / (n * (k - 1))
    return rows, columns, residual, within


def sd_with_interval(variance: float, freedom: float) -> Measurement:
    """Return the square root of an estimated variance with its 95 % interval."""
    if not freedom > 0:
        return UNKNOWN
    low, high = (math.sqrt(variance * freedom / float(chi2_quantile(p, freedom))) for p in (0.975, 0.025))
    return Measurement(math.sqrt(variance), low, high)


def _icc_from_f_ratio(rows: float, error: float, *, k: int, freedom: tuple[float, float]) -> Measurement:
    if not error > 0:
        return Measurement(1.0, 1.0, 1.0) if rows > 0 else UNKNOWN
    ratio = rows / error
    low = ratio / float(fdtri(*freedom, 0.975))
    high = ratio * float(fdtri(*freedom[::-1], 0.975))
    return Measurement(*((each - 1) / (each + k - 1) for each in (ratio, low, high)))


def _absolute_agreement(rows: float, columns: float, residual: float, *, n: int, k: int, freedom: float) -> Measurement:
    whole = rows + (k - 1) * residual + k / n * (columns - residual)
    if not whole > 0:
        return UNKNOWN
    value = (rows - residual) / whole
    if not value < 1 or not residual > 0:
        return Measurement(value, math.nan, math.nan)
    a, b = k * value / (n * (1 - value)), 1 + k * value * (n - 1) / (n * (1 - value))
    v = (a * columns + b * residual) ** 2 / ((a * columns) ** 2 / (k - 1) + (b * residual) ** 2 / (freedom * (k - 1)))
    above, below = float(fdtri(freedom, v, 0.975)), float(fdtri(v, freedom, 0.975))
    shared = k * columns + (k * n - k - n) * residual
    low = n * (rows - above * residual) / (above * shared + n * rows)
    high = n * (below * rows - residual) / (shared + n * below * rows)
    return Measurement(value, low, high)


def _icc_of_means(single: Measurement, k: int) -> Measurement:
    """Return the correlation of means over k methods (Spearman-Brown formula)."""
    return Measurement(*(k * each / (1 + (k - 1) * each) for each in single))
