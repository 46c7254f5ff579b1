"""Differences between two conditions from several trials of several athletes, node by node of a curve.

Three levels of chance: between athletes, between an athlete's trials, and the measurement of one trial. The analysis
has two stages. In the first, each athlete's mean in each condition gets the variance of a mean of their trials: the
pooled variance within athletes and conditions, which holds the measurement's. In the second these means are pooled as
in a random-effects meta-analysis: the variance between athletes by Paule and Mandel 1982, the interval by Hartung and
Knapp 2001 ("A refined method for the meta-analysis of controlled clinical trials with binary outcome") with Student's
t. With as many trials in every cell that is the paired t-test of the athletes' means. Athletes who are alike by chance
make it narrower than trials and measurement allow: it is no narrower than 1.96 sds of a mean by these alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm
from scipy.stats import t as student

from airborne.constants import NORMAL_QUANTILE_975
from airborne.types import Array

Level = Literal["within athletes", "between athletes", "between trials"]  # what the interval generalises over

_FEWEST = 2  # athletes, or trials of a single athlete
_LEAST = 1e-30  # variance that a weight may come from
_HALVINGS = 60  # of what brackets the variance between athletes: more than the 53 bits of a number


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cells:
    """The trials of one variable by athlete and condition, over the nodes of a curve (one for a number)."""

    values: Array  # (trials, nodes)
    variance: Array  # (trials, nodes), of the measurement; 0 where the run states none
    athlete: NDArray[np.intp]  # (trials,)
    condition: NDArray[np.intp]  # (trials,)

    def mean(self, athlete: int, condition: int) -> Array:
        """Return an athlete's mean in a condition (nodes,)."""
        return self.values[(self.athlete == athlete) & (self.condition == condition)].mean(axis=0)

    def athletes_in(self, condition: int) -> NDArray[np.intp]:
        """Return the athletes who have trials in a condition, in order."""
        return np.unique(self.athlete[self.condition == condition])

    def counts(self, athletes: NDArray[np.intp], condition: int) -> Array:
        """Return how many trials each of the athletes has in a condition."""
        return np.array([np.sum((self.athlete == each) & (self.condition == condition)) for each in athletes], float)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Difference:
    """Condition B minus condition A (nodes,), with a 95 % interval; NaN where there are too few."""

    level: Level
    value: Array
    low: Array
    high: Array
    p: Array  # two-sided, node by node
    sd_athletes: Array  # between athletes: of the effect if within athletes, else of their means
    samples: tuple[Array, Array]  # (n, nodes) of A and B, what the level counts as independent: for tests of curves


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Spread:
    """How much trials of one athlete in one condition differ (nodes,), and how much of it the measurement explains.

    All but what the runs state is NaN where no athlete has two trials in a condition.
    """

    sd_within: Array  # of single trials, the measurement included
    sd_measurement: Array  # as the runs state it
    mdc: Array  # minimal (or smallest) detectable change of a single trial: 1.96 sqrt(2) sd_within


def within_spread(cells: Cells) -> Spread:
    """Return how much trials differ within athletes and conditions, and the least change of one that can be told."""
    within, stated = _pooled_variance(cells), _stated_variance(cells)
    return Spread(
        sd_within=np.sqrt(within),
        sd_measurement=np.sqrt(stated),
        mdc=NORMAL_QUANTILE_975 * np.sqrt(2 * within),
    )


def _stated_variance(cells: Cells) -> Array:
    """Return the variance of the measurement (nodes,), as the runs state it."""
    return cells.variance.mean(axis=0)


def _pooled_variance(cells: Cells) -> Array:
    """Return the variance of trials (nodes,), pooled within athletes and conditions; NaN where none is repeated."""
    squares, freedom = np.zeros(cells.values.shape[1]), 0
    for athlete, condition in sorted(set(zip(cells.athlete.tolist(), cells.condition.tolist(), strict=True))):
        own = cells.values[(cells.athlete == athlete) & (cells.condition == condition)]
        squares += np.sum((own - own.mean(axis=0)) ** 2, axis=0)
        freedom += len(own) - 1
    return squares / freedom if freedom else np.full(squares.shape, np.nan)


def estimate_difference(cells: Cells, a: int, b: int) -> Difference:
    """Estimate condition `b` minus condition `a`.

    Within athletes where two or more have both; else between athletes; of one athlete between trials, and then of that
    athlete only. Where no trial is repeated, the variance of one is the measurement's.
    """
    pooled_variance = _pooled_variance(cells)
    within = np.where(np.isnan(pooled_variance), _stated_variance(cells), pooled_variance)
    of_a, of_b = cells.athletes_in(a), cells.athletes_in(b)
    both = np.intersect1d(of_a, of_b)
    if len(both) >= _FEWEST:
        means = [np.stack([cells.mean(each, condition) for each in both]) for condition in (a, b)]
        shares = 1 / cells.counts(both, a) + 1 / cells.counts(both, b)
        pooled = pool(means[1] - means[0], shares[:, None] * within)
        freedom = np.full(pooled.mean.shape, len(both) - 1.0)
        sd_athletes = np.sqrt(pooled.between)
        return _difference("within athletes", pooled, freedom, sd_athletes=sd_athletes, samples=(means[0], means[1]))
    if len(np.union1d(of_a, of_b)) == 1:
        samples = tuple(cells.values[cells.condition == condition] for condition in (a, b))
        each_pooled = [_plain_mean(each, _stated_variance(cells)) for each in samples]
        level: Level = "between trials"
        between = np.full(cells.values.shape[1], np.nan)
    else:
        samples = tuple(
            np.stack([cells.mean(each, condition) for each in athletes])
            for athletes, condition in ((of_a, a), (of_b, b))
        )
        counts = (cells.counts(of_a, a), cells.counts(of_b, b))
        each_pooled = [pool(each, within / n[:, None]) for each, n in zip(samples, counts, strict=True)]
        level = "between athletes"
        between = np.sqrt((each_pooled[0].between + each_pooled[1].between) / 2)
    of_a, of_b = each_pooled
    pooled = PooledMean(of_b.mean - of_a.mean, of_a.variance + of_b.variance, of_a.least + of_b.least, between)
    with np.errstate(divide="ignore", invalid="ignore"):  # Welch and Satterthwaite
        freedom = pooled.variance**2 / sum(
            each.variance**2 / (len(sample) - 1) for each, sample in zip(each_pooled, samples, strict=True)
        )
    return _difference(level, pooled, freedom, sd_athletes=between, samples=(samples[0], samples[1]))


class PooledMean(NamedTuple):
    """A mean of athletes, or of trials, or the difference of two (nodes,)."""

    mean: Array
    variance: Array  # by how much they differ; NaN for fewer than two
    least: Array  # variance that it has by the variances of each alone
    between: Array  # variance between athletes; NaN for fewer than two


def pool(means: Array, variances: Array) -> PooledMean:
    """Pool athletes' means (n, nodes) of known variances, their mean's variance after Hartung and Knapp."""
    n = len(means)
    if n < _FEWEST:
        unknown = np.full(means.shape[1], np.nan)
        return PooledMean(means.mean(axis=0), unknown, variances.sum(axis=0), unknown)
    between = _between(means, variances)
    weights = _weights(between, variances)
    total = np.sum(weights, axis=0)
    mean = np.sum(weights * means, axis=0) / total
    spread = np.sum(weights * (means - mean) ** 2, axis=0) / ((n - 1) * total)
    return PooledMean(mean, spread, np.where(variances.any(axis=0), 1 / total, 0.0), between)


def _between(means: Array, variances: Array) -> Array:
    """Return the variance between athletes (nodes,) at which the weighted squares are what they are expected to be."""
    low = np.zeros(means.shape[1])
    high = np.maximum(np.var(means, axis=0, ddof=1), _LEAST)
    while np.any(is_low := _excess(high, means, variances) > 0):
        high = np.where(is_low, 2 * high, high)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        is_low = _excess(middle, means, variances) > 0
        low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)
    return low


def _excess(between: Array, means: Array, variances: Array) -> Array:
    """Return how far the weighted squares lie above their expectation, one less than the number of athletes."""
    weights = _weights(between, variances)
    mean = np.sum(weights * means, axis=0) / np.sum(weights, axis=0)
    return np.sum(weights * (means - mean) ** 2, axis=0) - (len(means) - 1)


def _weights(between: Array, variances: Array) -> Array:
    return 1 / np.maximum(between + variances, _LEAST)


def _plain_mean(values: Array, stated_variance: Array) -> PooledMean:
    """Return the mean of trials (n, nodes); its variance is NaN for one."""
    n = len(values)
    unknown = np.full(values.shape[1], np.nan)
    variance = np.var(values, axis=0, ddof=1) / n if n > 1 else unknown
    return PooledMean(values.mean(axis=0), variance, stated_variance / n, unknown)


def _difference(
    level: Level, pooled: PooledMean, freedom: Array, *, sd_athletes: Array, samples: tuple[Array, Array]
) -> Difference:
    """Return a difference with its interval; without one where nothing tells how much trials differ."""
    value = pooled.mean
    sd = np.sqrt(np.where(pooled.variance > 0, pooled.variance, np.nan))
    least = np.sqrt(np.where((pooled.least > 0) & np.isfinite(pooled.variance), pooled.least, np.nan))
    half = np.fmax(student.ppf(0.975, freedom) * sd, NORMAL_QUANTILE_975 * least)
    p = 2 * np.fmax(student.sf(np.abs(value) / sd, freedom), norm.sf(np.abs(value) / least))
    return Difference(
        level=level, value=value, low=value - half, high=value + half, p=p, sd_athletes=sd_athletes, samples=samples
    )
