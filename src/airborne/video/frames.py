"""What every camera saw at one time."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from airborne.cameras import Camera


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """One image and the camera of exactly that image (a field's camera has half the rows)."""

    camera: Camera  # without distortion: the image has been straightened where the lens bends
    rgb: NDArray[np.uint8]  # (h, w, 3) sRGB

    def crop(self, box: tuple[int, int, int, int]) -> NDArray[np.uint8]:
        """Return the part (y1 - y0, x1 - x0, 3) of the picture in a box (x0, y0, x1, y1) [px] that lies in it."""
        x0, y0, x1, y1 = box
        return self.rgb[y0:y1, x0:x1]


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """One image per camera at one time; None where a camera has none (ended, broken, not yet started)."""

    index: int  # frame or field number, from 0
    time_s: Fraction  # exact time on the trial's clock [s]
    views: tuple[View | None, ...]  # in the rig's order
