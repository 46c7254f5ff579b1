"""Distances between the points of a player's legs, as log-likelihoods (block-jump paper, equation 13).

The paper names the distances but not their densities; each term is in nats, 0 at best, so that terms add to each other
and to the colours' log-likelihood.
"""

from __future__ import annotations

import numpy as np

from airborne.types import Array

LENGTH_SD_M, TORSO_LENGTH_SD_M = 0.03, 0.05  # of rods; of the distance from the torso to the hips
_GAP_SD_M, GAP_LEAST_M = 0.15, 0.08  # of the distances between the knees and between the feet
# width of the step of probability toward another player; how near that one must be
_OTHER_SCALE_M, _OTHER_REACH_M = 0.10, 1.5
_OVERLAP_NATS = -50.0  # nats for overlapping legs; finite, so that bad hypotheses can still be ranked


def length_term(distance_m: Array, expected_m: float, sd_m: float = LENGTH_SD_M) -> Array:
    """Score lengths (...) that should be constant: a Gaussian."""
    return -0.5 * np.square((np.asarray(distance_m) - expected_m) / sd_m)


def gap_term(distance_m: Array, expected_m: float) -> Array:
    """Score distances (...) between knees or feet: a wide Gaussian about the first frame's, with a floor at 0.08 m."""
    distance_m = np.asarray(distance_m)
    return length_term(distance_m, expected_m, _GAP_SD_M) + np.where(distance_m < GAP_LEAST_M, _OVERLAP_NATS, 0.0)


def position_term(points: Array, previous: Array, sd_m: float) -> Array:
    """Score points (..., 3) by their distance from the previous point (3,), as shifted by the caller: a Gaussian."""
    return -0.5 * np.sum(np.square(points - previous), axis=-1) / sd_m**2


def ownership_term(points: Array, own_torso: Array, other_torsos: Array) -> Array:
    """Score points (..., 3) by whose torso they hang from: log sigmoid((d_other - d_own) / 0.10 m).

    d is the distance to the vertical axis that ends at a torso; d_other is the nearest of the others (k, 3) within
    1.5 m of the own torso (3,). Without one it is 0.
    """
    near = np.hypot(*(other_torsos - own_torso)[:, :2].T) < _OTHER_REACH_M
    if not near.any():
        return np.zeros(np.shape(points)[:-1])
    d_other = np.min([_from_axis(points, torso) for torso in other_torsos[near]], axis=0)
    return -np.logaddexp(0.0, (_from_axis(points, own_torso) - d_other) / _OTHER_SCALE_M)


def _from_axis(points: Array, top: Array) -> Array:
    away = points - top
    return np.sqrt(away[..., 0] ** 2 + away[..., 1] ** 2 + np.maximum(away[..., 2], 0) ** 2)
