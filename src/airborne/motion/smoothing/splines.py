"""Cubic smoothing splines whose smoothness is chosen by generalised cross-validation.

Source: Wahba 1990, "Spline Models for Observational Data", chapter 4; Woltring 1985, "On optimal smoothing and
derivative estimation from noisy displacement data in biomechanics". The spline is SciPy's.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_smoothing_spline

from airborne.motion.smoothing.propagation import Operator, applied
from airborne.motion.smoothing.segments import Smoothed

Array = NDArray[np.floating]

_UNIT_FRAMES = 4.0  # SciPy looks for a penalty between 0 and n: in this unit of time those of usual motions lie there
_WIDER = 4.0
_MOST_TRIES = 6
_AT_THE_END = 0.98


def spline(time_s: Array, values: Array, covariance: Array) -> Smoothed:
    """Smooth one stretch (n, k) with a cubic spline for each path, weighted by 1 / variance; see `Smoother`.

    Paths with an unknown or infinite variance anywhere are not weighted. The penalty is that of the least generalised
    cross-validation score, which takes the noise for white; missing rows are read off the spline. Its second derivative
    is zero at both ends, whatever the motion does: there the acceleration is left unknown. The deviations take the
    penalty as given.
    """
    is_known = np.isfinite(values).all(axis=1)
    variance = np.diagonal(covariance, axis1=1, axis2=2)
    parts = []
    for k in range(values.shape[1]):
        one = slice(k, k + 1)
        operator = _fitted(time_s[is_known], values[is_known, k], _weights(variance[is_known, k]))
        parts.append(applied(operator, time_s, values[:, one], covariance[:, one, one]))
    for part in parts:
        part.acceleration[[0, -1]] = part.acceleration_sd[[0, -1]] = np.nan
    return Smoothed(*(np.hstack([getattr(part, name) for part in parts]) for name in Smoothed.__slots__))


def penalty_of(at: Array, values: Array, weights: Array, found: BSpline) -> float:
    """Return the penalty that led to a smoothing spline, from what it must satisfy at its knots.

    There, penalty times the jump of the third derivative is weight times residual.
    """
    middles = (at[1:] + at[:-1]) / 2
    third = np.concatenate([[0.0], found(middles, 3), [0.0]])
    jumps = np.diff(third)
    return float((weights * (values - found(at))) @ jumps / max(float(jumps @ jumps), 1e-300))


def _fitted(all_s: Array, values: Array, weights: Array) -> Operator:
    unit_s = _UNIT_FRAMES * float(np.median(np.diff(all_s)))
    start_s, scale = float(all_s[0]), max(float(np.ptp(values)), 1e-12)
    for _ in range(_MOST_TRIES):
        at = (all_s - start_s) / unit_s
        found = make_smoothing_spline(at, values / scale, weights)
        penalty = max(penalty_of(at, values / scale, weights, found), 0.0)
        if penalty < _AT_THE_END * len(at):
            break
        unit_s *= _WIDER

    def operator(known_s: Array, values: Array, at_s: Array) -> Array:
        own = weights[np.searchsorted(all_s, known_s)]
        smooth = make_smoothing_spline((known_s - start_s) / unit_s, values, own, lam=penalty)
        u = (at_s - start_s) / unit_s
        return np.stack([smooth(u), smooth(u, 1) / unit_s, smooth(u, 2) / unit_s**2])

    return operator


def _weights(variance: Array) -> Array:
    """Return weights with a mean of one; all alike where a variance is not known."""
    if not (np.isfinite(variance) & (variance > 0)).all():
        return np.ones_like(variance)
    return (1 / variance) / np.mean(1 / variance)
