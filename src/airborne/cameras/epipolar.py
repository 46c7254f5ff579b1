"""Epipolar curves: where a point seen by one camera may lie in another's picture, bent by its lens."""

from __future__ import annotations

import numpy as np

from airborne.cameras.camera import Camera
from airborne.types import Array

_NEAREST_M, _FARTHEST_M = 0.2, 200.0  # from the camera that sees the point
_N_DEPTHS = 600  # along the ray, in equal steps of inverse depth
_BEYOND = 0.5  # of the picture's size: how far outside it the curve goes on


def epipolar_curve(seen_by: Camera, px: Array, shown_in: Camera, sd_px: float = 1.0) -> tuple[Array, Array]:
    """Return the curve (n, 2) [px] of a point px (2,) in another camera's picture, and its standard deviation (n,).

    The deviation is across the curve [px], of a click whose right and down have `sd_px` each. Empty where the ray
    passes the picture by.
    """
    h = 0.5  # px
    clicks = np.asarray(px, float) + np.array([[0, 0], [h, 0], [-h, 0], [0, h], [0, -h]])
    points = _along_rays(seen_by, clicks)  # (5, depths, 3)
    curve = shown_in.px_from_world(points)
    by_u, by_v = (curve[1] - curve[2]) / (2 * h), (curve[3] - curve[4]) / (2 * h)
    tangent = np.gradient(curve[0], axis=0)
    with np.errstate(invalid="ignore"):
        across = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1) / np.linalg.norm(tangent, axis=1, keepdims=True)
    sd = sd_px * np.hypot(np.sum(by_u * across, axis=1), np.sum(by_v * across, axis=1))
    size = np.array(shown_in.size)
    is_near = np.all((curve[0] > -_BEYOND * size) & (curve[0] < (1 + _BEYOND) * size), axis=1)
    is_kept = is_near & np.isfinite(sd) & _is_before_turning(shown_in, points[0])
    return curve[0][is_kept], sd[is_kept]


def _along_rays(camera: Camera, px: Array) -> Array:
    """Return world points (clicks, depths, 3) [m] on the rays of pixels (clicks, 2)."""
    xy = (camera.undistort_px(px) - camera.K[:2, 2]) @ np.linalg.inv(camera.K[:2, :2]).T
    depth = 1 / np.linspace(1 / _NEAREST_M, 1 / _FARTHEST_M, _N_DEPTHS)
    rays = np.append(xy, np.ones((len(xy), 1)), axis=1)
    return camera.camera_from_world.inv().apply((rays[:, None] * depth[:, None]).reshape(-1, 3)).reshape(len(px), -1, 3)


def _is_before_turning(camera: Camera, points: Array) -> Array:
    """Say which points (n, 3) lie where the lens model can be inverted: far outside the picture it folds back."""
    straight = camera.without_distortion().px_from_world(points)
    bent = camera.px_from_world(points)
    with np.errstate(invalid="ignore"):
        return np.linalg.norm(camera.undistort_px(bent) - straight, axis=1) < 1.0
