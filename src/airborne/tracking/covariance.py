"""From the curvature of a score to a covariance that says what the pictures do not show."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

SHIFT_SD_PX = 0.12  # of a full frame: light and edges that are not quite as modelled may displace a picture by this
LEVER_M = 0.3  # the length that makes metres and radians comparable
_UNSEEN_SD_M = 0.15  # a direction known less well than this, at the lever's length, is not known


def covariance_of(curvature: Array, *, noise: float, spread: Array | None = None) -> Array:
    """Return the covariance (d, d) of a position (3,) [m] and rotation vectors [rad].

    curvature (d, d): half the second derivative of the summed squares; noise: their variance, already multiplied by how
    many pixels share it. `spread` (d, d) is the sum of g g' over patches of the pictures, g the gradient: along each
    principal direction the larger of two variances holds, that of independent noise and that of the patches (the
    sandwich estimate), which also counts wrong light and wrong shape. A direction with an sd above 0.15 m, or above
    0.5 rad, counts as not seen: what it touches has an infinite variance.
    """
    scale = np.where(np.arange(len(curvature)) < 3, 1, 1 / LEVER_M)
    steepness, directions = np.linalg.eigh(curvature * np.outer(scale, scale))
    steepness = np.maximum(steepness, 1e-12 * max(steepness[-1], 1e-12))
    variance = noise / steepness
    if spread is not None:
        along = np.einsum("ij,ik,kj->j", directions, spread * np.outer(scale, scale), directions)
        variance = np.maximum(variance, along / steepness**2)
    seen = variance < _UNSEEN_SD_M**2
    covariance = (directions[:, seen] * variance[seen]) @ directions[:, seen].T * np.outer(scale, scale)
    hidden = np.any(np.abs(directions[:, ~seen]) > 0.1, axis=1)
    covariance[hidden] = covariance[:, hidden] = 0
    covariance[hidden, hidden] = np.inf
    return (covariance + covariance.T) / 2
