"""What a tracker has learned of the pictures: the body's and the background's colours, and the empty scene.

One `Appearance` a tracker; its arrays are its own and are updated in place as frames go by.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.appearance.background import START_SD, Plate, look
from airborne.appearance.foreground import BINS, count_colours, posterior
from airborne.cameras import Camera

COLOUR_RATE = 0.1  # share of the newest frame in the colour histograms
_SAMPLES = 2000  # pixels of a region that are counted, about
_FEWEST = 30  # pixels below which a frame teaches nothing
_CLEAR_PX = 3  # this far outside the mask, a pixel is background [px of a full frame]


@dataclass(frozen=True, slots=True)
class Region:
    """The part of one view that a tracker looks at, contiguous, with the camera of exactly that part."""

    camera: Camera
    corner: tuple[int, int]  # (x0, y0) of the region in its view
    rgb: NDArray[np.uint8]  # (h, w, 3)
    picture: NDArray[np.uint8]  # (H, W, 3) the whole view
    source: tuple[str, bytes]  # camera name and raster: views that share it show the same pixels of the scene
    packed: NDArray[np.float64]  # (18,) the camera for the kernels

    @property
    def aspect(self) -> float:
        """Rows a pixel is high, over columns it is wide: 0.5 in a field's own rows."""
        return float(self.camera.K[1, 1] / self.camera.K[0, 0])

    def crop(self, whole: NDArray) -> NDArray:
        """Cut the region out of an array over the whole view; a view, not a copy."""
        x0, y0 = self.corner
        height, width = self.rgb.shape[:2]
        return whole[y0 : y0 + height, x0 : x0 + width]


@dataclass(frozen=True, slots=True)
class Appearance:
    """Colour histograms by camera name, plates by source."""

    body: dict[str, NDArray[np.float32]] = field(default_factory=dict)  # (32, 32, 32) probabilities
    background: dict[str, NDArray[np.float32]] = field(default_factory=dict)
    plates: dict[tuple[str, bytes], Plate] = field(default_factory=dict)

    def knows(self, region: Region) -> bool:
        """Whether this camera's colours have been learned."""
        return region.camera.name in self.body

    def learn_colours(self, region: Region, mask: NDArray[np.bool_], *, body: NDArray[np.bool_] | None = None) -> None:
        """Learn the colours inside the mask's core and clear of it; mask (h, w) of the region.

        `body` (h, w) says which pixels of the core to take, if not all of them.
        """
        solid = mask.astype(np.uint8)
        core = cv2.erode(solid, np.ones((1, 3), np.uint8)) > 0
        if body is not None:
            core &= body
        clear = cv2.dilate(solid, _kernel(_CLEAR_PX + 1, region.aspect)) == 0
        name = region.camera.name
        for histograms, chosen in ((self.body, core), (self.background, clear)):
            counts = np.zeros((BINS, BINS, BINS), np.float32)
            stride = max(1, int(np.count_nonzero(chosen)) // _SAMPLES)
            taken = count_colours(region.rgb, chosen, stride, counts)
            if taken * stride < _FEWEST:
                continue
            counts /= taken
            old = histograms.get(name)
            histograms[name] = counts if old is None else np.asarray(old + COLOUR_RATE * (counts - old), np.float32)

    def learn_scene(self, region: Region, mask: NDArray[np.bool_]) -> None:
        """Learn the empty scene wherever the body is not: the whole view at first, the region from then on."""
        covered = cv2.dilate(mask.astype(np.uint8), _kernel(_CLEAR_PX, region.aspect)) > 0
        plate = self.plates.get(region.source)
        if plate is None:
            plate = self.plates[region.source] = Plate(*region.picture.shape[:2])
            everywhere = np.zeros(region.picture.shape[:2], bool)
            region.crop(everywhere)[:] = covered
            look(region.picture, everywhere, plate.mean, plate.sd, plate.looks)
        else:
            look(region.rgb, covered, region.crop(plate.mean), region.crop(plate.sd), region.crop(plate.looks))

    def scene(self, region: Region) -> tuple[NDArray, NDArray, NDArray]:
        """Return the empty scene of a region: mean (h, w, 3), sd (h, w), looks (h, w), which are 0 where unknown."""
        plate = self.plates.get(region.source)
        if plate is None:
            height, width = region.rgb.shape[:2]
            unseen = np.zeros((height, width), np.uint8)
            return np.zeros((height, width, 3), np.float32), np.full((height, width), START_SD, np.float32), unseen
        mean, sd, looks = (np.ascontiguousarray(region.crop(whole)) for whole in (plate.mean, plate.sd, plate.looks))
        return mean, sd, looks

    def posterior(self, region: Region) -> NDArray[np.float32]:
        """Return each pixel's probability (h, w) to be body, at even odds."""
        out = np.empty(region.rgb.shape[:2], np.float32)
        name = region.camera.name
        posterior(region.rgb, self.body[name], self.background[name], *self.scene(region), out)
        return out


def _kernel(radius_px: int, aspect: float) -> NDArray[np.uint8]:
    rows = max(1, round(radius_px * aspect))
    return np.ones((2 * rows + 1, 2 * radius_px + 1), np.uint8)
