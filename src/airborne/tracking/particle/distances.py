"""Distances between the points of a player's legs, as log-likelihoods (block-jump paper, equation 13).

The paper names the distances and prints no form; all are in nats and 0 at best, so that they add to each other and to
the colours' log-likelihood.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

LENGTH_SD_M, TORSO_LENGTH_SD_M = 0.03, 0.05  # of rods; of the distance from the torso to the hips
GAP_SD_M, GAP_LEAST_M = 0.15, 0.08  # of the distances between the knees and between the feet
OTHER_SCALE_M, OTHER_REACH_M = 0.10, 1.5
_TOO_NEAR = -50.0  # nats for legs inside each other; finite, so that the best of bad hypotheses still has a name


def length(distance_m: Array, expected_m: float, sd_m: float = LENGTH_SD_M) -> Array:
    """Score lengths (...) that should be constant: a Gaussian."""
    return -0.5 * np.square((np.asarray(distance_m) - expected_m) / sd_m)


def gap(distance_m: Array, expected_m: float) -> Array:
    """Score distances (...) between the two knees or feet: wide about the first frame's, with a floor at 0.08 m."""
    distance_m = np.asarray(distance_m)
    return length(distance_m, expected_m, GAP_SD_M) + np.where(distance_m < GAP_LEAST_M, _TOO_NEAR, 0.0)


def stay(points: Array, previous: Array, sd_m: float) -> Array:
    """Score points (..., 3) by their distance from where they were (3,), shifted as the caller expects: a Gaussian."""
    return -0.5 * np.sum(np.square(points - previous), axis=-1) / sd_m**2


def own_not_others(points: Array, own_torso: Array, other_torsos: Array) -> Array:
    """Score points (..., 3) by whose torso they hang under: log sigmoid((d_other - d_own) / 0.10 m).

    d is the distance to the vertical axis that ends at a torso; d_other is the nearest of the others (k, 3) within
    1.5 m of the own torso (3,). Without one it is 0.
    """
    near = np.hypot(*(other_torsos - own_torso)[:, :2].T) < OTHER_REACH_M
    if not near.any():
        return np.zeros(np.shape(points)[:-1])
    d_other = np.min([_from_axis(points, torso) for torso in other_torsos[near]], axis=0)
    return -np.logaddexp(0.0, (_from_axis(points, own_torso) - d_other) / OTHER_SCALE_M)


def _from_axis(points: Array, top: Array) -> Array:
    away = points - top
    return np.sqrt(away[..., 0] ** 2 + away[..., 1] ** 2 + np.maximum(away[..., 2], 0) ** 2)
