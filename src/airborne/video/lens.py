"""Straightening of images that the lens bends."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.cameras import Camera
from airborne.cameras.distortion import distort
from airborne.video.frames import View

NEGLIGIBLE_PX = 0.05  # a lens that moves no pixel by more is left alone


@dataclass(frozen=True, slots=True, eq=False)
class Lens:
    """Turns the images of one camera into `View`s without distortion."""

    camera: Camera  # without distortion
    px_from_straight: tuple[NDArray, NDArray] | None  # OpenCV's fixed-point maps; None where nothing moves

    def view(self, rgb: NDArray[np.uint8]) -> View:
        """Straighten an image (h, w, 3); where the lens saw nothing, the straight image is black."""
        if self.px_from_straight is not None:
            rgb = cv2.remap(rgb, *self.px_from_straight, interpolation=cv2.INTER_LINEAR).astype(np.uint8, copy=False)
        return View(self.camera, rgb)


def lens_of(camera: Camera) -> Lens:
    """Return the lens of a camera (or of a field's camera, on the field's own rows)."""
    maps = None
    if camera.is_distorted:
        width, height = camera.size
        straight = np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1).astype(float)
        K_inv = np.linalg.inv(camera.K)
        xy = straight @ K_inv[:2, :2].T + K_inv[:2, 2]
        bent = distort(xy, camera.distortion) @ camera.K[:2, :2].T + camera.K[:2, 2]
        if np.max(np.linalg.norm(bent - straight, axis=-1)) > NEGLIGIBLE_PX:
            maps = cv2.convertMaps(bent[..., 0].astype(np.float32), bent[..., 1].astype(np.float32), cv2.CV_16SC2)
    return Lens(camera.undistorted(), maps)
