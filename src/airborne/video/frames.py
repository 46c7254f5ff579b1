"""What every camera saw at one time."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Protocol

import numpy as np

from airborne.cameras import Camera
from airborne.types import Image

PixelBox = tuple[int, int, int, int]  # x0, y0, x1, y1 [px]; the ends are outside


class LazyImage(Protocol):
    """An image that is converted to sRGB only when it is read."""

    @property
    def n_held_bytes(self) -> int:
        """How many bytes it takes, as far as it is converted."""
        ...

    def whole(self) -> Image:
        """Return the image: (h, w, 3) sRGB."""
        ...

    def crop(self, box: PixelBox) -> Image:
        """Return the part of the image in a box that lies in it."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """One image and the camera of exactly that image (a field's camera has half the rows)."""

    camera: Camera  # without distortion: the image is undistorted
    image: Image | LazyImage  # (h, w, 3) sRGB, converted or not yet
    delay_s: float = 0.0  # how much later it was taken than the time of its `Frames` [s]
    exposure_s: float = 0.0  # for which it was exposed about that time; 0: at once, or unknown [s]

    @property
    def rgb(self) -> Image:
        """The whole image: (h, w, 3) sRGB."""
        return self.image if isinstance(self.image, np.ndarray) else self.image.whole()

    def crop(self, box: PixelBox) -> Image:
        """Return the part (y1 - y0, x1 - x0, 3) of the image in a box (x0, y0, x1, y1) [px] that lies in it.

        Of an image that is not converted yet, only that part is; within one grey level of `rgb`.
        """
        x0, y0, x1, y1 = box
        return self.image[y0:y1, x0:x1] if isinstance(self.image, np.ndarray) else self.image.crop(box)


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """One image per camera at one time; None where a camera has none (ended, broken, not yet started)."""

    index: int  # frame or field number, from 0
    time_s: Fraction  # exact time on the trial's clock [s]
    views: tuple[View | None, ...]  # in the rig's order

    @property
    def n_bytes(self) -> int:
        """How many bytes the images take, converted."""
        return sum(3 * view.camera.size[0] * view.camera.size[1] for view in self.views if view is not None)

    @property
    def n_held_bytes(self) -> int:
        """How many bytes they take as they are, converted or not yet."""
        images = [view.image for view in self.views if view is not None]
        return sum(each.nbytes if isinstance(each, np.ndarray) else each.n_held_bytes for each in images)
