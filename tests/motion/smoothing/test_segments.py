"""Nothing reaches across events and gaps; gaps stay gaps unless they are to be filled."""

from functools import partial

import numpy as np
import pytest

from airborne.motion.smoothing import (
    SmoothedPaths,
    butterworth_smoother,
    kalman_smoother,
    smooth_stretches,
    spline_smoother,
)

RATE = 50.0
METHODS = {
    "butterworth": partial(butterworth_smoother, cutoff_hz=8),
    "spline": spline_smoother,
    "kalman": kalman_smoother,
}


def wave(n=70, sd=1e-3, seed=0):
    t = np.arange(n) / RATE
    values = np.stack([np.sin(2 * np.pi * t), np.cos(3 * t)], axis=1)
    noisy = values + sd * np.random.default_rng(seed).normal(size=values.shape)
    return t, values, noisy, np.broadcast_to(sd**2 * np.eye(2), (n, 2, 2))


@pytest.mark.parametrize("name", METHODS)
def test_gaps_stay_gaps_unless_asked(name):
    t, _, noisy, covariance = wave()
    noisy[40:44] = np.nan
    pieces = smooth_stretches(METHODS[name], t, noisy, covariance)
    assert np.isnan(pieces.paths.value[40:44]).all()
    assert np.isfinite(pieces.paths.value[[39, 44]]).all()
    assert not pieces.is_filled.any()


@pytest.mark.parametrize("name", METHODS)
def test_gaps_are_filled_with_the_motion_and_not_with_the_last_value(name):
    t, values, noisy, covariance = wave()
    noisy[40:44] = np.nan
    pieces = smooth_stretches(METHODS[name], t, noisy, covariance, fill_s=0.08)
    assert np.flatnonzero(pieces.is_filled).tolist() == [40, 41, 42, 43]
    assert pieces.paths.value[40:44] == pytest.approx(values[40:44], abs=0.02)
    assert np.abs(values[39] - values[43]).max() > 0.1
    assert (pieces.paths.value_sd[41:43] > 1.1 * pieces.paths.value_sd[20]).all()


@pytest.mark.parametrize("name", METHODS)
def test_what_lies_beyond_an_event_or_a_gap_does_not_matter(name):
    t, _, noisy, covariance = wave()
    noisy[60:66] = np.nan
    other = noisy.copy()
    other[:30] += 5.0
    other[66:] *= -1.0
    result = [
        smooth_stretches(METHODS[name], t, one, covariance, boundaries_s=[0.6], fill_s=0.05) for one in (noisy, other)
    ]
    middle = slice(30, 60)
    for field in ("value", "velocity", "acceleration", "value_sd"):
        one, two = (getattr(each.paths, field)[middle] for each in result)
        assert np.array_equal(one, two, equal_nan=True)


def test_a_gap_across_an_event_is_not_filled():
    t, _, noisy, covariance = wave()
    noisy[29:32] = np.nan
    pieces = smooth_stretches(METHODS["butterworth"], t, noisy, covariance, boundaries_s=[0.6], fill_s=0.2)
    assert not pieces.is_filled.any()
    assert np.isnan(pieces.paths.value[29:32]).all()


def test_ends_are_never_filled():
    t, _, noisy, covariance = wave()
    noisy[:3] = noisy[-2:] = np.nan
    pieces = smooth_stretches(METHODS["spline"], t, noisy, covariance, fill_s=0.5)
    assert np.isnan(pieces.paths.value[[0, 1, 2, -2, -1]]).all()


def test_stretches_of_fewer_than_five_frames_stay_unknown():
    t, _, noisy, covariance = wave(20)
    noisy[4] = np.nan
    pieces = smooth_stretches(METHODS["butterworth"], t, noisy, covariance)
    assert np.isnan(pieces.paths.value[:5]).all()
    assert np.isfinite(pieces.paths.value[5:]).all()


def test_frames_that_are_missing_from_the_table_end_a_stretch_too():
    t, _, noisy, covariance = wave(60)
    rows = np.r_[0:20, 26:60]
    pieces = smooth_stretches(METHODS["butterworth"], t[rows], noisy[rows], covariance[rows])
    alone = smooth_stretches(METHODS["butterworth"], t[:20], noisy[:20], covariance[:20])
    assert np.array_equal(pieces.paths.value[:20], alone.paths.value)


@pytest.mark.parametrize("n", [0, 1, 4])
def test_too_little_to_smooth_is_unknown(n):
    def never(*_):
        raise AssertionError

    pieces = smooth_stretches(never, np.arange(n) / RATE, np.zeros((n, 3)), np.zeros((n, 3, 3)))
    assert np.isnan(pieces.paths.value).all()
    assert pieces.paths.value.shape == (n, 3)
    assert isinstance(pieces.paths, SmoothedPaths)
