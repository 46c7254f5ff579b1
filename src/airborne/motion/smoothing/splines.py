"""Cubic smoothing splines, their penalty chosen by generalised cross-validation.

Source: Wahba 1990, "Spline Models for Observational Data", chapter 4; Woltring 1985, "On optimal smoothing and
derivative estimation from noisy displacement data in biomechanics". The spline is SciPy's.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import BSpline, make_smoothing_spline

from airborne.motion.smoothing.kalman import path_errors
from airborne.motion.smoothing.propagation import Operator, apply_operator
from airborne.motion.smoothing.segments import SmoothedPaths
from airborne.types import Array

_UNIT_FRAMES = 4.0  # unit of time: SciPy searches penalties from 0 to n, which suits usual motions in this unit
_WIDER = 4.0  # factor on the unit of time where the penalty lies at the end of its range
_MOST_TRIES = 6  # of that
_AT_THE_END = 0.98  # share of the range of penalties


def spline_smoother(time_s: Array, values: Array, covariance: Array, *, are_errors_slow: bool = False) -> SmoothedPaths:
    """Smooth one stretch (n, k) with a cubic spline for each path, weighted by 1 / variance; see `Smoother`.

    Paths with an unknown or infinite variance anywhere are not weighted. The penalty minimises the generalised
    cross-validation score, which assumes white noise; missing rows are evaluated from the spline. Its second derivative
    is zero at both ends whatever the motion, so the acceleration is left unknown there. Standard deviations are
    conditional on the penalty.
    """
    is_known = np.isfinite(values).all(axis=1)
    variance = np.diagonal(covariance, axis1=1, axis2=2)
    errors = path_errors(time_s, values, covariance, are_slow=are_errors_slow)
    parts = []
    for k in range(values.shape[1]):
        one = slice(k, k + 1)
        operator = _fit_operator(time_s[is_known], values[is_known, k], _weights(variance[is_known, k]))
        parts.append(apply_operator(operator, time_s, values[:, one], covariance[:, one, one], errors=errors))
    for part in parts:
        part.acceleration[[0, -1]] = part.acceleration_sd[[0, -1]] = np.nan
    return SmoothedPaths(*(np.hstack([getattr(part, name) for part in parts]) for name in SmoothedPaths.__slots__))


def smoothing_penalty(at: Array, values: Array, weights: Array, spline: BSpline) -> float:
    """Return the penalty of a smoothing spline from its optimality condition.

    At each knot, penalty times the jump of the third derivative equals weight times residual.
    """
    middles = (at[1:] + at[:-1]) / 2
    third = np.concatenate([[0.0], spline(middles, 3), [0.0]])
    jumps = np.diff(third)
    return float((weights * (values - spline(at))) @ jumps / max(float(jumps @ jumps), 1e-300))


def _fit_operator(all_s: Array, values: Array, weights: Array) -> Operator:
    unit_s = _UNIT_FRAMES * float(np.median(np.diff(all_s)))
    start_s, scale = float(all_s[0]), max(float(np.ptp(values)), 1e-12)
    for _ in range(_MOST_TRIES):
        at = (all_s - start_s) / unit_s
        spline = make_smoothing_spline(at, values / scale, weights)
        penalty = max(smoothing_penalty(at, values / scale, weights, spline), 0.0)
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
    """Return weights with a mean of one; uniform where a variance is unknown."""
    if not (np.isfinite(variance) & (variance > 0)).all():
        return np.ones_like(variance)
    return (1 / variance) / np.mean(1 / variance)
