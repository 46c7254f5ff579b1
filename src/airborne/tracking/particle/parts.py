"""The parts of the legs that are compared with the images: half pelvis, thigh, shank and shoe of both sides."""

from __future__ import annotations

import numpy as np

from airborne.body.legs import RODS, SHANK_WIDTH_M, THIGH_WIDTH_M
from airborne.tracking.particle.references import Parts
from airborne.types import Array

PELVIS, SHANKS, SHOES = (0, 1), (4, 5), (6, 7)  # left, right; 2 and 3 are the thighs
N_PARTS = 8  # both sides of hips, thighs, shanks and shoes

_SHORTS_WIDTH_M = 0.20  # of the pelvis's rectangle in the images
_SHOE_HEIGHT_M, _SHOE_LENGTH_M = 0.10, 0.28  # of an upright box below the ankle: a shoe's heading is unknown
WIDTHS_M = np.repeat([_SHORTS_WIDTH_M, THIGH_WIDTH_M, SHANK_WIDTH_M, _SHOE_LENGTH_M], 2)

SHORTS, SKIN, SHOE = 1, 2, 4  # colour classes, as bits
CLASSES = np.repeat([SHORTS, SHORTS | SKIN, SKIN, SHOE], 2)
PARTS = Parts(WIDTHS_M, CLASSES.astype(np.int64), (PELVIS, SHANKS, SHOES))


def leg_parts(side: int) -> tuple[int, int]:
    """Return the parts that the filter of one shank observes: shank and shoe; side 0 is left."""
    return SHANKS[side], SHOES[side]


def hip_ends(hips: Array) -> Array:
    """Return the rods of the two half pelvises, from the middle: hips (n, 2, 3) -> (n, 2, 2, 3)."""
    middle = np.broadcast_to(hips.mean(axis=1, keepdims=True), hips.shape)
    return np.stack([middle, hips], axis=2)


def leg_ends(leg: Array) -> Array:
    """Return the rods of one shank and its shoe: leg (n, 2, 3), knee and ankle -> (n, 2, 2, 3)."""
    sole = leg[:, 1] - [0, 0, _SHOE_HEIGHT_M]
    return np.stack([leg, np.stack([leg[:, 1], sole], axis=1)], axis=1)


def ends_of(points: Array) -> Array:
    """Return the rods of all parts: points (n, 6, 3), as LEG_POINTS -> (n, 8, 2, 3)."""
    thighs = np.stack([points[:, RODS[side]] for side in (0, 1)], axis=1)
    left, right = leg_ends(points[:, [2, 4]]), leg_ends(points[:, [3, 5]])
    shanks_and_shoes = np.stack([left[:, 0], right[:, 0], left[:, 1], right[:, 1]], axis=1)
    return np.concatenate([hip_ends(points[:, 0:2]), thighs, shanks_and_shoes], axis=1)
