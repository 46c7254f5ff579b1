"""Which player occludes which, from torso positions alone."""

from __future__ import annotations

import numpy as np

from airborne.types import Array

_BODY_RADIUS_M = 0.2  # of the upright capsule around a torso
_ABOVE_TORSO_M, _BELOW_TORSO_M = 0.6, 1.3  # the capsule's ends, from the torso
_RAY_RADIUS_M = 0.4  # a torso nearer to a ray than this occludes what lies behind it


def occlusion_share(points: Array, centre: Array, others: Array) -> Array:
    """Return the share of each part's points that other players' upright capsules occlude from a camera: (parts,).

    points (parts, k, 3), centre (3,) of the camera, others (m, 3) torsos, all in the world [m].
    """
    rays = points - centre
    occluded = np.zeros(points.shape[:2], bool)
    for torso in others:
        to_torso = torso - centre
        along = np.sum(rays[..., :2] * to_torso[:2], axis=-1) / np.maximum(np.sum(rays[..., :2] ** 2, axis=-1), 1e-9)
        nearest = along[..., None] * rays - to_torso
        is_near = np.hypot(nearest[..., 0], nearest[..., 1]) < _BODY_RADIUS_M
        is_level = (nearest[..., 2] < _ABOVE_TORSO_M) & (nearest[..., 2] > -_BELOW_TORSO_M)
        occluded |= is_near & is_level & (along > 0) & (along < 1)
    return occluded.mean(axis=1)


def is_torso_occluded(torso: Array, centre: Array, others: Array) -> bool:
    """Return whether one of others (m, 3) lies nearer to the camera and within 0.4 m of the ray to this torso (3,)."""
    ray = torso - centre
    distance = np.linalg.norm(ray)
    along = (others - centre) @ ray / distance
    off = np.linalg.norm(others - centre - along[:, None] * ray / distance, axis=-1)
    return bool(np.any((along > 0) & (along < distance) & (off < _RAY_RADIUS_M)))
