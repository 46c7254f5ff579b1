"""Variances passed on through a Jacobian, where some directions are unseen (infinite) or unknown (NaN)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

_STILL = 1e-9  # derivatives below this (m/rad, rad/rad) are rounding: the quantity does not move


def variances(jacobian: Array, covariance: Array) -> Array:
    """Return the variances (...) of quantities with gradients `jacobian` (..., d), for a covariance (d, d).

    First order. An infinite or unknown (NaN) variance counts only for quantities that move with that direction; what
    rests on an unknown one is NaN.
    """
    if np.isfinite(covariance).all():
        found = np.einsum("...i,ij,...j->...", jacobian, covariance, jacobian, optimize=True)
    else:
        found = _masked(np.where(np.abs(jacobian) < _STILL, 0.0, jacobian), covariance)
    return np.where(found >= 0, found, np.nan)


def _masked(jacobian: Array, covariance: Array) -> Array:
    is_sound = np.isfinite(covariance).all(axis=0)
    sound, odd = jacobian[..., is_sound], jacobian[..., ~is_sound]
    found = np.einsum("...i,ij,...j->...", sound, covariance[np.ix_(is_sound, is_sound)], sound, optimize=True)
    with np.errstate(invalid="ignore"):
        for a, b, share in (
            (odd, odd, covariance[np.ix_(~is_sound, ~is_sound)]),
            (odd, sound, 2 * covariance[np.ix_(~is_sound, is_sound)]),
        ):
            weight = a[..., :, None] * b[..., None, :]
            found = found + np.where(weight == 0, 0.0, weight * share).sum(axis=(-2, -1))
    return found


def deviation(variance: Array) -> Array:
    """Return standard deviations; NaN where a variance is negative, as rounding can make it."""
    return np.sqrt(np.where(variance >= 0, variance, np.nan))
