"""Legs whose own pixels do not show them: a trunk in full sight must not vouch for a leg that has gone astray."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airborne.tracking.capsules.dynamics import FIRST_SPEED_SD, N_FREE, GaussianState
from airborne.tracking.capsules.jumper import CAPSULES
from airborne.types import Array

# of a player's usual evidence per pixel, that a leg's own have. In synthetic blocks 6300 to 6304 legs within 80 mm had
# 0.18 or more, 99 of 100 of them 0.4, legs that were 150 mm off less than -0.1, but one on its way there
_LEAST_SHARE = 0.1
LEAST_GAIN = 10.0  # [nat] of a leg that was found elsewhere: there 60 or more, where it was right all along up to 1
LEG_SD_RAD = np.array([0.5, 0.4, 0.4, 0.5, 0.4])  # of a leg of which nothing is known: hip, knee, ankle
_MIRROR = np.array([1.0, -1.0, -1.0, 1.0, 1.0])  # from one leg's angles to the other's


def find_unseen_legs(owned: Array, reference_evidence: float) -> NDArray[np.intp]:
    """Return the legs, 0 left and 1 right, that their own pixels do not show.

    `owned` (views, capsules, 2, 2) is a fit's evidence [nat] and area [px] of each capsule's two classes,
    `reference_evidence` [nat] the player's usual evidence per pixel.
    """
    evidence, area = owned.sum(axis=(0, 2)).T @ (CAPSULES[:, 2:] == [1, 2])
    return np.flatnonzero(evidence <= _LEAST_SHARE * reference_evidence * area)


def free_leg(expected: GaussianState, state: Array, leg: int) -> GaussianState:
    """Return what is expected where nothing is known of one leg: bent like the other of a state (35,), and at rest."""
    own, other = (slice(8 + 5 * side, 13 + 5 * side) for side in (leg, 1 - leg))
    numbers = np.r_[own, N_FREE + own.start : N_FREE + own.stop]
    mean, covariance = expected.mean.copy(), expected.covariance.copy()
    mean[numbers] = [*(_MIRROR * state[other]), *np.zeros(len(LEG_SD_RAD))]
    covariance[numbers], covariance[:, numbers] = 0.0, 0.0
    covariance[numbers, numbers] = np.concatenate([LEG_SD_RAD, FIRST_SPEED_SD[own]]) ** 2
    return GaussianState(mean, covariance)
