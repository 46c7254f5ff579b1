"""The zero-lag Butterworth filter: its cut-off is the asked one, its ends are not bent, uneven times are refused."""

from functools import partial

import numpy as np
import pytest
from scipy.signal import butter, filtfilt

from airborne.errors import ResultError
from airborne.motion.smoothing import (
    butterworth_smoother,
    cutoff_correction,
    is_evenly_sampled,
    low_pass,
    pass_cutoff_hz,
    smooth_stretches,
)
from airborne.motion.smoothing.kalman import error_correlations, path_errors
from tests.support.tolerances import EXACT, ROUNDTRIP, SOLVED, sampled

RATE = 60.0
G = 9.81


def times(n=240, rate=RATE):
    return np.arange(n) / rate


def unknown(values):
    return np.full((*values.shape, values.shape[1]), np.nan)


@pytest.mark.parametrize("cutoff", [1.0, 6.0, 12.0, 25.0])
def test_both_passes_together_are_down_by_3_db_at_the_asked_cutoff(cutoff):
    wave = np.sin(2 * np.pi * cutoff * times(6000))
    passed = low_pass(wave, cutoff_hz=cutoff, rate_hz=RATE)
    inside = slice(2000, 4000)
    assert passed[inside] @ wave[inside] / (wave[inside] @ wave[inside]) == pytest.approx(2**-0.5, abs=1e-5)


def test_an_uncorrected_filter_of_6_hz_would_really_be_one_of_4_8():
    assert cutoff_correction() == pytest.approx(0.802, abs=5e-4)
    assert 6 * cutoff_correction() == pytest.approx(4.8, abs=0.02)


@pytest.mark.parametrize(("order", "passes", "factor"), [(2, 1, 1.0), (2, 2, 0.8022), (4, 2, 0.8957), (2, 4, 0.6596)])
def test_the_correction_is_the_general_formula(order, passes, factor):
    assert cutoff_correction(order, passes) == pytest.approx(factor, abs=1e-4)


def test_far_below_the_rate_each_pass_has_the_cutoff_over_0_802():
    assert pass_cutoff_hz(6, 6000) == pytest.approx(6 / cutoff_correction(), rel=1e-4)


def test_it_is_scipys_filtfilt_of_what_a_parabola_leaves():
    rng = np.random.default_rng(0)
    values = rng.normal(size=(80, 3))
    b, a = butter(2, pass_cutoff_hz(6, RATE), fs=RATE)
    u = np.arange(80) - 39.5
    parabola = np.stack([np.polyval(np.polyfit(u, column, 2), u) for column in values.T], axis=1)
    expected = parabola + filtfilt(b, a, values - parabola, axis=0, padtype="odd", padlen=15)
    assert low_pass(values, cutoff_hz=6, rate_hz=RATE) == pytest.approx(expected, abs=ROUNDTRIP)


def test_away_from_the_ends_it_is_plain_filtfilt():
    rng = np.random.default_rng(1)
    values = np.cumsum(rng.normal(size=600))
    b, a = butter(2, pass_cutoff_hz(6, RATE), fs=RATE)
    plain = filtfilt(b, a, values)
    assert low_pass(values, cutoff_hz=6, rate_hz=RATE)[150:450] == pytest.approx(plain[150:450], abs=1e-6)


def test_a_parabola_passes_unchanged_up_to_its_ends_with_both_derivatives():
    t = times(31)
    fall = (1 + 3 * t - G / 2 * t**2)[:, None]
    result = butterworth_smoother(t, fall, unknown(fall), cutoff_hz=6)
    assert result.value == pytest.approx(fall, abs=ROUNDTRIP)
    assert result.velocity[:, 0] == pytest.approx(3 - G * t, abs=1e-7)
    assert result.acceleration[:, 0] == pytest.approx(np.full(31, -G), abs=1e-4)


def test_derivatives_of_a_slow_sine_are_those_of_calculus():
    t, w = times(600), 2 * np.pi
    wave = np.sin(w * t)[:, None]
    result = butterworth_smoother(t, wave, unknown(wave), cutoff_hz=12)
    inside = slice(100, 500)
    assert result.velocity[inside, 0] == pytest.approx(w * np.cos(w * t)[inside], abs=SOLVED * w)
    assert result.acceleration[inside, 0] == pytest.approx(-(w**2) * np.sin(w * t)[inside], abs=SOLVED * w**2)


@pytest.mark.parametrize("cutoff", [0.0, -1.0, 30.0, 31.0, np.nan, np.inf])
def test_a_cutoff_that_the_rate_cannot_have_is_refused(cutoff):
    with pytest.raises(ResultError, match="below 30 Hz"):
        low_pass(np.zeros((20, 1)), cutoff_hz=cutoff, rate_hz=RATE)


def test_uneven_times_are_refused_and_resampled_on_request():
    t = np.delete(times(60), [20, 21])
    wave = np.sin(2 * np.pi * t)[:, None]
    assert not is_evenly_sampled(t)
    with pytest.raises(ResultError, match=r"16\.67 to 50 ms"):
        butterworth_smoother(t, wave, unknown(wave), cutoff_hz=6)
    result = butterworth_smoother(t, wave, unknown(wave), cutoff_hz=12, resample_hz=60)
    assert result.value[10:-10] == pytest.approx(wave[10:-10], abs=2e-4)


@pytest.mark.parametrize("rate", [0.0, -1.0, np.nan, 1e12])
def test_a_rate_that_makes_no_sense_is_refused(rate):
    wave = np.zeros((20, 1))
    with pytest.raises(ResultError, match="up to 240 Hz"):
        butterworth_smoother(times(20), wave, unknown(wave), cutoff_hz=6, resample_hz=rate)


def test_stated_deviations_are_those_of_many_draws():
    rng, t, runs = np.random.default_rng(2), times(40), 800
    sd = np.linspace(1.0, 3.0, 40)
    covariance = (sd**2)[:, None, None] * np.ones((1, 1, 1))
    path = rng.standard_normal((40, 1))
    stated = butterworth_smoother(t, path, covariance, cutoff_hz=6)
    errors = path_errors(t, path, covariance, are_slow=False)
    assert errors is not None
    fast, _ = error_correlations(t, errors.white_share)
    noise = sd[:, None] * np.linalg.cholesky(fast) @ rng.standard_normal((40, runs))
    many = butterworth_smoother(t, noise, np.full((40, runs, runs), np.nan), cutoff_hz=6)
    for name in ("value", "velocity", "acceleration"):
        ratio = getattr(many, name).std(axis=1) / getattr(stated, f"{name}_sd")[:, 0]
        assert ratio == pytest.approx(np.ones(40), abs=1.5 * sampled(runs))


def test_long_stretches_get_the_same_deviations_as_one_block():
    t = times(700)
    values, covariance = np.zeros((700, 1)), np.ones((700, 1, 1))
    long = butterworth_smoother(t, values, covariance, cutoff_hz=6)
    short = butterworth_smoother(t[:120], values[:120], covariance[:120], cutoff_hz=6)
    assert long.acceleration_sd[:40] == pytest.approx(short.acceleration_sd[:40], rel=1e-3)
    assert long.value_sd[100:600] == pytest.approx(np.full((500, 1), long.value_sd[350, 0]), rel=1e-6)


def test_where_the_noise_is_not_known_the_deviation_is_not_either():
    covariance = np.ones((60, 1, 1))
    covariance[30] = np.inf
    result = butterworth_smoother(times(60), np.zeros((60, 1)), covariance, cutoff_hz=6)
    assert np.isnan(result.value_sd[28:33]).all()
    assert np.isfinite(result.value_sd[:10]).all()
    assert result.value == pytest.approx(np.zeros((60, 1)), abs=EXACT)


def test_a_step_at_takeoff_is_not_smeared():
    t = times(60)
    step = np.where(t < 0.5, 0.0, 1.0)[:, None]
    pieces = smooth_stretches(partial(butterworth_smoother, cutoff_hz=6), t, step, unknown(step), boundaries_s=[0.5])
    assert pieces.paths.value == pytest.approx(step, abs=ROUNDTRIP)
    assert pieces.segment.tolist() == [0] * 30 + [1] * 30
    across = smooth_stretches(partial(butterworth_smoother, cutoff_hz=6), t, step, unknown(step))
    assert np.abs(across.paths.value - step).max() > 0.2
