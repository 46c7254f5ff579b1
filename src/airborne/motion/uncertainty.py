"""First-order propagation of variances where some directions are unobserved (infinite) or unknown (NaN)."""

from __future__ import annotations

import numpy as np

from airborne.types import Array

_NEGLIGIBLE = 1e-9  # derivatives below this (m/rad, rad/rad) are rounding errors


def propagate_variances(jacobian: Array, covariance: Array) -> Array:
    """Return the variances (...) of quantities with gradients `jacobian` (..., d), for a covariance (d, d).

    First order. An infinite or unknown (NaN) variance affects only quantities that depend on that direction; those
    that depend on an unknown one are NaN.
    """
    if np.isfinite(covariance).all():
        variance = np.sum(jacobian @ covariance * jacobian, axis=-1)
    else:
        variance = _propagate_with_unknowns(np.where(np.abs(jacobian) < _NEGLIGIBLE, 0.0, jacobian), covariance)
    return np.where(variance >= 0, variance, np.nan)


def _propagate_with_unknowns(jacobian: Array, covariance: Array) -> Array:
    is_finite = np.isfinite(covariance).all(axis=0)
    finite, other = jacobian[..., is_finite], jacobian[..., ~is_finite]
    variance = np.sum(finite @ covariance[np.ix_(is_finite, is_finite)] * finite, axis=-1)
    with np.errstate(invalid="ignore"):
        for a, b, block in (
            (other, other, covariance[np.ix_(~is_finite, ~is_finite)]),
            (other, finite, 2 * covariance[np.ix_(~is_finite, is_finite)]),
        ):
            weight = a[..., :, None] * b[..., None, :]
            variance = variance + np.where(weight == 0, 0.0, weight * block).sum(axis=(-2, -1))
    return variance


def standard_deviation(variance: Array) -> Array:
    """Return standard deviations; NaN where rounding made a variance negative."""
    return np.sqrt(np.where(variance >= 0, variance, np.nan))
