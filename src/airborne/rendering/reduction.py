"""Images reduced by averaging areas, and the cameras of exactly those images."""

from __future__ import annotations

from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.cameras import Camera
from airborne.types import Array32

Pixels = TypeVar("Pixels", NDArray[np.uint8], Array32)


def reduce_image(image: Pixels, scale: int) -> Pixels:
    """Average squares of `scale` by `scale` pixels of an image (h, w, ...); rows and columns left over are cut off."""
    if scale == 1:
        return image
    height, width = image.shape[0] // scale, image.shape[1] // scale
    return cv2.resize(image[: height * scale, : width * scale], (width, height), interpolation=cv2.INTER_AREA)  # type: ignore[return-value]


def reduce_camera(camera: Camera, scale: int) -> Camera:
    """Return the camera of the reduced image: its pixel (0, 0) is the middle of the first square."""
    if scale == 1:
        return camera
    width, height = camera.size
    middle = (scale - 1) / 2
    return camera.resample(scale=(scale, scale), offset=(middle, middle), size=(width // scale, height // scale))
