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
# of those that choose one of the four poses: each triangulates them, which takes most of the time
_CHEIRALITY_POINTS = 30
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
    try:
        F, mask = cv2.findFundamentalMat(px_a, px_b, cv2.USAC_MAGSAC, limit_px, _CONFIDENCE, _MOST_TRIES)
    except cv2.error:  # of points that fit none at all
        return None
    if F is None or F.shape != (3, 3) or not np.all(np.isfinite(F)):
        return None
    return EpipolarGeometry(F.astype(float), mask.ravel().astype(bool))


def relative_pose(F: Array, K_a: Array, K_b: Array, *, px_a: Array, px_b: Array) -> RelativePose:
    """Return the pose of camera b with most of the points (n, 2) [px] in front of both cameras."""
    plane_a, plane_b = (cv2.undistortPoints(np.ascontiguousarray(px), K, None) for px, K in ((px_a, K_a), (px_b, K_b)))
    few = np.linspace(0, len(px_a) - 1, min(len(px_a), _CHEIRALITY_POINTS)).astype(int)
    _, R, t, _, _ = cv2.recoverPose(K_b.T @ F @ K_a, plane_a[few], plane_b[few], np.eye(3), distanceThresh=np.inf)
    homogeneous = cv2.triangulatePoints(np.eye(3, 4), np.hstack([R, t]), plane_a, plane_b)
    points = (homogeneous[:3] / homogeneous[3]).T
    from_b = points + t.T @ R
    is_front = (points[:, 2] > 0) & (from_b @ R[2] > 0)
    cosine = np.sum(points * from_b, axis=1) / (np.linalg.norm(points, axis=1) * np.linalg.norm(from_b, axis=1))
    parallax = np.arccos(np.clip(cosine[is_front], -1, 1)) if is_front.any() else np.zeros(1)
    return RelativePose(
        np.asarray(R, float), np.asarray(t, float).ravel(), points, float(np.mean(is_front)), float(np.median(parallax))
    )
