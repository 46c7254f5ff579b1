"""Shares of errors inside stated intervals."""

import numpy as np
import pytest

from airborne.evaluation.coverage import coverage_of
from tests.support.tolerances import sampled

RNG = np.random.default_rng(3)
SD = RNG.uniform(0.5, 3, (4000, 3))
ERROR = SD * RNG.normal(size=SD.shape)


def test_intervals_of_errors_as_large_as_stated_hold_what_they_state():
    result = coverage_of(ERROR, SD)
    assert result.n == ERROR.size
    for share, stated in ((result.within_50, 0.5), (result.within_80, 0.8), (result.within_95, 0.95)):
        assert share == pytest.approx(stated, abs=sampled(result.n))
    assert result.ece < sampled(result.n)


def test_intervals_half_as_wide_hold_less():
    result = coverage_of(ERROR, SD / 2)
    assert result.within_95 == pytest.approx(0.673, abs=sampled(result.n))
    assert result.ece == pytest.approx(0.272, abs=0.03)


def test_infinite_deviations_and_unknown_errors_are_left_out():
    error, sd = np.array([0.1, np.nan, 0.1, 5.0]), np.array([1.0, 1.0, np.inf, 1.0])
    result = coverage_of(error, sd)
    assert (result.n, result.within_95) == (2, 0.5)
    assert np.isnan(coverage_of(error[:0], sd[:0]).ece)
