"""Agreement of two methods of measurement: bias, limits of agreement with repeated measures, errors, reliability.

Arrays come in; numbers with 95 % intervals go out. Sources: Bland and Altman 2007, "Agreement between methods of
measurement with multiple observations per individual", for a varying true value; Zou 2013, "Confidence interval
estimation for the Bland-Altman limits of agreement with multiple observations per individual" (intervals, and unequal
numbers of observations); McGraw and Wong 1996 (see `icc`).

Errors of successive frames are correlated. Intervals therefore count n_effective = n / (1 + 2 sum of the
differences' autocorrelations) frames, not n (Sokal 1997, "Monte Carlo methods in statistical mechanics"; Geyer's
initial sequence).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from airborne.constants import NORMAL_QUANTILE_975
from airborne.evaluation.compare import nan_to_none
from airborne.evaluation.icc import Reliability, reliability
from airborne.geometry.sampling import chi2_quantile
from airborne.motion.jumps.jump import UNKNOWN, Measurement
from airborne.types import Array


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """One variable, measured by two methods or more at the same moments; the second of two is the reference."""

    name: str
    unit: str
    values: Array  # (n, methods), in order of time within each individual
    individual: NDArray[np.str_]  # (n,) to which each moment belongs: a player, a joint, a jump

    def drop_missing(self) -> Series:
        """Leave out moments at which a method has no value."""
        rows = np.isfinite(self.values).all(axis=1)
        return Series(self.name, self.unit, self.values[rows], self.individual[rows])


@dataclass(frozen=True, slots=True, kw_only=True)
class Agreement:
    """One variable: measured minus reference, in `unit`; NaN where there are too few moments."""

    name: str
    unit: str
    n: int
    n_individuals: int
    n_effective: float  # number of independent moments with the same information on the bias
    bias: Measurement
    between_sd: float  # of the individuals' biases; NaN for one individual
    within_sd: float  # about these biases; NaN for one moment each
    lower_limit: Measurement  # 95 % of differences are expected between the limits
    upper_limit: Measurement
    rmse: Measurement
    range: float  # of the reference, largest minus smallest
    nrmse_percent: Measurement  # of that range
    icc: Reliability
    sem: Measurement  # standard error of measurement: square root of the residual mean square
    mdc: Measurement  # minimal detectable change: 1.96 sqrt(2) sem

    def to_dict(self) -> dict:
        """Return the numbers for a JSON file; what is unknown is None."""
        return plain_numbers(asdict(self))


class VarianceComponents(NamedTuple):
    """Variance components of differences by Zou's estimators, with their degrees of freedom."""

    mean: float
    mean_se: float
    mean_freedom: float
    between: float  # variance of the individuals' means
    between_freedom: float
    within: float  # variance about them
    within_freedom: float
    within_share: float  # 1 - 1 / harmonic mean of the numbers of observations

    @property
    def total(self) -> float:
        """Variance of one difference of one individual."""
        return self.between + self.within_share * self.within


def analyse_agreement(series: Series) -> Agreement:
    """Compare the first method with the second, the reference."""
    series = series.drop_missing()
    difference = series.values[:, 0] - series.values[:, 1] if len(series.values) else np.empty(0)
    groups = [difference[series.individual == name] for name in dict.fromkeys(series.individual.tolist())]
    counts = [effective_number(group) for group in groups]
    components = variance_components(groups, counts)
    low, high = limits_of_agreement(components)
    span = float(np.ptp(series.values[:, 1])) if len(difference) else math.nan
    rmse = _rmse(difference, sum(counts))
    icc = reliability(series.values, sum(counts))
    return Agreement(
        name=series.name,
        unit=series.unit,
        n=len(difference),
        n_individuals=len(groups),
        n_effective=float(sum(counts)),
        bias=_t_interval(components.mean, components.mean_se, components.mean_freedom),
        between_sd=math.sqrt(components.between) if len(groups) > 1 else math.nan,
        within_sd=math.sqrt(components.within) if components.within_freedom else math.nan,
        lower_limit=low,
        upper_limit=high,
        rmse=rmse,
        range=span,
        nrmse_percent=scale_measurement(rmse, 100 / span) if span > 0 else UNKNOWN,
        icc=icc,
        sem=icc.sem,
        mdc=scale_measurement(icc.sem, NORMAL_QUANTILE_975 * math.sqrt(2)),
    )


def effective_number(difference: Array) -> float:
    """Return the effective sample size of the mean of a series in order of time: 1 to n."""
    n = len(difference)
    deviation = difference - difference.mean() if n else difference
    power = float(deviation @ deviation)
    if n < 4 or power == 0:
        return float(n)
    correlation = np.array([deviation[lag:] @ deviation[: n - lag] for lag in range(n // 2)]) / power
    pairs = correlation[: len(correlation) // 2 * 2].reshape(-1, 2).sum(axis=1)
    stop = int(np.argmax(pairs <= 0)) if (pairs <= 0).any() else len(pairs)
    return float(np.clip(n / max(2 * pairs[:stop].sum() - 1, 1e-9), 1.0, n))


def variance_components(groups: Sequence[Array], counts: Sequence[float]) -> VarianceComponents:
    """Estimate the variance components of differences, one array per individual, given effective sample sizes."""
    if not groups:
        return VarianceComponents(*[math.nan] * 8)
    freedom = [max(m - 1, 0.0) if len(group) > 1 else 0.0 for group, m in zip(groups, counts, strict=True)]
    squares = [m * float(np.var(group)) if f else 0.0 for group, m, f in zip(groups, counts, freedom, strict=True)]
    within_freedom = sum(freedom)
    within = sum(squares) / within_freedom if within_freedom else 0.0
    means = np.array([group.mean() for group in groups])
    k = len(groups)
    if k == 1:
        se = math.sqrt(within / counts[0]) if within_freedom else math.nan
        return VarianceComponents(float(means[0]), se, within_freedom, 0.0, 0.0, within, within_freedom, 1.0)
    between = float(np.var(means, ddof=1))
    share = 1 - float(np.mean(1 / np.array(counts)))
    return VarianceComponents(
        float(means.mean()), math.sqrt(between / k), k - 1, between, k - 1, within, within_freedom, share
    )


def limits_of_agreement(components: VarianceComponents) -> tuple[Measurement, Measurement]:
    """Return the 95 % limits of agreement, each with its interval by the method of variance estimates recovery."""
    if not components.mean_freedom > 0:
        return UNKNOWN, UNKNOWN
    sd = math.sqrt(components.total)
    parts = (
        (components.between, components.between_freedom),
        (components.within_share * components.within, components.within_freedom),
    )
    parts = tuple((variance, freedom) for variance, freedom in parts if freedom > 0)
    less = math.sqrt(sum((v * (1 - f / chi2_quantile(0.975, f))) ** 2 for v, f in parts))
    more = math.sqrt(sum((v * (f / chi2_quantile(0.025, f) - 1)) ** 2 for v, f in parts))
    narrower = sd - math.sqrt(max(components.total - less, 0.0))
    wider = math.sqrt(components.total + more) - sd
    shift = float(stdtrit(components.mean_freedom, 0.975)) * components.mean_se
    inner, outer = math.hypot(shift, NORMAL_QUANTILE_975 * narrower), math.hypot(shift, NORMAL_QUANTILE_975 * wider)
    low, high = components.mean - NORMAL_QUANTILE_975 * sd, components.mean + NORMAL_QUANTILE_975 * sd
    return Measurement(low, low - outer, low + inner), Measurement(high, high - inner, high + outer)


def scale_measurement(measured: Measurement, factor: float) -> Measurement:
    """Multiply a measurement and its interval by a positive factor."""
    return Measurement(*(factor * each for each in measured))


def _t_interval(value: float, se: float, freedom: float) -> Measurement:
    if not freedom > 0:
        return Measurement(value, math.nan, math.nan)
    half = float(stdtrit(freedom, 0.975)) * se
    return Measurement(value, value - half, value + half)


def _rmse(difference: Array, count: float) -> Measurement:
    """Return the root mean square with an interval to first order on its logarithm."""
    if not len(difference):
        return UNKNOWN
    mean_square = float(np.mean(difference**2))
    bias, variance = float(difference.mean()), float(difference.var())
    value = math.sqrt(mean_square)
    if count < 2 or value == 0:
        return Measurement(value, math.nan, math.nan)
    se = math.sqrt((2 * variance**2 + 4 * bias**2 * variance) / count) / (2 * mean_square)
    return Measurement(value, value * math.exp(-NORMAL_QUANTILE_975 * se), value * math.exp(NORMAL_QUANTILE_975 * se))


def plain_numbers(value: Any) -> Any:
    """Turn measurements into dictionaries and NaN into None, recursively."""
    if isinstance(value, dict):
        return {key: plain_numbers(item) for key, item in value.items()}
    if isinstance(value, Measurement):
        return nan_to_none(value._asdict())
    if isinstance(value, tuple):
        return [nan_to_none(item) for item in value]
    return nan_to_none(value)
