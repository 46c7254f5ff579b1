"""Who stands before whom, by the places of torsos alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

BODY_RADIUS_M = 0.2  # of the upright capsule round a torso
ABOVE_TORSO_M, BELOW_TORSO_M = 0.6, 1.3  # the capsule's ends, from the torso
RAY_RADIUS_M = 0.4  # a torso nearer to a ray than this hides what lies behind it


def covered_share(points: Array, centre: Array, others: Array) -> Array:
    """Return which share of each part's points another player's upright capsule hides from a camera: (parts,).

    points (parts, k, 3), centre (3,) of the camera, others (m, 3) torsos, all in the world [m].
    """
    rays = points - centre
    hidden = np.zeros(points.shape[:2], bool)
    for torso in others:
        to_torso = torso - centre
        along = np.sum(rays[..., :2] * to_torso[:2], axis=-1) / np.maximum(np.sum(rays[..., :2] ** 2, axis=-1), 1e-9)
        nearest = along[..., None] * rays - to_torso
        is_near = np.hypot(nearest[..., 0], nearest[..., 1]) < BODY_RADIUS_M
        is_level = (nearest[..., 2] < ABOVE_TORSO_M) & (nearest[..., 2] > -BELOW_TORSO_M)
        hidden |= is_near & is_level & (along > 0) & (along < 1)
    return hidden.mean(axis=1)


def is_torso_hidden(torso: Array, centre: Array, others: Array) -> bool:
    """Say whether another's torso (m, 3) lies nearer to the camera and within 0.4 m of the ray to this one (3,)."""
    ray = torso - centre
    distance = np.linalg.norm(ray)
    along = (others - centre) @ ray / distance
    off = np.linalg.norm(others - centre - along[:, None] * ray / distance, axis=-1)
    return bool(np.any((along > 0) & (along < distance) & (off < RAY_RADIUS_M)))
