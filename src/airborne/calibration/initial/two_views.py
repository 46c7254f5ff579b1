"""Relative pose of two cameras from corresponding points: epipolar geometry. Arrays only.

`x_b^T F x_a = 0` for pixels of the same point; with the cameras' matrices `E = K_b^T F K_a = [t]x R`. Of the four poses
that one E allows, the points lie in front of both cameras in one (cheirality). (Hartley and Zisserman 2004, 9.)
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.types import Array

_FEWEST_POINTS = 8  # of a fundamental matrix
_CONFIDENCE, _MOST_TRIES = 0.9999, 5000  # of finding a sample without outliers; samples drawn at most


@dataclass(frozen=True, slots=True, eq=False)
class EpipolarGeometry:
    """The fundamental matrix of two images and its inliers."""

    F: Array  # (3, 3)
    is_inlier: NDArray[np.bool_]  # (n,)


@dataclass(frozen=True, slots=True, eq=False)
class RelativePose:
    """The pose of camera b in camera a's axes, up to scale: the baseline has length 1."""

    R: Array  # (3, 3), b from a
    t: Array  # (3,), of length 1
    points: Array  # (n, 3) in a's axes
    front_share: float  # share of the points in front of both cameras, 0 to 1
    parallax_rad: float  # median angle between the two rays to a point [rad]


def fit_epipolar_geometry(px_a: Array, px_b: Array, *, limit_px: float) -> EpipolarGeometry | None:
    """Fit the fundamental matrix to corresponding pixels (n, 2) of two images, inliers within limit_px; None if none.

    Pixels without distortion and without NaN. Points in one plane, or on one line, are degenerate.
    """
    if len(px_a) < _FEWEST_POINTS:
        return None
    F, mask = cv2.findFundamentalMat(px_a, px_b, cv2.USAC_MAGSAC, limit_px, _CONFIDENCE, _MOST_TRIES)
    if F is None or F.shape != (3, 3) or not np.all(np.isfinite(F)):
        return None
    return EpipolarGeometry(F.astype(float), mask.ravel().astype(bool))


def relative_pose(F: Array, K_a: Array, K_b: Array, *, px_a: Array, px_b: Array) -> RelativePose:
    """Return the pose of camera b with most of the points (n, 2) [px] in front of both cameras."""
    R_1, R_2, t = (np.asarray(part, float) for part in cv2.decomposeEssentialMat(K_b.T @ F @ K_a))
    rays_a, rays_b = _rays(px_a, K_a), _rays(px_b, K_b)
    candidates = [
        _triangulate_midpoints(R, sign * t.ravel(), rays_a, rays_b) for R in (R_1, R_2) for sign in (1.0, -1.0)
    ]
    return max(candidates, key=lambda pose: pose.front_share)


def _triangulate_midpoints(R: Array, t: Array, rays_a: Array, rays_b: Array) -> RelativePose:
    """Triangulate every point as the midpoint of its two rays' closest approach."""
    rays_b_in_a = rays_b @ R
    centre = -t @ R
    cosine = np.sum(rays_a * rays_b_in_a, axis=1)
    sine2 = np.maximum(1 - cosine**2, 1e-12)
    depth_a = (rays_a @ centre - cosine * (rays_b_in_a @ centre)) / sine2
    depth_b = (cosine * (rays_a @ centre) - rays_b_in_a @ centre) / sine2
    points = (depth_a[:, None] * rays_a + centre + depth_b[:, None] * rays_b_in_a) / 2
    is_front = (depth_a > 0) & (depth_b > 0)
    parallax = np.arccos(np.clip(cosine[is_front], -1, 1)) if is_front.any() else np.zeros(1)
    return RelativePose(R, t, points, float(np.mean(is_front)), float(np.median(parallax)))


def _rays(px: Array, K: Array) -> Array:
    """Return the unit rays (n, 3) of pixels (n, 2) in the camera's axes."""
    rays = np.column_stack([(px - K[:2, 2]) @ np.linalg.inv(K[:2, :2]).T, np.ones(len(px))])
    return rays / np.linalg.norm(rays, axis=1)[:, None]
