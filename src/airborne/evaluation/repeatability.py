"""How well several runs, or several people, come to the same: within-moment deviation, reliability.

Source: Bland and Altman 1999, "Measuring agreement in method comparison studies", section on repeatability: the
coefficient is 1.96 sqrt(2) times the within-subject standard deviation; 95 % of differences between two single
measurements are expected below it.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import numpy as np

from airborne.evaluation.agreement import Series, Z, n_effective, plain_numbers, scaled
from airborne.evaluation.icc import Reliability, mean_squares, reliability, standard_deviation
from airborne.motion.jumps.jump import UNKNOWN, Measured


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeatability:
    """One variable, measured several times, in `unit`; NaN where there are too few moments."""

    name: str
    unit: str
    n: int  # moments
    n_ways: int  # runs or people
    n_effective: float
    within_sd: Measured  # of one measurement, biases between the ways with it
    coefficient: Measured  # 1.96 sqrt(2) times that
    biases: tuple[float, ...]  # of each way from the mean of all
    icc: Reliability
    sem: Measured  # without the biases
    mdc: Measured  # 1.96 sqrt(2) times that

    def to_dict(self) -> dict:
        """Return the numbers for a JSON file; what is unknown is None."""
        return plain_numbers(asdict(self))


def repeatability(series: Series) -> Repeatability:
    """Compare all ways with one another, none of them the reference."""
    series = series.known()
    n, k = series.values.shape
    within_sd, count, biases = UNKNOWN, float(n), tuple([math.nan] * k)
    if n > 1:
        count = _count(series)
        within_sd = standard_deviation(mean_squares(series.values)[3], count * (k - 1))
        biases = tuple((series.values.mean(axis=0) - series.values.mean()).tolist())
    icc = reliability(series.values, count)
    return Repeatability(
        name=series.name,
        unit=series.unit,
        n=n,
        n_ways=k,
        n_effective=count,
        within_sd=within_sd,
        coefficient=scaled(within_sd, Z * math.sqrt(2)),
        biases=biases,
        icc=icc,
        sem=icc.sem,
        mdc=scaled(icc.sem, Z * math.sqrt(2)),
    )


def _count(series: Series) -> float:
    """Return the effective number of moments: the mean over the ways, each from its distance to the mean of all."""
    rest = series.values - series.values.mean(axis=1, keepdims=True)
    names = dict.fromkeys(series.individual.tolist())
    return float(
        np.mean(
            [sum(n_effective(rest[series.individual == name, way]) for name in names) for way in range(rest.shape[1])]
        )
    )
