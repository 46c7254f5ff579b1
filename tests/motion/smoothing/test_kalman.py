"""The Kalman smoother: a dense Gaussian solve gives the same, free fall is recovered, its deviations are honest."""

from functools import partial

import numpy as np
import pytest
from scipy.stats import norm

from airborne.motion.smoothing import butterworth_smoother, kalman_smoother, spline_smoother
from airborne.motion.smoothing.kalman import (
    ERROR_S,
    PRIOR_SD,
    error_correlations,
    maximum_likelihood,
    measurement_noise,
    state_space_model,
)
from airborne.motion.smoothing.state_space import kalman_filter, rts_smoother
from tests.support.tolerances import ROUNDTRIP

RATE, WHITE_SHARE = 60.0, 0.2


def error_covariance(t, variance, white_share=WHITE_SHARE):
    """The covariance of a tracker's errors at times t: white, and a Matern process of order 3/2."""
    lag = np.sqrt(3) * np.abs(t[:, None] - t) / ERROR_S
    correlation = (1 - white_share) * (1 + lag) * np.exp(-lag) + white_share * np.eye(len(t))
    return np.sqrt(variance[:, None] * variance) * correlation


def dense(t, z, variance, density, white_share=WHITE_SHARE):
    """The posterior of value, velocity, acceleration at all times, by one solve of the whole joint Gaussian."""
    n = len(t)
    mean, K = np.array([z[0], 0.0, 0.0]), np.zeros((3 * n, 3 * n))
    K[:3, :3] = np.diag(np.square(PRIOR_SD))
    means = [mean]
    for i in range(1, n):
        T = t[i] - t[i - 1]
        F = np.array([[1, T, T * T / 2], [0, 1, T], [0, 0, 1]])
        Q = np.array([[T**5 / 20, T**4 / 8, T**3 / 6], [T**4 / 8, T**3 / 3, T**2 / 2], [T**3 / 6, T**2 / 2, T]])
        K[3 * i : 3 * i + 3, : 3 * i] = F @ K[3 * i - 3 : 3 * i, : 3 * i]
        K[: 3 * i, 3 * i : 3 * i + 3] = K[3 * i : 3 * i + 3, : 3 * i].T
        K[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = F @ K[3 * i - 3 : 3 * i, 3 * i - 3 : 3 * i] @ F.T + density * Q
        means.append(F @ means[-1])
    seen = np.flatnonzero(np.isfinite(z))
    mean, at = np.concatenate(means), 3 * seen
    S = K[np.ix_(at, at)] + error_covariance(t[seen], variance[seen], white_share)
    gain = np.linalg.solve(S, K[at]).T
    L = np.linalg.cholesky(S)
    evidence = norm.logpdf(np.linalg.solve(L, z[seen] - mean[at])).sum() - np.log(np.diag(L)).sum()
    return mean + gain @ (z[seen] - mean[at]), K - gain @ K[at], evidence


def problem(n=25, seed=0):
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.5, 1.5, n)) / RATE
    variance = rng.uniform(0.5, 2.0, n) * 1e-4
    z = np.sin(8 * t) + np.sqrt(variance) * rng.normal(size=n)
    z[[9, 10]] = np.nan
    return t, z, variance


def test_mean_covariance_and_likelihood_are_those_of_a_dense_solve():
    t, z, variance = problem()
    for density in (10.0, 1e4):
        mean, K, evidence = dense(t, z, variance, density)
        noise = measurement_noise(variance[:, None, None])
        steps = state_space_model(t, z[:, None], noise, density, white_share=WHITE_SHARE)
        result, P = rts_smoother(steps, z[:, None])
        period = np.median(np.diff(t))
        scale = period ** -np.arange(3)
        assert result[:, :3] * scale == pytest.approx(mean.reshape(-1, 3), rel=1e-5, abs=1e-6)
        sd = np.sqrt(np.diagonal(P, axis1=1, axis2=2)[:, :3]) * scale
        assert sd == pytest.approx(np.sqrt(np.diag(K)).reshape(-1, 3), rel=1e-5)
        fit = kalman_filter(steps, z[:, None])
        constant = np.isfinite(z).sum() * np.log(2 * np.pi)
        assert -0.5 * (fit.squares + fit.log_determinant + constant) == pytest.approx(evidence, rel=1e-6)


def test_axes_that_do_not_share_noise_are_smoothed_as_if_alone():
    t, z, variance = problem()
    both, own = np.stack([z, z], axis=1), measurement_noise(variance[:, None, None])
    shared = measurement_noise(variance[:, None, None] * np.eye(2))
    density, fast_share, share = maximum_likelihood(t, z[:, None], own, are_slow=True)
    alike = pytest.approx((density, fast_share, share), rel=0.1)
    assert maximum_likelihood(t, both, shared, are_slow=True) == alike
    alone = rts_smoother(state_space_model(t, z[:, None], own, density, white_share=share), z[:, None])[0]
    together = rts_smoother(state_space_model(t, both, shared, density, white_share=share), both)[0]
    assert together[:, :4:2] == pytest.approx(alone[:, :2], abs=ROUNDTRIP)


@pytest.mark.parametrize(("factor", "scales"), [(1.0, (0.3, 0.6, 0.8, 1.0)), (100.0, np.geomspace(1e-3, 1.0, 31))])
def test_the_strength_of_the_jerk_is_the_likeliest_with_errors_of_the_likeliest_size(factor, scales):
    t, z, variance = problem()
    variance *= factor
    density, fast_share, share = maximum_likelihood(t, z[:, None], measurement_noise(variance[:, None, None]))
    assert fast_share == 1, "of errors that are not slow"
    costs = [
        min(-dense(t, z, scale * variance, times * scale * density, share)[2] for scale in scales)
        for times in (0.3, 1.0, 3.0)
    ]
    assert costs[1] == min(costs)


def test_how_much_too_wide_the_stated_deviations_are_does_not_matter():
    t, z, variance = problem()
    wide, wider = (kalman_smoother(t, z[:, None], factor * variance[:, None, None]) for factor in (4.0, 100.0))
    assert wider.value == pytest.approx(wide.value, abs=5e-4)
    assert wider.velocity == pytest.approx(wide.velocity, abs=2e-2)
    assert np.all(wider.value_sd > 3 * wide.value_sd)  # what was stated stays said


def test_a_fast_motion_is_not_taken_for_errors_larger_than_those_stated():
    t = np.arange(24) / RATE
    z = 0.5 * np.maximum(np.sin(np.pi * (t - 0.05) / 0.12), 0.0) * (t < 0.17)
    result = kalman_smoother(t, z[:, None], np.full((24, 1, 1), 0.02**2))
    assert result.value[:, 0] == pytest.approx(z, abs=0.03)


def test_free_fall_is_recovered_inside_a_flight():
    rng, t = np.random.default_rng(3), np.arange(36) / RATE
    sd = 0.005
    noise = np.linalg.cholesky(error_covariance(t, np.full(36, sd**2))) @ rng.normal(size=(36, 3))
    fall = np.stack([0.5 * t, 0 * t, 1 + 3 * t - 9.81 / 2 * t**2], axis=1)
    result = kalman_smoother(t, fall + noise, np.broadcast_to(sd**2 * np.eye(3), (36, 3, 3)))
    assert result.acceleration[:, 2].mean() == pytest.approx(-9.81, abs=3 * result.acceleration_sd[:, 2].mean())
    assert abs(result.acceleration[:, 2].mean() + 9.81) < 0.5
    assert result.velocity[:, 2] == pytest.approx(3 - 9.81 * t, abs=0.15)


def test_deviations_are_correct_for_paths_of_the_model():
    rng, n, ratios = np.random.default_rng(5), 40, {"value": [], "velocity": []}
    t, T, sd = np.arange(n) / RATE, 1 / RATE, 0.01
    F = np.array([[1, T, T * T / 2], [0, 1, T], [0, 0, 1]])
    Q = 2e3 * np.array([[T**5 / 20, T**4 / 8, T**3 / 6], [T**4 / 8, T**3 / 3, T**2 / 2], [T**3 / 6, T**2 / 2, T]])
    root, noise = np.linalg.cholesky(Q), np.linalg.cholesky(error_covariance(t, np.full(n, sd**2)))
    for _ in range(40):
        states = [np.array([0.0, 1.0, -5.0])]
        for _ in range(n - 1):
            states.append(F @ states[-1] + root @ rng.normal(size=3))
        truth = np.array(states)
        result = kalman_smoother(t, (truth[:, 0] + noise @ rng.normal(size=n))[:, None], np.full((n, 1, 1), sd**2))
        ratios["value"].append((result.value[:, 0] - truth[:, 0]) / result.value_sd[:, 0])
        ratios["velocity"].append((result.velocity[:, 0] - truth[:, 1]) / result.velocity_sd[:, 0])
    for ratio in ratios.values():
        assert np.sqrt(np.mean(np.square(ratio))) == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize(
    "smoother",
    [kalman_smoother, spline_smoother, partial(butterworth_smoother, cutoff_hz=8)],
    ids=["kalman", "spline", "8 Hz"],
)
def test_slow_errors_pass_into_the_result_and_its_deviations(smoother):
    rng, n, sd, fast_share = np.random.default_rng(7), 60, 0.02, 0.002
    t = np.arange(n) / RATE
    _, slow = error_correlations(t, 0.0)
    root = np.linalg.cholesky(slow + 1e-9 * np.eye(n))
    ratios = []
    for _ in range(30):
        error = sd * (np.sqrt(1 - fast_share) * root @ rng.normal(size=n) + np.sqrt(fast_share) * rng.normal(size=n))
        stated = np.full((n, 1, 1), sd**2)
        result = smoother(t, (2 * t + error)[:, None], stated, are_errors_slow=True)
        errors = result.value[:, 0] - 2 * t, result.velocity[:, 0] - 2, result.acceleration[:, 0]
        sds = result.value_sd, result.velocity_sd, result.acceleration_sd
        ratios.append([each[4:-4] / of_it[4:-4, 0] for each, of_it in zip(errors, sds, strict=True)])
    assert np.sqrt(np.mean(np.square(ratios), axis=(0, 2))) == pytest.approx(np.ones(3), abs=0.25)


def test_a_direction_that_nothing_shows_rests_on_the_others():
    t, z, variance = problem()
    covariance = (variance[:, None, None] * np.eye(2)).copy()
    covariance[5] = np.diag([np.inf, variance[5]])
    values = np.stack([z, z], axis=1)
    values[5, 0] += 3.0
    result = kalman_smoother(t, values, covariance)
    assert result.value[5, 0] == pytest.approx(np.sin(8 * t[5]), abs=0.05)
    assert result.value_sd[5, 0] > result.value_sd[5, 1]


def test_rows_without_a_covariance_do_not_count_and_none_at_all_is_unknown():
    t, z, variance = problem()
    covariance = variance[:, None, None].copy()
    covariance[5] = np.nan
    spoilt = z.copy()
    spoilt[5] += 100.0
    assert np.array_equal(
        kalman_smoother(t, z[:, None], covariance).value, kalman_smoother(t, spoilt[:, None], covariance).value
    )
    assert np.isnan(kalman_smoother(t, z[:, None], np.full((25, 1, 1), np.nan)).value).all()


def test_a_covariance_that_rounding_made_negative_still_counts():
    t, z, variance = problem()
    values = np.stack([z, z], axis=1)
    flat = variance[:, None, None] * np.ones((2, 2)) - 1e-14 * np.eye(2)
    assert np.linalg.eigvalsh(flat).min() < 0
    assert np.isfinite(kalman_smoother(t, values, flat).value).all()
