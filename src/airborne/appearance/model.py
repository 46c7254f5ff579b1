"""What a tracker has learned from the images: colours of body and background, background models, how sharp they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.appearance.background import BackgroundModel, BackgroundPixels, FirstImage
from airborne.appearance.brightness import brightness_ratios, divide_brightness
from airborne.appearance.foreground import BINS_PER_CHANNEL, blend_colours, count_limb_colours, posterior
from airborne.cameras import Camera
from airborne.types import Array32
from airborne.video import View

# sds of a lens's blur that are told apart: the widest is what the nine taps of the comparison's blur just hold
LENS_BLURS_PX = (0.0, 0.5, 0.8, 1.2, 1.7, 2.5)
_COLOUR_RATE = 0.1  # share of the newest frame in the colour histograms
_SAMPLES = 2000  # pixels of a region that are counted, about
_FEWEST = 30  # fewer pixels than this are not learned from
# share of a limb's pixels that may have any of the body's colours: chosen on six people in loose clothes, of 0.1, 0.02
# and 0.005
_OTHER_COLOURS = np.float32(0.02)
_CLEAR_PX = 3  # this far outside the mask, a pixel is background [px of a full frame]


@dataclass(frozen=True, slots=True, eq=False)
class Region:
    """A region of interest in one view, contiguous, with the camera of exactly that region."""

    camera: Camera
    corner: tuple[int, int]  # (x0, y0) of the region in its view
    rgb: NDArray[np.uint8]  # (h, w, 3)
    view: View  # the whole one
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


Histograms = Mapping[str, Array32]  # camera name -> (32, 32, 32) probabilities


@dataclass(frozen=True, slots=True, eq=False)
class Appearance:
    """Colours, background models and the blur of lenses; a value: to learn is to return a new one."""

    body_histograms: Histograms = field(default_factory=dict)
    background_histograms: Histograms = field(default_factory=dict)
    limb_histograms: Histograms = field(default_factory=dict)  # of pairs of limbs (pairs, ...), zero where unknown
    backgrounds: Mapping[tuple[str, bytes], BackgroundModel] = field(default_factory=dict)  # by source
    # camera name -> (k,) what the images of the body have cost, drawn with each of LENS_BLURS_PX
    blur_costs: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)

    def has_colours(self, region: Region) -> bool:
        """Whether this camera's colours have been learned."""
        return region.camera.name in self.body_histograms

    def has_background(self, region: Region) -> bool:
        """Whether a background model of this region's source has been learned."""
        return region.source in self.backgrounds

    def learn_colours(
        self, region: Region, mask: NDArray[np.bool_], *, body: NDArray[np.bool_] | None = None
    ) -> Appearance:
        """Learn the colours inside the mask's core and clear of it; mask (h, w) of the region.

        `body` (h, w) says which pixels of the core to take, if not all of them.
        """
        solid = mask.astype(np.uint8)
        core = cv2.erode(solid, np.ones((1, 3), np.uint8)) > 0
        if body is not None:
            core &= body
        clear = cv2.dilate(solid, _kernel(_CLEAR_PX + 1, region.aspect)) == 0
        return replace(
            self,
            body_histograms=_learn_histogram(self.body_histograms, region, core),
            background_histograms=_learn_histogram(self.background_histograms, region, clear),
        )

    def learn_limb_colours(
        self, region: Region, part: NDArray[np.integer], pair_of_part: NDArray[np.integer]
    ) -> Appearance:
        """Learn the colours of each pair of limbs, arms or legs, from the part that each pixel shows (h, w), or -1.

        pair_of_part (parts + 1,): the pair's number of each part and, last, of none; -1 where there is no pair.
        """
        n_pairs, bins, name = int(pair_of_part.max(initial=-1)) + 1, (BINS_PER_CHANNEL,) * 3, region.camera.name
        if n_pairs == 0:
            return self
        counts, taken = np.zeros((n_pairs, *bins), np.float32), np.zeros(n_pairs, np.int64)
        count_limb_colours(region.rgb, part, pair_of_part, _SAMPLES, counts, taken)
        old = self.limb_histograms.get(name)
        histograms = np.zeros_like(counts) if old is None else old.copy()
        for pair in np.flatnonzero(taken >= _FEWEST):
            rate = _COLOUR_RATE if histograms[pair].any() else 1.0
            histograms[pair] += np.float32(rate) * (counts[pair] / np.float32(taken[pair]) - histograms[pair])
        return replace(self, limb_histograms={**self.limb_histograms, name: histograms})

    def learn_background(self, region: Region, mask: NDArray[np.bool_], *, whole_view: bool = True) -> Appearance:
        """Learn the background wherever the body is not: at first in the whole view, else in the region alone."""
        covered = cv2.dilate(mask.astype(np.uint8), _kernel(_CLEAR_PX, region.aspect)) > 0
        if self.has_background(region) or not whole_view:
            known = self.backgrounds.get(region.source, BackgroundModel())
            background = known.learn(region.rgb, covered, region.corner)
        else:
            rgb = region.view.rgb
            everywhere = np.zeros(rgb.shape[:2], bool)
            region.crop(everywhere)[:] = covered
            background = BackgroundModel(first=FirstImage(rgb, everywhere))
        return replace(self, backgrounds={**self.backgrounds, region.source: background})

    def background_pixels(self, region: Region) -> BackgroundPixels:
        """Return what is known of the background of a region."""
        background = self.backgrounds.get(region.source, BackgroundModel())
        return background.crop(region.corner, region.rgb.shape[:2])

    def learn_blur(self, region: Region, costs: NDArray[np.float64]) -> Appearance:
        """Learn how sharp a camera is from the costs of its image with each of LENS_BLURS_PX: (k,), inf: not tried."""
        name = region.camera.name
        return replace(self, blur_costs={**self.blur_costs, name: self.blur_costs.get(name, 0.0) + costs})

    def blur_px(self, region: Region) -> float:
        """Return the sd of the blur of a camera's lens [px along a row]: 0 where nothing has been learned of it."""
        costs = self.blur_costs.get(region.camera.name)
        return 0.0 if costs is None else LENS_BLURS_PX[int(np.argmin(costs))]

    def balance(self, region: Region) -> Region:
        """Return a region as bright as its background was when that was learned, however it is exposed."""
        if not self.has_background(region):
            return region
        ratios = brightness_ratios(region.rgb, self.backgrounds[region.source], region.corner)
        return region if ratios is None else replace(region, rgb=divide_brightness(region.rgb, ratios))

    def posterior(self, region: Region) -> Array32:
        """Return each pixel's probability (h, w) to be body, at even odds."""
        return self._posterior(region, self.body_histograms[region.camera.name])

    def limb_posterior(self, region: Region, pair: int) -> Array32:
        """Return each pixel's probability (h, w) to be a limb of a pair, or background: by colours, not by places.

        Where nothing has been learned of the pair, its probability to be body.
        """
        body, pairs = self.body_histograms[region.camera.name], self.limb_histograms.get(region.camera.name)
        if pairs is None or not (own := pairs[pair]).any():
            return self.posterior(region)
        return self._posterior(region, np.asarray(own + _OTHER_COLOURS * (body - own), np.float32))

    def _posterior(self, region: Region, colours: Array32) -> Array32:
        out = np.empty(region.rgb.shape[:2], np.float32)
        background = self.background_histograms[region.camera.name]
        posterior(region.rgb, colours, background, *self.background_pixels(region), out)
        return out


def _learn_histogram(histograms: Histograms, region: Region, chosen: NDArray[np.bool_]) -> Histograms:
    """Return the histograms with the region's camera's updated by its chosen pixels (h, w), where these are enough."""
    stride = max(1, int(np.count_nonzero(chosen)) // _SAMPLES)
    new = np.empty((BINS_PER_CHANNEL, BINS_PER_CHANNEL, BINS_PER_CHANNEL), np.float32)
    old, rate = histograms.get(region.camera.name), _COLOUR_RATE
    if old is None:
        old, rate = np.zeros_like(new), 1.0
    taken = blend_colours(region.rgb, chosen, stride, rate, old, new)
    if taken * stride < _FEWEST:
        return histograms
    return {**histograms, region.camera.name: new}


def _kernel(radius_px: int, aspect: float) -> NDArray[np.uint8]:
    rows = max(1, round(radius_px * aspect))
    return np.ones((2 * rows + 1, 2 * radius_px + 1), np.uint8)
