"""What a calibration file or a table of pixels does not say: unit, image sizes, pixel convention."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from airborne.errors import CalibrationError
from airborne.types import Array, Size

Unit = Literal["m", "mm"]
Corner = Literal["upper-left", "lower-left"]

METRES: dict[Unit, float] = {"m": 1.0, "mm": 1e-3}


@dataclass(frozen=True, slots=True)
class PixelConvention:
    """Where a tool counts pixels from: the corner, and the number of the first pixel's centre.

    DLTdv 8 counts from the upper left and from 1; DLTdv 7 and older, easyWand and Argus from the lower left.
    """

    corner: Corner = "upper-left"
    base: int = 1

    def theirs_from_ours(self, height: int) -> Array:
        """Return the homogeneous map (3, 3) from our pixels to theirs in an image of this height [px]."""
        if self.corner == "upper-left":
            return np.array([[1.0, 0, self.base], [0, 1, self.base], [0, 0, 1]])
        return np.array([[1.0, 0, self.base], [0, -1, height - 1 + self.base], [0, 0, 1]])

    def ours(self, px: Array, height: int) -> Array:
        """Convert their pixels (..., 2) to ours: (0, 0) is the centre of the top-left pixel."""
        u, v = px[..., 0] - self.base, px[..., 1] - self.base
        return np.stack([u, v if self.corner == "upper-left" else height - 1 - v], axis=-1)

    def theirs(self, px: Array, height: int) -> Array:
        """Convert our pixels (..., 2) to theirs."""
        u, v = px[..., 0], px[..., 1]
        return np.stack([u, v if self.corner == "upper-left" else height - 1 - v], axis=-1) + self.base


@dataclass(frozen=True, slots=True, kw_only=True)
class FileOptions:
    """What the user adds to a file."""

    unit: Unit | None = None  # of lengths; None: what the format defines
    size: Size | Mapping[str, Size] | None = None  # of all images, or by camera [px]
    pixels: PixelConvention = PixelConvention()

    def metres(self, default: Unit) -> float:
        """Return the file's unit of length in metres."""
        return METRES[self.unit or default]

    def size_of(self, camera: str, where: str) -> Size:
        """Return the camera's image size; raises CalibrationError where it was not given."""
        size = self.size.get(camera) if isinstance(self.size, Mapping) else self.size
        if size is None:
            raise CalibrationError(
                f"{where} does not say how large the images of '{camera}' are; give --size WIDTHxHEIGHT"
            )
        return size
