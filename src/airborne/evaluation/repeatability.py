"""Repeatability of several runs or operators: within-moment standard deviation, reliability.

Source: Bland and Altman 1999, "Measuring agreement in method comparison studies", section on repeatability: the
coefficient is 1.96 sqrt(2) times the within-subject standard deviation; 95 % of differences between two single
measurements are expected below it.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import numpy as np

from airborne.constants import NORMAL_QUANTILE_975
from airborne.evaluation.agreement import Series, effective_number, plain_numbers, scale_measurement
from airborne.evaluation.icc import Reliability, mean_squares, reliability, sd_with_interval
from airborne.motion.jumps.jump import UNKNOWN, Measurement


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeatability:
    """One variable, measured several times, in `unit`; NaN where there are too few moments."""

    name: str
    unit: str
    n: int  # moments
    n_ways: int  # runs or operators
    n_effective: float
    within_sd: Measurement  # of one measurement, including biases between the methods
    coefficient: Measurement  # 1.96 sqrt(2) times that
    biases: tuple[float, ...]  # of each method from the mean of all
    icc: Reliability
    sem: Measurement  # without the biases
    mdc: Measurement  # 1.96 sqrt(2) times that

    def to_dict(self) -> dict:
        """Return the numbers for a JSON file; what is unknown is None."""
        return plain_numbers(asdict(self))


def analyse_repeatability(series: Series) -> Repeatability:
    """Compare all methods with one another; none is the reference."""
    series = series.drop_missing()
    n, k = series.values.shape
    within_sd, count, biases = UNKNOWN, float(n), tuple([math.nan] * k)
    if n > 1:
        count = _effective_number(series)
        within_sd = sd_with_interval(mean_squares(series.values)[3], count * (k - 1))
        biases = tuple((series.values.mean(axis=0) - series.values.mean()).tolist())
    icc = reliability(series.values, count)
    return Repeatability(
        name=series.name,
        unit=series.unit,
        n=n,
        n_ways=k,
        n_effective=count,
        within_sd=within_sd,
        coefficient=scale_measurement(within_sd, NORMAL_QUANTILE_975 * math.sqrt(2)),
        biases=biases,
        icc=icc,
        sem=icc.sem,
        mdc=scale_measurement(icc.sem, NORMAL_QUANTILE_975 * math.sqrt(2)),
    )


def _effective_number(series: Series) -> float:
    """Return the effective number of moments: mean over the methods, each by its deviations from the mean of all."""
    deviation = series.values - series.values.mean(axis=1, keepdims=True)
    names = dict.fromkeys(series.individual.tolist())
    return float(
        np.mean(
            [
                sum(effective_number(deviation[series.individual == name, way]) for name in names)
                for way in range(deviation.shape[1])
            ]
        )
    )
