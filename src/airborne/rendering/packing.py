"""Cameras and lights as the kernels take them: plain rows of numbers, in camera axes."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from airborne.cameras import Camera
from airborne.errors import CalibrationError
from airborne.rendering.lights import Lights
from airborne.types import Array32

_NO_CONE = -2.0  # below every cosine


@lru_cache(maxsize=256)
def pack_view(camera: Camera, *, transposed: bool = False) -> NDArray:
    """Pack a camera: world to camera (R row by row, t), then the two rows of K^-1: (18,).

    Transposed, rows and columns of the image are swapped, and with them the camera's x and y. Raises
    CalibrationError for a camera with distortion, because straight lines are drawn straight.
    """
    if camera.is_distorted:
        raise CalibrationError(
            f"camera '{camera.name}' has lens distortion; straighten its images and draw with camera.undistorted()"
        )
    order = [1, 0, 2] if transposed else [0, 1, 2]
    camera_from_world = camera.camera_from_world.as_matrix()[:3][order]
    ray_from_px = np.linalg.inv(camera.K)[np.ix_(order, order)][:2]
    return np.concatenate([camera_from_world[:, :3].ravel(), camera_from_world[:, 3], ray_from_px.ravel()])


def shift_view(view: NDArray, x0: float, y0: float) -> NDArray:
    """Return the packed view (18,) of the image that begins at pixel (x0, y0) of this one."""
    shifted = view.copy()
    shifted[14] += view[12] * x0 + view[13] * y0
    shifted[17] += view[15] * x0 + view[16] * y0
    return shifted


def reduce_view(view: NDArray, scale: tuple[int, int]) -> NDArray:
    """Return the packed view (18,) of an image reduced by averaging `scale` columns and rows."""
    reduced = shift_view(view, (scale[0] - 1) / 2, (scale[1] - 1) / 2)
    reduced[12::3] *= scale[0]
    reduced[13::3] *= scale[1]
    return reduced


@lru_cache(maxsize=256)
def pack_lights(lights: Lights, camera: Camera, *, transposed: bool = False) -> Array32:
    """Pack the lamps for one camera: position, intensity, axis, cosine of the half angle, in camera axes: (l, 8)."""
    order = [1, 0, 2] if transposed else [0, 1, 2]
    to_camera = camera.camera_from_world.as_matrix()  # on single points, SciPy's own methods take ten times as long
    packed = np.zeros((len(lights.lamps), 8), np.float32)
    for row, lamp in zip(packed, lights.lamps, strict=True):
        row[:3] = (to_camera[:3, :3] @ lamp.position_m + to_camera[:3, 3])[order]
        row[3], row[7] = lamp.intensity, _NO_CONE
        if lamp.direction is not None and lamp.half_angle_rad is not None:
            row[4:7] = (to_camera[:3, :3] @ lamp.direction / np.linalg.norm(lamp.direction))[order]
            row[7] = np.cos(lamp.half_angle_rad)
    return packed
