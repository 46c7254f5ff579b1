"""Points at the end of swinging rods: the block-jump paper's prediction (equations 11 and 12).

A point moves in the horizontal plane in one of 16 directions, by up to a reach that depends on the direction; its
height follows from the rod's length. All functions map arrays of n particles to arrays.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from airborne.types import Array

Swing = Literal["literal", "consistent"]

SECTORS = 16  # horizontal directions (block-jump paper, equation 12)
_LEAST_REACH_M, _CLEARANCE_M = 0.01, 0.04  # of a step towards the other leg
_SIDEWAYS = 0.2  # below this cosine a direction is fore or aft
_MAX_RHO = 0.999  # of the rod's length
_TRUNCATION_SD = 2.5  # standard deviations at which the change of length is truncated


def draw_directions(rng: np.random.Generator, n: int) -> Array:
    """Draw horizontal unit vectors (n, 2), each one of 16: theta from the y axis toward x, as in equation 12."""
    theta = rng.integers(0, SECTORS, n) * (2 * np.pi / SECTORS)
    return np.stack([np.sin(theta), np.cos(theta)], axis=-1)


def reach(direction: Array, outward: Array | None, *, max_step_m: float, gap_m: float) -> Array:
    """Return how far a point may move in each direction (n, 2): (n,) [m].

    outward (2,): the horizontal unit vector away from the other leg. Outward, fore and aft it is `max_step_m`; toward
    the other leg, at distance `gap_m`, less than half of the gap, so that the two legs cannot meet. Without `outward`
    it is `max_step_m` everywhere.
    """
    if outward is None:
        return np.full(len(direction), max_step_m)
    inward = -(direction @ outward)
    half_m = max(_LEAST_REACH_M, 0.5 * gap_m - _CLEARANCE_M)
    bounded = np.minimum(max_step_m, half_m / np.maximum(inward, _SIDEWAYS))
    return np.where(inward >= _SIDEWAYS, bounded, max_step_m)


def draw_length_changes(rng: np.random.Generator, n: int, sd_m: float) -> Array:
    """Draw the size of the rods' change of length, delta_z (n,) [m]: a half-normal, truncated at 2.5 sd."""
    return np.minimum(np.abs(rng.normal(0, sd_m, n)), _TRUNCATION_SD * sd_m)


def swing_rods(before: Array, start: Array, steps: Array, *, lengths_m: Array, side: Array, swing: Swing) -> Array:
    """Return the points (n, 3) at the ends of rods that start at `start` (n, 3) or (3,) (equation 12).

    before (n, 3): the previous points; steps (n, 2): their displacement in x and y; lengths_m (n,): the rods' perturbed
    lengths, L ± delta_z; side (n,): u, +1 above the start and -1 below it.
    "literal" takes the height from the step alone, as printed: exact only for a point vertically below its start.
    "consistent" takes it from the whole horizontal distance to the start, so that every rod has its length; a point
    further out than the rod is long is pulled in to 0.999 of it.
    """
    xy = before[:, :2] + steps
    start = np.broadcast_to(start, before.shape)
    if swing == "literal":
        rho = np.minimum(np.hypot(*steps.T), _MAX_RHO * lengths_m)
    else:
        away = xy - start[:, :2]
        far = np.hypot(*away.T)
        rho = np.minimum(far, _MAX_RHO * lengths_m)
        xy = start[:, :2] + away * np.divide(rho, far, out=np.ones_like(far), where=far > 0)[:, None]
    z = start[:, 2] + side * np.sqrt(lengths_m**2 - rho**2)
    return np.column_stack([xy, z])
