"""What a tracker has learned from the images: the colours of body and background, and background models.

One `Appearance` a tracker; its arrays are its own and are updated in place as frames go by.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.appearance.background import START_SD, BackgroundModel, update_background
from airborne.appearance.foreground import BINS_PER_CHANNEL, count_colours, posterior
from airborne.cameras import Camera

_COLOUR_RATE = 0.1  # share of the newest frame in the colour histograms
_SAMPLES = 2000  # pixels of a region that are counted, about
_FEWEST = 30  # fewer pixels than this are not learned from
_CLEAR_PX = 3  # this far outside the mask, a pixel is background [px of a full frame]


@dataclass(frozen=True, slots=True)
class Region:
    """A region of interest in one view, contiguous, with the camera of exactly that region."""

    camera: Camera
    corner: tuple[int, int]  # (x0, y0) of the region in its view
    rgb: NDArray[np.uint8]  # (h, w, 3)
    view_rgb: NDArray[np.uint8]  # (H, W, 3) the whole view
    source: tuple[str, bytes]  # camera name and intrinsics: views that share them show the scene by the same pixels
    packed_view: NDArray[np.float64]  # (18,) of `pack_view`

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
    """Colour histograms by camera name, background models by source."""

    body_histograms: dict[str, NDArray[np.float32]] = field(default_factory=dict)  # (32, 32, 32) probabilities
    background_histograms: dict[str, NDArray[np.float32]] = field(default_factory=dict)
    backgrounds: dict[tuple[str, bytes], BackgroundModel] = field(default_factory=dict)

    def has_colours(self, region: Region) -> bool:
        """Whether this camera's colours have been learned."""
        return region.camera.name in self.body_histograms

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
        for histograms, chosen in ((self.body_histograms, core), (self.background_histograms, clear)):
            counts = np.zeros((BINS_PER_CHANNEL, BINS_PER_CHANNEL, BINS_PER_CHANNEL), np.float32)
            stride = max(1, int(np.count_nonzero(chosen)) // _SAMPLES)
            taken = count_colours(region.rgb, chosen, stride, counts)
            if taken * stride < _FEWEST:
                continue
            counts /= taken
            old = histograms.get(name)
            histograms[name] = counts if old is None else np.asarray(old + _COLOUR_RATE * (counts - old), np.float32)

    def learn_background(self, region: Region, mask: NDArray[np.bool_]) -> None:
        """Learn the background wherever the body is not: in the whole view at first, in the region from then on."""
        covered = cv2.dilate(mask.astype(np.uint8), _kernel(_CLEAR_PX, region.aspect)) > 0
        background = self.backgrounds.get(region.source)
        if background is None:
            background = self.backgrounds[region.source] = BackgroundModel(*region.view_rgb.shape[:2])
            everywhere = np.zeros(region.view_rgb.shape[:2], bool)
            region.crop(everywhere)[:] = covered
            update_background(region.view_rgb, everywhere, background.mean, background.sd, background.n_observations)
        else:
            crops = (region.crop(whole) for whole in (background.mean, background.sd, background.n_observations))
            update_background(region.rgb, covered, *crops)

    def background_model(self, region: Region) -> tuple[NDArray, NDArray, NDArray]:
        """Return the background model of a region: mean (h, w, 3), sd (h, w), n_observations (h, w)."""
        background = self.backgrounds.get(region.source)
        if background is None:
            height, width = region.rgb.shape[:2]
            never = np.zeros((height, width), np.uint8)
            return np.zeros((height, width, 3), np.float32), np.full((height, width), START_SD, np.float32), never
        whole = background.mean, background.sd, background.n_observations
        mean, sd, n_observations = (np.ascontiguousarray(region.crop(each)) for each in whole)
        return mean, sd, n_observations

    def posterior(self, region: Region) -> NDArray[np.float32]:
        """Return each pixel's probability (h, w) to be body, at even odds."""
        out = np.empty(region.rgb.shape[:2], np.float32)
        name = region.camera.name
        colours = self.body_histograms[name], self.background_histograms[name]
        posterior(region.rgb, *colours, *self.background_model(region), out)
        return out


def _kernel(radius_px: int, aspect: float) -> NDArray[np.uint8]:
    rows = max(1, round(radius_px * aspect))
    return np.ones((2 * rows + 1, 2 * radius_px + 1), np.uint8)
