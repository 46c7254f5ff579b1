"""Combinations of candidates are what brute force finds."""

import itertools

import numpy as np
import pytest

from airborne.tracking.particle.mixture import estimate_combination
from airborne.tracking.particle.situation import N_TOP
from tests.support.tolerances import ROUNDTRIP

KH, KL, KR = 4, 5, 6


def candidates(seed=0):
    rng = np.random.default_rng(seed)
    hips, left, right = (rng.random((k, 2, 3)) for k in (KH, KL, KR))
    return hips, left, right, rng.normal(0, 2, (KH, KL, KR))


def bodies(hips, left, right):
    """All combinations as points (n, 6, 3), in the order of their weights' ravel."""
    every = itertools.product(hips, left, right)
    return np.array([[h[0], h[1], a[0], b[0], a[1], b[1]] for h, a, b in every])


def weights_of(log_weights):
    weights = np.exp(log_weights.ravel())
    return weights / weights.sum()


@pytest.mark.parametrize("how", ["max", "mean", "top10_mean"])
def test_the_estimate_is_that_of_all_combinations(how):
    *parts, log_weights = candidates()
    points, weights = bodies(*parts), weights_of(log_weights)
    n = {"max": 1, "mean": len(weights), "top10_mean": N_TOP}[how]
    best = np.argsort(-weights)[:n]
    expected = np.average(points[best], axis=0, weights=weights[best])
    assert np.allclose(estimate_combination(*parts, log_weights, rule=how).points, expected, atol=ROUNDTRIP)


@pytest.mark.parametrize("how", ["max", "mean"])
def test_the_covariance_is_that_of_all_combinations_about_the_estimate(how):
    *parts, log_weights = candidates(1)
    points, weights = bodies(*parts), weights_of(log_weights)
    estimate = estimate_combination(*parts, log_weights, rule=how)
    away = points - estimate.points
    expected = np.einsum("n,nji,njk->jik", weights, away, away)
    assert np.allclose(estimate.covariance, expected, atol=ROUNDTRIP)


def test_one_sure_combination_has_no_spread():
    *parts, log_weights = candidates(2)
    log_weights[1, 2, 3] = 1e4
    estimate = estimate_combination(*parts, log_weights, rule="max")
    assert np.array_equal(estimate.points[:2], parts[0][1])
    assert np.array_equal(estimate.points[[2, 4]], parts[1][2])
    assert np.array_equal(estimate.points[[3, 5]], parts[2][3])
    assert not estimate.covariance.any()
