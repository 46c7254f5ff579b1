"""Straightening of images that the lens bends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.cameras import Camera
from airborne.video.frames import Box, Image, View

NEGLIGIBLE_PX = 0.05  # a lens that moves no pixel by more is left alone


@dataclass(frozen=True, slots=True, eq=False)
class Lens:
    """Turns the images of one camera into `View`s without distortion."""

    camera: Camera  # without distortion
    px_from_straight: tuple[NDArray, NDArray] | None  # OpenCV's fixed-point maps; None where nothing moves

    def view(self, rgb: Image) -> View:
        """Straighten an image (h, w, 3) and return its view."""
        return View(self.camera, self.straight(rgb))

    def straight(self, rgb: Image) -> Image:
        """Straighten an image (h, w, 3); where the lens saw nothing, the straight image is black."""
        if self.px_from_straight is None:
            return rgb
        return cv2.remap(rgb, *self.px_from_straight, interpolation=cv2.INTER_LINEAR).astype(np.uint8, copy=False)

    def straight_part(self, box: Box, part_of: Callable[[Box], Image]) -> Image:
        """Straighten what lies in a box of the straight image; `part_of` gives a box of the image as recorded."""
        if self.px_from_straight is None:
            return part_of(box)
        x0, y0, x1, y1 = box
        px, between = (part[y0:y1, x0:x1] for part in self.px_from_straight)
        low = np.maximum(px.min(axis=(0, 1)), 0)
        high = np.minimum(px.max(axis=(0, 1)) + 2, self.camera.size)
        if np.any(low >= high):
            return np.zeros((y1 - y0, x1 - x0, 3), np.uint8)
        part = part_of((int(low[0]), int(low[1]), int(high[0]), int(high[1])))
        return cv2.remap(part, px - low, between, interpolation=cv2.INTER_LINEAR).astype(np.uint8, copy=False)


def lens_of(camera: Camera) -> Lens:
    """Return the lens of a camera (or of a field's camera, on the field's own rows)."""
    maps = None
    if camera.is_distorted:
        width, height = camera.size
        straight = np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1).astype(float)
        bent = camera.distorted_px(straight)
        if np.max(np.linalg.norm(bent - straight, axis=-1)) > NEGLIGIBLE_PX:
            maps = cv2.convertMaps(bent[..., 0].astype(np.float32), bent[..., 1].astype(np.float32), cv2.CV_16SC2)
    return Lens(camera.undistorted(), maps)
