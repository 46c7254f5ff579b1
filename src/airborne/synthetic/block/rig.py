"""The hall's cameras: corners and middle behind the blockers' team, and the error of their calibration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.cameras import Camera, Rig, camera_looking_at
from airborne.errors import TrialError

SIZE = (1920, 1080)  # [px]
_TARGET_M = np.array([0.0, -0.7, 1.6])  # where the cameras look: the middle of the block
_POSITIONS_M = np.array(  # [m]; the block-jump paper's three first
    [[-7.0, -13.0, 4.5], [7.0, -13.0, 4.5], [0.0, -15.0, 5.0], [-10.5, -5.0, 4.0], [10.5, -5.0, 4.0], [3.0, -13.5, 7.0]]
)
_POSITION_SD_M, _TARGET_SD_M = 0.15, 0.05  # of the cameras and their targets about these
_FOCAL_PX = (1600.0, 1720.0)  # range of the focal lengths


def hall_rig(rng: np.random.Generator, n_cameras: int) -> Rig:
    """Place 2 to 6 cameras, the first two in the corners. Raises TrialError for other numbers."""
    if not 2 <= n_cameras <= len(_POSITIONS_M):
        raise TrialError(f"{n_cameras} cameras were asked for; give 2 to {len(_POSITIONS_M)}")
    return Rig(
        tuple(
            camera_looking_at(
                f"cam{k + 1}",
                position + rng.normal(0, _POSITION_SD_M, 3),
                _TARGET_M + rng.normal(0, _TARGET_SD_M, 3),
                focal_px=rng.uniform(*_FOCAL_PX),
                size=SIZE,
            )
            for k, position in enumerate(_POSITIONS_M[:n_cameras])
        )
    )


def perturb_calibration(rng: np.random.Generator, rig: Rig, error_px: float) -> Rig:
    """Return the cameras with calibration errors: rotated about their centres.

    The middle of the picture is off by a normal deviate of sd `error_px` to the right, and another down; the picture
    is turned so that its corners are off by as much again.
    """
    return Rig(tuple(_perturb_rotation(rng, camera, error_px) for camera in rig))


def _perturb_rotation(rng: np.random.Generator, camera: Camera, error_px: float) -> Camera:
    focal, corner = camera.K[0, 0], float(np.hypot(*camera.size)) / 2
    error = Rotation.from_rotvec(rng.normal(0, 1, 3) * error_px / np.array([focal, focal, corner]))
    rotation = RigidTransform.from_components(np.zeros(3), error)
    return replace(camera, camera_from_world=rotation * camera.camera_from_world)
