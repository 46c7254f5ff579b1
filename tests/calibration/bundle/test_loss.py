"""Robust losses and their constants."""

import numpy as np
import pytest

from airborne.calibration.bundle.loss import loss_constants, robust_cost, robust_scale, robust_weight
from tests.support.tolerances import sampled

LOSSES = ["cauchy", "huber", "squares"]


@pytest.mark.parametrize("loss", LOSSES)
def test_the_weight_is_the_slope_of_the_cost(loss):
    s = np.linspace(0.1, 40, 50)
    slope = (robust_cost(loss, s + 1e-6) - robust_cost(loss, s - 1e-6)) / 2e-6
    np.testing.assert_allclose(robust_weight(loss, s), slope, atol=1e-6)


@pytest.mark.parametrize("loss", LOSSES)
def test_the_scale_of_normal_errors_is_their_standard_deviation(loss):
    n = 20_000
    s = np.sum((2.5 * np.random.default_rng(0).standard_normal((n, 2))) ** 2, axis=1)
    assert robust_scale(loss, s) == pytest.approx(2.5, rel=sampled(n))


def test_a_tenth_of_wild_errors_hardly_changes_the_scale():
    rng = np.random.default_rng(1)
    s = np.sum(rng.standard_normal((5000, 2)) ** 2, axis=1)
    s[:500] *= 1e4
    assert robust_scale("cauchy", s) < 1.45
    assert robust_scale("squares", s) > 20


def test_squares_need_no_correction():
    assert loss_constants("squares") == pytest.approx((1.0, 1.0, 1.0), rel=1e-3)


@pytest.mark.parametrize("loss", LOSSES)
def test_the_variance_is_that_of_many_means(loss):
    rng, n, runs = np.random.default_rng(2), 40, 4000
    errors = rng.standard_normal((runs, n, 2))
    place = np.zeros((runs, 1, 2))
    for _ in range(30):
        weight = robust_weight(loss, np.sum((errors - place) ** 2, axis=2))[..., None]
        place = np.sum(weight * errors, axis=1, keepdims=True) / np.sum(weight, axis=1, keepdims=True)
    told = loss_constants(loss).variance / np.mean(np.sum(weight, axis=1))
    assert np.var(place) == pytest.approx(told, rel=2 * sampled(2 * runs))
