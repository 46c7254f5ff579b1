"""The zero-lag Butterworth low-pass: second order, once forward and once back, its cut-off corrected for both passes.

Two passes square the gain, so each must let through 2**-1/4 at the asked cut-off. For a Butterworth filter of any
order that is a factor (2**(1/passes) - 1)**(1/(2 order)) on the cut-off, 0.802 for the usual fourth-order zero-lag
filter. Source: Robertson and Dowling 2003, "Design and responses of Butterworth and critically damped digital filters";
Winter, "Biomechanics and Motor Control of Human Movement", section on digital filtering. Without the correction 6 Hz is
really 4.8.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, make_interp_spline
from scipy.signal import butter, sosfiltfilt

from airborne.errors import ResultError
from airborne.motion.smoothing.propagation import applied
from airborne.motion.smoothing.segments import Smoothed

Array = NDArray[np.floating]

ORDER, PASSES = 2, 2
_MOST_TIMES = 4  # the usual rate, to which uneven frames are resampled
UNEVEN = 0.05  # of a period, by which a step in time may differ from the others


def correction(order: int = ORDER, passes: int = PASSES) -> float:
    """Return the ratio of the asked cut-off to that of each pass, in analogue frequency: 0.802 for 2 and 2."""
    return (2 ** (1 / passes) - 1) ** (1 / (2 * order))


def pass_cutoff_hz(cutoff_hz: float, rate_hz: float) -> float:
    """Return the cut-off of each pass [Hz] so that both together are down by 3 dB at `cutoff_hz` exactly.

    The correction is made to the analogue frequencies, tan(pi f / rate), which the bilinear transform turns into the
    digital ones; well below the rate that is cutoff / 0.802. Raises ResultError for one that the rate cannot have.
    """
    if not 0 < cutoff_hz < rate_hz / 2:
        raise ResultError(
            f"a cut-off of {cutoff_hz:g} Hz is not possible at {rate_hz:.6g} frames a second; "
            f"give one above 0 and below {rate_hz / 2:.4g} Hz"
        )
    return float(rate_hz / np.pi * np.arctan(np.tan(np.pi * cutoff_hz / rate_hz) / correction()))


def low_pass(values: Array, *, cutoff_hz: float, rate_hz: float) -> Array:
    """Filter evenly sampled values (n, ...) along their first axis without delay.

    At both ends the values go on for 1 / cut-off s, at most n - 1 frames: the parabola that fits the whole stretch best
    goes on as it is, and what is left is mirrored through its end point (odd). The filter lets cubics pass unchanged,
    so that away from the ends the parabola makes no difference, and free fall is kept up to the ends. Raises
    ResultError for a cut-off that the rate cannot have.
    """
    sections = butter(ORDER, pass_cutoff_hz(cutoff_hz, rate_hz), fs=rate_hz, output="sos")
    u = np.linspace(-1, 1, len(values))
    terms = np.vander(u, min(3, len(values)))
    flat = values.reshape(len(values), -1)
    parabola = terms @ np.linalg.lstsq(terms, flat, rcond=None)[0]
    n_padding = min(round(rate_hz / cutoff_hz), len(values) - 1)
    filtered = sosfiltfilt(sections, flat - parabola, axis=0, padtype="odd", padlen=n_padding)
    return np.asarray(filtered + parabola).reshape(values.shape)


def is_even(time_s: Array) -> bool:
    """Say whether times (n,) come evenly, each step within 5 % of the usual one."""
    if len(time_s) < 2:
        return False
    steps = np.diff(time_s)
    period = float(np.median(steps))
    return bool(np.abs(steps - period).max() <= UNEVEN * period)


def butterworth(
    time_s: Array, values: Array, covariance: Array, *, cutoff_hz: float, resample_hz: float | None = None
) -> Smoothed:
    """Smooth one stretch (n, k) with a zero-lag Butterworth filter; see `Smoother`.

    Missing rows are first interpolated by a cubic spline through the known ones. Derivatives are those of the fifth
    degree spline through the filtered values. Times that are not even are refused, unless `resample_hz` says at which
    rate a cubic spline through the values is filtered instead. Raises ResultError for those, and for an impossible
    cut-off.
    """
    even_s = _even_times(time_s, resample_hz)
    rate_hz = (len(even_s) - 1) / float(even_s[-1] - even_s[0])

    def operator(known_s: Array, values: Array, at_s: Array) -> Array:
        inside_s = even_s[(even_s >= at_s[0] - 1e-9) & (even_s <= at_s[-1] + 1e-9)]
        is_whole = len(known_s) == len(inside_s) and resample_hz is None
        even = values if is_whole else CubicSpline(known_s, values)(inside_s)
        return _with_derivatives(inside_s, low_pass(even, cutoff_hz=cutoff_hz, rate_hz=rate_hz), at_s)

    return applied(operator, time_s, values, covariance)


def _with_derivatives(even_s: Array, filtered: Array, at_s: Array) -> Array:
    degree = 5 if len(even_s) > 5 else 3
    spline = make_interp_spline(even_s, filtered, k=degree)
    return np.stack([spline(at_s), spline(at_s, 1), spline(at_s, 2)])


def _even_times(time_s: Array, resample_hz: float | None) -> Array:
    if resample_hz is not None:
        usual_hz = 1 / float(np.median(np.diff(time_s)))
        if not 0 < resample_hz <= _MOST_TIMES * usual_hz:
            raise ResultError(
                f"frames that come {usual_hz:.4g} times a second cannot be resampled to {resample_hz:g} Hz; "
                f"give a rate above 0 and up to {_MOST_TIMES * usual_hz:.4g} Hz"
            )
        n = max(round(float(time_s[-1] - time_s[0]) * resample_hz) + 1, 5)
        return np.linspace(time_s[0], time_s[-1], n)
    steps = np.diff(time_s)
    period = float(np.median(steps))
    if not is_even(time_s):
        raise ResultError(
            f"frames come {1e3 * steps.min():.4g} to {1e3 * steps.max():.4g} ms after one another, and a Butterworth "
            f"filter needs even times; resample to {1 / period:.4g} Hz, or use a spline or the Kalman smoother"
        )
    return time_s
