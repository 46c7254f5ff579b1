"""The Kalman filter of a jumper, against a textbook's in information form, and motions it knows exactly."""

import numpy as np
import pytest

from airborne.constants import GRAVITY_M_S2
from airborne.tracking.capsules.dynamics import (
    N_FILTERED,
    N_FREE,
    N_SLIDING,
    GaussianState,
    predict,
    state_at_rest,
    update,
)
from airborne.tracking.capsules.jumper import N_DOF

SLIDING = np.array([0.1, 0.5, 0.35, 0.4])
PLACE, SLIDES, SPEED = slice(0, N_DOF), slice(N_DOF, N_FREE), slice(N_FREE, N_FILTERED)


def spread(rng, n, scale=1.0):
    """A covariance (n, n) of full rank."""
    root = rng.normal(size=(n, n))
    return scale * (root @ root.T / n + 0.1 * np.eye(n))


def somewhere(seed=0):
    rng = np.random.default_rng(seed)
    return GaussianState(rng.normal(size=N_FILTERED), spread(rng, N_FILTERED, 0.01))


def assert_covariance(covariance):
    np.testing.assert_allclose(covariance, covariance.T, atol=1e-12)
    assert np.linalg.eigvalsh(covariance).min() > 0


def test_it_starts_at_rest_where_it_is_put():
    rng = np.random.default_rng(0)
    free, covariance = rng.normal(size=N_FREE), spread(rng, N_FREE)
    start = state_at_rest(free, covariance)
    np.testing.assert_array_equal(start.free, free)
    np.testing.assert_array_equal(start.mean[SPEED], 0)
    np.testing.assert_array_equal(start.covariance[:N_FREE, :N_FREE], covariance)
    assert_covariance(start.covariance)


@pytest.mark.parametrize("is_flying", [False, True])
def test_covariances_stay_covariances_over_a_long_run(is_flying):
    rng, now = np.random.default_rng(1), state_at_rest(np.zeros(N_FREE), spread(np.random.default_rng(2), N_FREE, 1e-3))
    for _ in range(120):
        expected = predict(now, 1 / 60, SLIDING, is_airborne=is_flying)
        assert_covariance(expected.covariance)
        information = np.linalg.inv(expected.covariance[:N_FREE, :N_FREE]) + spread(rng, N_FREE, 1e3)
        now = update(expected, expected.free + rng.normal(scale=0.01, size=N_FREE), np.linalg.inv(information))
        assert_covariance(now.covariance)


def test_an_update_that_says_what_was_expected_changes_nothing():
    expected = somewhere()
    same = update(expected, expected.free, expected.covariance[:N_FREE, :N_FREE])
    np.testing.assert_allclose(same.mean, expected.mean, atol=1e-12)
    np.testing.assert_allclose(same.covariance, expected.covariance, atol=1e-12)


def test_an_update_takes_over_what_was_found_and_its_covariance():
    rng, expected = np.random.default_rng(3), somewhere()
    free, covariance = rng.normal(size=N_FREE), spread(rng, N_FREE, 1e-4)
    updated = update(expected, free, covariance)
    np.testing.assert_allclose(updated.free, free, atol=1e-9)
    np.testing.assert_allclose(updated.covariance[:N_FREE, :N_FREE], covariance, atol=1e-9)


def test_prediction_and_update_are_those_of_a_filter_in_information_form():
    rng, expected = np.random.default_rng(4), somewhere(5)
    observed, noise = rng.normal(size=N_FREE), spread(rng, N_FREE, 1e-3)
    H = np.eye(N_FREE, N_FILTERED)
    information = np.linalg.inv(expected.covariance) + H.T @ np.linalg.solve(noise, H)
    covariance = np.linalg.inv(information)
    mean = covariance @ (np.linalg.solve(expected.covariance, expected.mean) + H.T @ np.linalg.solve(noise, observed))
    free, free_covariance = mean[:N_FREE], covariance[:N_FREE, :N_FREE]  # what a fit with this prior would find
    updated = update(expected, free, free_covariance)
    np.testing.assert_allclose(updated.mean, mean, atol=1e-8)
    np.testing.assert_allclose(updated.covariance, covariance, atol=1e-10)


def test_constant_speed_goes_on():
    now = somewhere()
    later = predict(now, 0.25, now.mean[SLIDES], is_airborne=False)
    np.testing.assert_allclose(later.mean[PLACE], now.mean[PLACE] + 0.25 * now.mean[SPEED], atol=1e-12)
    np.testing.assert_array_equal(later.mean[SPEED], now.mean[SPEED])
    np.testing.assert_allclose(later.mean[SLIDES], now.mean[SLIDES], atol=1e-12)


def test_two_predictions_are_one_over_both_times_but_for_the_noise_between():
    now = somewhere()
    for is_flying in (False, True):
        half = predict(predict(now, 0.05, SLIDING, is_airborne=is_flying), 0.05, SLIDING, is_airborne=is_flying)
        whole = predict(now, 0.1, SLIDING, is_airborne=is_flying)
        np.testing.assert_allclose(half.mean, whole.mean, atol=1e-12)


def test_hips_fall_freely_in_the_air_and_nothing_else_does():
    now, t = somewhere(), 0.4
    later, grounded = (predict(now, t, SLIDING, is_airborne=is_flying) for is_flying in (True, False))
    fallen = later.mean - grounded.mean
    expected = np.zeros(N_FILTERED)
    expected[2], expected[N_FREE + 2] = -GRAVITY_M_S2 * t**2 / 2, -GRAVITY_M_S2 * t
    np.testing.assert_allclose(fallen, expected, atol=1e-12)


def test_hips_are_surer_in_the_air():
    now = somewhere()
    later, grounded = (predict(now, 0.02, SLIDING, is_airborne=is_flying) for is_flying in (True, False))
    less = np.diag(grounded.covariance) - np.diag(later.covariance)
    assert np.all(less[[0, 1, 2, N_FREE, N_FREE + 1, N_FREE + 2]] > 0)
    np.testing.assert_array_equal(np.delete(less, [0, 1, 2, N_FREE, N_FREE + 1, N_FREE + 2]), 0)


def test_clothes_slide_back_to_where_they_were():
    now = somewhere()
    off = now.mean[SLIDES] - SLIDING
    shares = [
        (predict(now, gap_s, SLIDING, is_airborne=False).mean[SLIDES] - SLIDING) / off
        for gap_s in (0.1, 0.3, 1.0, 20.0)
    ]
    np.testing.assert_allclose(shares, np.repeat(np.mean(shares, axis=1), N_SLIDING).reshape(-1, N_SLIDING), atol=1e-12)
    assert np.all(np.diff(shares, axis=0) < 0)
    np.testing.assert_allclose(shares[-1], 0, atol=1e-9)


def test_the_longer_the_gap_the_less_is_known():
    now = somewhere()
    traces = [np.trace(predict(now, gap, SLIDING, is_airborne=False).covariance) for gap in (0.01, 0.03, 0.1, 0.3)]
    assert np.all(np.diff(traces) > 0)
