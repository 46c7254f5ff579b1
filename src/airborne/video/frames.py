"""What every camera saw at one time."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from airborne.cameras import Camera

Image = NDArray[np.uint8]
Box = tuple[int, int, int, int]  # x0, y0, x1, y1 [px]; the ends are outside


class Pixels(Protocol):
    """A picture that is not turned into sRGB before somebody looks."""

    def whole(self) -> Image:
        """Return the picture: (h, w, 3) sRGB."""
        ...

    def crop(self, box: Box) -> Image:
        """Return the part of the picture in a box that lies in it."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """One image and the camera of exactly that image (a field's camera has half the rows)."""

    camera: Camera  # without distortion: the image has been straightened where the lens bends
    picture: Image | Pixels  # (h, w, 3) sRGB, or what gives it
    late_s: float = 0.0  # how much later it was taken than the time of its `Frames` [s]

    @property
    def rgb(self) -> Image:
        """The whole picture: (h, w, 3) sRGB."""
        return self.picture if isinstance(self.picture, np.ndarray) else self.picture.whole()

    def crop(self, box: Box) -> Image:
        """Return the part (y1 - y0, x1 - x0, 3) of the picture in a box (x0, y0, x1, y1) [px] that lies in it.

        Only that part is converted where the picture still is as it was decoded; within one grey level of `rgb`.
        """
        x0, y0, x1, y1 = box
        return self.picture[y0:y1, x0:x1] if isinstance(self.picture, np.ndarray) else self.picture.crop(box)


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """One image per camera at one time; None where a camera has none (ended, broken, not yet started)."""

    index: int  # frame or field number, from 0
    time_s: Fraction  # exact time on the trial's clock [s]
    views: tuple[View | None, ...]  # in the rig's order
