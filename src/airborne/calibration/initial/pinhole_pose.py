"""A pinhole camera's pose from points whose positions are known: perspective-n-point within RANSAC."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration.diagnosis.images import check_mirroring
from airborne.cameras.camera import Camera
from airborne.errors import CalibrationError
from airborne.types import Array

_RESECTION_LIMIT_SHARE = 0.02  # of the longer side: how far a marker may lie off in a resection
_INLIER_SHARE = 0.8  # least share of the markers within it


def resect_pinhole(camera: Camera, points: Array, px: Array) -> Camera | None:
    """Return the camera that sees points (n, 3) [m] at px (n, 2), without distortion; None where no pose fits.

    Raises CalibrationError where only a mirrored image fits.
    """
    is_seen = np.isfinite(px).all(axis=-1)
    for finding in check_mirroring(camera.name, camera.size, points, px):
        raise CalibrationError(finding.sentence)
    cv2.setRNGSeed(0)
    limit = _RESECTION_LIMIT_SHARE * max(camera.size)
    is_solved, rotation_vector, t, inliers = cv2.solvePnPRansac(
        points[is_seen],
        px[is_seen],
        camera.K,
        None,
        reprojectionError=limit,
        iterationsCount=300,
        flags=cv2.SOLVEPNP_SQPNP,
    )
    if (
        not is_solved
        or inliers is None
        or len(inliers) < _INLIER_SHARE * is_seen.sum()
        or not np.all(np.isfinite([rotation_vector, t]))
    ):
        return None
    pose = RigidTransform.from_components(t.ravel(), Rotation.from_rotvec(rotation_vector.ravel()))
    return replace(camera, camera_from_world=pose)
