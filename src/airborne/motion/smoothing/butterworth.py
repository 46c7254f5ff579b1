"""The zero-lag Butterworth low-pass: second order, forward and backward, its cut-off corrected for both passes.

Two passes square the gain, so each must have a gain of 2**-1/4 at the requested cut-off. For a Butterworth filter of
any order that divides the cut-off by (2**(1/passes) - 1)**(1/(2 order)), 0.802 for the usual fourth-order zero-lag
filter. Source: Robertson and Dowling 2003, "Design and responses of Butterworth and critically damped digital filters";
Winter, "Biomechanics and Motor Control of Human Movement", section on digital filtering. Without the correction 6 Hz is
actually 4.8 Hz.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline, make_interp_spline

from airborne.errors import ResultError
from airborne.motion.smoothing.kalman import path_errors
from airborne.motion.smoothing.propagation import apply_operator
from airborne.motion.smoothing.segments import SmoothedPaths
from airborne.types import Array

_ORDER, _PASSES = 2, 2  # second order, forward and back: no lag
_LARGEST_UPSAMPLING = 4  # the median rate, to which uneven frames may be resampled
# frames; chosen: with fewer, residuals of two recorded people and a synthetic one rise with the cut-off where that
# number changes, by up to 0.4 mm; with 15 they always fall
_LEAST_PADDING = 15
UNEVEN = 0.05  # of a period: tolerance of time steps


def cutoff_correction(order: int = _ORDER, passes: int = _PASSES) -> float:
    """Return the ratio of the requested cut-off to that of each pass, in analogue frequency: 0.802 for 2 and 2."""
    return (2 ** (1 / passes) - 1) ** (1 / (2 * order))


def pass_cutoff_hz(cutoff_hz: float, rate_hz: float) -> float:
    """Return the cut-off of each pass [Hz] so that both together are down by 3 dB at `cutoff_hz` exactly.

    The correction applies to the analogue frequencies, tan(pi f / rate), which the bilinear transform maps to the
    digital ones; well below the rate that is cutoff / 0.802. Raises ResultError for a cut-off not below half the rate.
    """
    if not 0 < cutoff_hz < rate_hz / 2:
        raise ResultError(
            f"a cut-off of {cutoff_hz:g} Hz is not possible at {rate_hz:.6g} frames a second; "
            f"give one above 0 and below {rate_hz / 2:.4g} Hz"
        )
    return float(rate_hz / np.pi * np.arctan(np.tan(np.pi * cutoff_hz / rate_hz) / cutoff_correction()))


def low_pass(values: Array, *, cutoff_hz: float, rate_hz: float) -> Array:
    """Filter evenly sampled values (n, ...) along their first axis without delay.

    Both ends are padded by 1 / cut-off s, 15 to n - 1 frames: the parabola that best fits the whole stretch is
    extrapolated, and the residual is reflected through its end point (odd). The filter leaves cubics unchanged, so
    that the parabola makes no difference away from the ends, and free fall is preserved up to the ends. Raises
    ResultError for a cut-off not below half the rate.
    """
    from scipy.signal import sosfiltfilt  # takes a third of a second to load

    sections = _sections(cutoff_hz, rate_hz)
    u = np.linspace(-1, 1, len(values))
    terms = np.vander(u, min(3, len(values)))
    flat = values.reshape(len(values), -1)
    parabola = terms @ np.linalg.lstsq(terms, flat, rcond=None)[0]
    n_padding = min(max(round(rate_hz / cutoff_hz), _LEAST_PADDING), len(values) - 1)
    filtered = sosfiltfilt(sections, flat - parabola, axis=0, padtype="odd", padlen=n_padding)
    return np.asarray(filtered + parabola).reshape(values.shape)


@lru_cache(maxsize=256)  # a residual analysis filters every path at the same cut-offs
def _sections(cutoff_hz: float, rate_hz: float) -> Array:
    """Return the second-order sections of each pass."""
    from scipy.signal import butter

    return butter(_ORDER, pass_cutoff_hz(cutoff_hz, rate_hz), fs=rate_hz, output="sos")


def is_evenly_sampled(time_s: Array) -> bool:
    """Tell whether times (n,) are evenly spaced, each step within 5 % of the median."""
    if len(time_s) < 2:
        return False
    steps = np.diff(time_s)
    period = float(np.median(steps))
    return bool(np.abs(steps - period).max() <= UNEVEN * period)


def butterworth_smoother(
    time_s: Array,
    values: Array,
    covariance: Array,
    *,
    cutoff_hz: float,
    resample_hz: float | None = None,
    are_errors_slow: bool = False,
) -> SmoothedPaths:
    """Smooth one stretch (n, k) with a zero-lag Butterworth filter; see `Smoother`.

    Missing rows are first interpolated by a cubic spline through the known ones. Derivatives are those of the quintic
    spline through the filtered values. With `resample_hz`, a cubic spline through the values is resampled at that rate
    and filtered instead. Raises ResultError for uneven times without it, and for an impossible cut-off.
    """
    even_s = _even_times(time_s, resample_hz)
    rate_hz = (len(even_s) - 1) / float(even_s[-1] - even_s[0])

    def operator(known_s: Array, values: Array, at_s: Array) -> Array:
        inside_s = even_s[(even_s >= at_s[0] - 1e-9) & (even_s <= at_s[-1] + 1e-9)]
        is_complete = len(known_s) == len(inside_s) and resample_hz is None
        even = values if is_complete else CubicSpline(known_s, values)(inside_s)
        return _with_derivatives(inside_s, low_pass(even, cutoff_hz=cutoff_hz, rate_hz=rate_hz), at_s)

    errors = path_errors(time_s, values, covariance, are_slow=are_errors_slow)
    return apply_operator(operator, time_s, values, covariance, errors=errors)


def _with_derivatives(even_s: Array, filtered: Array, at_s: Array) -> Array:
    degree = 5 if len(even_s) > 5 else 3
    spline = make_interp_spline(even_s, filtered, k=degree)
    return np.stack([spline(at_s), spline(at_s, 1), spline(at_s, 2)])


def _even_times(time_s: Array, resample_hz: float | None) -> Array:
    if resample_hz is not None:
        median_hz = 1 / float(np.median(np.diff(time_s)))
        if not 0 < resample_hz <= _LARGEST_UPSAMPLING * median_hz:
            raise ResultError(
                f"frames that come {median_hz:.4g} times a second cannot be resampled to {resample_hz:g} Hz; "
                f"give a rate above 0 and up to {_LARGEST_UPSAMPLING * median_hz:.4g} Hz"
            )
        n = max(round(float(time_s[-1] - time_s[0]) * resample_hz) + 1, 5)
        return np.linspace(time_s[0], time_s[-1], n)
    steps = np.diff(time_s)
    period = float(np.median(steps))
    if not is_evenly_sampled(time_s):
        raise ResultError(
            f"frames come {1e3 * steps.min():.4g} to {1e3 * steps.max():.4g} ms apart, but a Butterworth "
            f"filter needs even times; resample to {1 / period:.4g} Hz, or use a spline or the Kalman smoother"
        )
    return time_s
