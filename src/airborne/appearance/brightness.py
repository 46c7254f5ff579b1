"""How bright an image is beside the background that was learned: exposure and white balance that change, flicker."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.appearance.background import BackgroundModel
from airborne.kernels import kernel
from airborne.rendering.srgb import light_from_srgb, srgb_from_light
from airborne.types import Array

_SAMPLES = 1000  # chosen: pixels that are compared, about; 2000 track the same frames of four synthetic throws
_FEWEST = 50  # chosen: of them; the median of fewer, with noise of 11 %, is off by 2 % and more
_DARK, _BRIGHT = 25, 235  # chosen: grey levels between which neither noise nor clipping counts
_BIN, _N_BINS = 0.01, 301  # chosen: of the histograms of log ratios, which reach to 4.5 times as bright
_ALIKE_BINS = 20  # chosen: on either side of the median; noise of three grey levels in sixty is 11 %
_LEAST_SHARE = 0.5  # of pixels that must agree: a median stands up to less than half of others (its breakdown point)
# of a ratio that is made good, chosen: noise moves the median of so many pixels by less than 0.01, and the background,
# as it learns, follows what is less
_LEAST_LOG = 0.04
_LOG_LIGHT = np.log(np.maximum(light_from_srgb(np.arange(256.0)), 1e-4)).astype(np.float32)


def brightness_ratios(rgb: NDArray[np.uint8], background: BackgroundModel, corner: tuple[int, int]) -> Array | None:
    """Return by how much brighter red, green and blue are than the background, in linear light: (3,).

    rgb (h, w, 3) of the region whose first pixel is `corner` (x, y). None where the image is as bright as it was, or
    too few pixels agree on how much it has changed.
    """
    stride = max(1, int((rgb.shape[0] * rgb.shape[1] / _SAMPLES) ** 0.5))
    counts = np.zeros((3, _N_BINS), np.int32)
    for tile, in_region, in_tile in background.tiles_of(corner, rgb.shape[:2]):
        _count_ratios(rgb[in_region], tile[in_tile], stride, _LOG_LIGHT, counts)
    ratios = np.empty(3)
    return np.exp(ratios) if _find_medians(counts, ratios) and np.abs(ratios).max() > _LEAST_LOG else None


def divide_brightness(rgb: NDArray[np.uint8], ratios: Array) -> NDArray[np.uint8]:
    """Return an image (h, w, 3) as it would be without these ratios (3,) of linear light."""
    light = light_from_srgb(np.arange(256.0))[:, None] / ratios
    table = np.round(srgb_from_light(light)).astype(np.uint8)[None]
    return np.asarray(cv2.LUT(rgb, table), np.uint8)


@kernel
def _count_ratios(rgb, known, stride, log_light, counts):
    """Count the log ratios of every n-th pixel, rgb (h, w, 3), to its background, known (h, w, 5): counts (3, bins)."""
    h, w, _ = rgb.shape
    middle = counts.shape[1] // 2
    for y in range(0, h, stride):
        for x in range(0, w, stride):
            if known[y, x, 4] <= 0:
                continue
            for k in range(3):
                now, before = rgb[y, x, k], int(known[y, x, k] + np.float32(0.5))
                if _DARK <= now <= _BRIGHT and _DARK <= before <= _BRIGHT:
                    at = int(np.floor((log_light[now] - log_light[before]) / _BIN + 0.5)) + middle
                    if 0 <= at < counts.shape[1]:
                        counts[k, at] += 1


@kernel
def _find_medians(counts, ratios):
    """Fill ratios (3,) with the medians of counts (3, bins); return whether enough pixels are alike in each."""
    for k in range(3):
        n = 0
        for count in counts[k]:
            n += count
        if n < _FEWEST:
            return False
        median, below = 0, counts[k, 0]
        while 2 * below < n:
            median += 1
            below += counts[k, median]
        alike = 0
        for at in range(max(median - _ALIKE_BINS, 0), min(median + _ALIKE_BINS + 1, counts.shape[1])):
            alike += counts[k, at]
        if alike < _LEAST_SHARE * n:
            return False
        ratios[k] = (median - counts.shape[1] // 2) * _BIN
    return True
