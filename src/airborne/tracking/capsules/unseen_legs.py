"""Legs whose own pixels do not show them: a trunk in full sight must not vouch for a leg that has gone astray."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from airborne.tracking.capsules.dynamics import FIRST_SPEED_SD, N_FREE, GaussianState
from airborne.tracking.capsules.equations import N_POINTS
from airborne.tracking.capsules.fit import JumperFit
from airborne.tracking.capsules.jumper import CAPSULES
from airborne.types import Array

# of a player's usual evidence per pixel, that a leg's own have. In synthetic blocks 6300 to 6304 legs within 80 mm had
# 0.18 or more, 99 of 100 of them 0.4, legs that were 150 mm off less than -0.1, but one on its way there
_LEAST_SHARE = 0.1
_THIGHS, _SHANKS = [4, 7], [5, 8]  # capsules
# share of a capsule above which it counts as shown. In synthetic blocks 7001 to 7004, whole, at half the size and
# without a camera each, 19 % of the ankles that fewer than two views showed lay 0.1 m off or more, 1.5 % of the others
_LEAST_SHOWN = 0.15
_UNMEASURED_SD_M = 0.10  # of such ankles and feet along the only ray: 0.093 and 0.097 m there
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


def covariance_of_unseen(fit: JumperFit, reference_evidence: float) -> Array:
    """Return what nobody measured of points that fewer than two views show: (9, 3, 3) [m2].

    Along the ray of the only view, or in all directions. A shank shows ankle and foot, both thigh and shank the knee.
    """
    thighs, shanks = (_shown(fit, capsules, reference_evidence) for capsules in (_THIGHS, _SHANKS))
    covariance = np.zeros((N_POINTS, 3, 3))
    centres = -np.linalg.solve(fit.cameras[:, :3, :3], fit.cameras[:, :3, 3:])[..., 0]
    for leg in range(2):
        for point, share in ((2, (thighs + shanks) / 2), (4, shanks), (6, shanks)):
            is_shown = share[:, leg] > _LEAST_SHOWN
            ray = fit.points[point + leg] - centres[int(share[:, leg].argmax())]
            along = np.outer(ray, ray) / (ray @ ray) if is_shown.any() else np.eye(3)
            covariance[point + leg] = 0.0 if is_shown.sum() > 1 else _UNMEASURED_SD_M**2 * along
    return covariance


def _shown(fit: JumperFit, capsules: Sequence[int], reference_evidence: float) -> Array:
    """Return how much of both legs' capsules (2,) each view shows: (v, 2).

    That is their evidence as a share of the player's usual [nat a pixel] on the whole capsule, as large as it is in the
    view that shows most of it.
    """
    m_per_px = fit.cameras[:, 2] @ [*fit.state[:3], 1.0] / fit.cameras[:, 3, 0]
    evidence, area = np.moveaxis(fit.owned[:, capsules].sum(axis=2), -1, 0) * m_per_px[:, None] ** 2
    return evidence / np.maximum(reference_evidence * area.max(axis=0), 1e-9)


def free_leg(expected: GaussianState, state: Array, leg: int) -> GaussianState:
    """Return what is expected where nothing is known of one leg: bent like the other of a state (35,), and at rest."""
    own, other = (slice(8 + 5 * side, 13 + 5 * side) for side in (leg, 1 - leg))
    numbers = np.r_[own, N_FREE + own.start : N_FREE + own.stop]
    mean, covariance = expected.mean.copy(), expected.covariance.copy()
    mean[numbers] = [*(_MIRROR * state[other]), *np.zeros(len(LEG_SD_RAD))]
    covariance[numbers], covariance[:, numbers] = 0.0, 0.0
    covariance[numbers, numbers] = np.concatenate([LEG_SD_RAD, FIRST_SPEED_SD[own]]) ** 2
    return GaussianState(mean, covariance)
