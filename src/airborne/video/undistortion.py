"""Undistortion of images."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.cameras import Camera
from airborne.types import Image
from airborne.video.frames import PixelBox, View

_NEGLIGIBLE_PX = 0.05  # a distortion that moves no pixel by more is ignored


@dataclass(frozen=True, slots=True, eq=False)
class Undistortion:
    """The map that undistorts the images of one camera."""

    camera: Camera  # without distortion
    px_from_undistorted: tuple[NDArray, NDArray] | None  # OpenCV's fixed-point maps; None where nothing moves

    def view(self, rgb: Image) -> View:
        """Undistort an image (h, w, 3) and return its view."""
        return View(self.camera, self.undistort(rgb))

    def undistort(self, rgb: Image) -> Image:
        """Undistort an image (h, w, 3); where the original shows nothing, the undistorted one is black."""
        if self.px_from_undistorted is None:
            return rgb
        return cv2.remap(rgb, *self.px_from_undistorted, interpolation=cv2.INTER_LINEAR).astype(np.uint8, copy=False)

    def undistort_part(self, box: PixelBox, part_of: Callable[[PixelBox], Image]) -> Image:
        """Undistort one box of the undistorted image; `part_of` returns a box of the image as recorded."""
        if self.px_from_undistorted is None:
            return part_of(box)
        x0, y0, x1, y1 = box
        px, between = (part[y0:y1, x0:x1] for part in self.px_from_undistorted)
        low = np.maximum(px.min(axis=(0, 1)), 0)
        high = np.minimum(px.max(axis=(0, 1)) + 2, self.camera.size)
        if np.any(low >= high):
            return np.zeros((y1 - y0, x1 - x0, 3), np.uint8)
        part = part_of((int(low[0]), int(low[1]), int(high[0]), int(high[1])))
        return cv2.remap(part, px - low, between, interpolation=cv2.INTER_LINEAR).astype(np.uint8, copy=False)


def undistortion_of(camera: Camera) -> Undistortion:
    """Return the undistortion of a camera (or of a field's camera, on the field's own rows)."""
    maps = None
    if camera.is_distorted:
        width, height = camera.size
        px = np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1).astype(float)
        distorted = camera.distort_px(px)
        if np.max(np.linalg.norm(distorted - px, axis=-1)) > _NEGLIGIBLE_PX:
            x, y = distorted[..., 0].astype(np.float32), distorted[..., 1].astype(np.float32)
            maps = cv2.convertMaps(x, y, cv2.CV_16SC2)
    return Undistortion(camera.without_distortion(), maps)
