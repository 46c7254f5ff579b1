"""Repeated measurements: the deviation within moments, whatever the moments are."""

import numpy as np
import pytest

from airborne.evaluation import Series, analyse_repeatability
from tests.support.tolerances import ROUNDTRIP


def series(values):
    return Series("x", "mm", values, np.full(len(values), "one"))


def test_the_deviation_within_moments_is_that_of_one_measurement():
    rng = np.random.default_rng(0)
    result = analyse_repeatability(series(50 * rng.normal(size=(300, 1)) + 2.0 * rng.normal(size=(300, 4))))
    assert result.within_sd.value == pytest.approx(2.0, rel=0.06)
    assert result.within_sd.low < 2.0 < result.within_sd.high
    assert result.coefficient.value == pytest.approx(1.96 * 2**0.5 * result.within_sd.value, rel=1e-4)
    assert result.n_ways == 4
    assert result.icc.agreement.value > 0.99


def test_its_square_is_the_mean_variance_of_the_moments():
    values = np.random.default_rng(1).normal(size=(40, 3))
    result = analyse_repeatability(series(values))
    assert result.within_sd.value**2 == pytest.approx(values.var(axis=1, ddof=1).mean(), abs=ROUNDTRIP)


def test_a_bias_of_one_operator_is_named_and_counts():
    rng = np.random.default_rng(2)
    result = analyse_repeatability(
        series(10 * rng.normal(size=(100, 1)) + 0.1 * rng.normal(size=(100, 3)) + [0.0, 0.0, 3.0])
    )
    assert result.biases == pytest.approx((-1.0, -1.0, 2.0), abs=0.05)
    assert result.within_sd.value > 1.5
    assert result.sem.value == pytest.approx(0.1, rel=0.15)
    assert result.mdc.value < 0.4


@pytest.mark.parametrize("n", [0, 1])
def test_hardly_any_moment_is_unknown(n):
    assert np.isnan(analyse_repeatability(series(np.zeros((n, 2)))).within_sd.value)


def test_runs_that_are_the_same_differ_by_nothing():
    values = np.repeat(np.arange(20.0)[:, None], 2, axis=1)
    result = analyse_repeatability(series(values))
    assert result.within_sd.value == result.coefficient.value == 0.0
    assert result.icc.agreement.value == 1.0
