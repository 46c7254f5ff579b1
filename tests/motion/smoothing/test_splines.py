"""Smoothing splines: SciPy's, their penalty recovered, weights and derivatives as they should be."""

import numpy as np
import pytest
from scipy.interpolate import make_smoothing_spline

from airborne.motion.smoothing import spline_smoother
from airborne.motion.smoothing.splines import smoothing_penalty

RATE = 60.0
T = np.arange(80) / RATE


def noisy(sd, seed=0, f=1.2):
    rng = np.random.default_rng(seed)
    return np.sin(2 * np.pi * f * T) + sd * rng.normal(size=len(T))


@pytest.mark.parametrize("lam", [0.01, 1.0, 30.0])
def test_the_penalty_of_a_spline_is_read_off_it(lam):
    u, y, weights = T * 15, noisy(0.05), np.linspace(0.5, 1.5, len(T))
    result = make_smoothing_spline(u, y, weights, lam=lam)
    assert smoothing_penalty(u, y, weights, result) == pytest.approx(lam, rel=1e-6)


def test_it_is_scipys_spline_by_cross_validation():
    y = noisy(0.05)
    expected = make_smoothing_spline(T * 15, y)
    result = spline_smoother(T, y[:, None], np.full((len(T), 1, 1), np.nan))
    assert result.value[:, 0] == pytest.approx(expected(T * 15), abs=1e-6)
    assert result.velocity[:, 0] == pytest.approx(15 * expected(T * 15, 1), abs=1e-4)


def test_it_comes_nearer_to_the_truth_than_the_measurements():
    truth = np.sin(2 * np.pi * 1.2 * T)
    for seed in range(2):
        y = noisy(0.05, seed)
        result = spline_smoother(T, y[:, None], np.full((len(T), 1, 1), 0.05**2))
        assert np.std(result.value[:, 0] - truth) < 0.5 * np.std(y - truth)


def test_a_slow_path_at_a_high_rate_is_smoothed_all_the_same():
    t, rng = np.arange(250) / 500, np.random.default_rng(4)
    y = t**2 + 0.01 * rng.normal(size=250)
    result = spline_smoother(t, y[:, None], np.full((250, 1, 1), 1e-4))
    assert np.std(result.value[:, 0] - t**2) < 0.003


def test_known_deviations_weigh():
    y, sd = noisy(0.01), np.full(len(T), 0.01)
    y[40] += 0.3
    sd[40] = 0.3
    covariance = (sd**2)[:, None, None]
    weighted = spline_smoother(T, y[:, None], covariance)
    plain = spline_smoother(T, y[:, None], np.full((len(T), 1, 1), np.nan))
    truth = np.sin(2 * np.pi * 1.2 * T[40])
    assert abs(weighted.value[40, 0] - truth) < 0.02 < abs(plain.value[40, 0] - truth)


def test_the_acceleration_at_the_ends_is_unknown_not_zero():
    result = spline_smoother(T, noisy(0.01)[:, None], np.full((len(T), 1, 1), 1e-4))
    assert np.isnan(result.acceleration[[0, -1]]).all()
    assert np.isfinite(result.acceleration[1:-1]).all()


@pytest.mark.parametrize("values", [np.zeros(20), np.linspace(0, 1, 20)])
def test_rest_and_steady_motion_are_kept(values):
    result = spline_smoother(T[:20], values[:, None], np.full((20, 1, 1), 1e-6))
    assert result.value[:, 0] == pytest.approx(values, abs=1e-6)
