"""The residual analysis finds the noise, and a cut-off between motion and noise."""

import numpy as np
import pytest

from airborne.motion.smoothing import low_pass, residual_analysis

RATE = 60.0
T = np.arange(600) / RATE


def paths(sd, seed=0, top=2.5):
    rng = np.random.default_rng(seed)
    clean = np.stack([np.sin(2 * np.pi * f * T + f) / f for f in (0.7, 1.3, top)], axis=1)[:, None]
    return clean, clean + sd * rng.normal(size=clean.shape)


@pytest.mark.parametrize("sd", [0.002, 0.01])
def test_the_line_of_the_residuals_meets_the_axis_at_the_noise(sd):
    assert residual_analysis(T, paths(sd)[1]).noise == pytest.approx(sd, rel=0.08)


def test_the_chosen_cutoffs_lie_above_the_motion_and_do_it_good():
    clean, noisy = paths(0.01)
    result = residual_analysis(T, noisy)
    for cutoff in (result.chosen_hz, result.whitest_hz):
        assert 2.5 < cutoff < 9
        error = low_pass(noisy, cutoff_hz=cutoff, rate_hz=RATE) - clean
        assert error.std() < 0.7 * 0.01


def test_more_noise_asks_for_a_lower_cutoff():
    chosen = [residual_analysis(T, paths(sd)[1]).chosen_hz for sd in (0.001, 0.01, 0.1)]
    assert chosen[0] > chosen[1] > chosen[2]


@pytest.mark.parametrize(("n", "sd"), [(600, 0.01), (60, 0.0003)])
def test_residuals_fall_with_the_cutoff(n, sd):
    result = residual_analysis(T[:n], paths(sd)[1][:n])
    assert (np.diff(result.residual) < 0).all()
    assert result.residual[0] > 0.2
    assert result.n_values == n * 3


def test_gaps_and_events_are_kept_apart_in_it():
    _, noisy = paths(0.01)
    noisy[300:] += 3.0
    noisy[100:110] = np.nan
    cut = residual_analysis(T, noisy, boundaries_s=[[5.0]])
    assert cut.noise == pytest.approx(0.01, rel=0.15)
    assert cut.chosen_hz < residual_analysis(T, noisy).chosen_hz


def test_too_little_says_nothing():
    result = residual_analysis(T[:8], paths(0.01)[1][:8])
    assert result.n_values == 0
    assert np.isnan([result.chosen_hz, result.whitest_hz, result.noise]).all()
