"""How bright an image is beside the background that was learned: exposure and white balance that change, flicker."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.appearance.background import BackgroundPixels
from airborne.kernels import kernel
from airborne.rendering.srgb import light_from_srgb, srgb_from_light
from airborne.types import Array

_SAMPLES = 2000  # pixels that are compared, about
_FEWEST = 200  # of them; fewer tell nothing
_DARK, _BRIGHT = 25, 235  # grey levels between which noise and clipping do not count
_BIN, _N_BINS = 0.01, 301  # of the histograms of log ratios, about 1
_ALIKE_BINS = 20  # on either side of the median; noise of three grey levels in sixty is 11 %
_LEAST_SHARE = 0.5  # of pixels that must agree: others are covered by something else
# of a ratio, that is made good: less is followed by the background, as it learns. Chosen above the ratios of recordings
# whose exposure stays, and below those at which pixels of the background (sd 2 grey levels at least) look like others
_LEAST_LOG = 0.04
_LOG_LIGHT = np.log(np.maximum(light_from_srgb(np.arange(256.0)), 1e-4)).astype(np.float32)


def brightness_ratios(rgb: NDArray[np.uint8], background: BackgroundPixels) -> Array | None:
    """Return by how much brighter red, green and blue are than the background, in linear light: (3,).

    rgb (h, w, 3). None where the image is as bright as it was, or too few pixels agree on how much it has changed.
    """
    stride = max(1, int(np.sqrt(rgb.shape[0] * rgb.shape[1] / _SAMPLES)))
    counts = np.zeros((3, _N_BINS), np.int32)
    _count_ratios(rgb, background.mean, background.n_observations, stride, _LOG_LIGHT, counts)
    ratios = np.zeros(3)
    for k, each in enumerate(counts):
        n = int(each.sum())
        if n < _FEWEST:
            return None
        median = int(np.searchsorted(np.cumsum(each), n / 2))
        if each[max(median - _ALIKE_BINS, 0) : median + _ALIKE_BINS + 1].sum() < _LEAST_SHARE * n:
            return None
        ratios[k] = (median - _N_BINS // 2) * _BIN
    return np.exp(ratios) if np.abs(ratios).max() > _LEAST_LOG else None


def divide_brightness(rgb: NDArray[np.uint8], ratios: Array) -> NDArray[np.uint8]:
    """Return an image (h, w, 3) as it would be without these ratios (3,) of linear light."""
    light = light_from_srgb(np.arange(256.0))[:, None] / ratios
    table = np.round(srgb_from_light(light)).astype(np.uint8)[None]
    return np.asarray(cv2.LUT(rgb, table), np.uint8)


@kernel
def _count_ratios(rgb, mean, n_observations, stride, log_light, counts):
    """Count the log ratios of every n-th pixel (h, w, 3) and its background's mean, in bins: counts (3, bins)."""
    h, w, _ = rgb.shape
    for y in range(stride // 2, h, stride):
        for x in range(stride // 2, w, stride):
            if n_observations[y, x] <= 0:
                continue
            for k in range(3):
                now, before = rgb[y, x, k], int(mean[y, x, k] + np.float32(0.5))
                if _DARK <= now <= _BRIGHT and _DARK <= before <= _BRIGHT:
                    ratio = (log_light[now] - log_light[before]) / np.float32(_BIN)
                    at = int(np.floor(ratio + np.float32(0.5))) + counts.shape[1] // 2
                    if 0 <= at < counts.shape[1]:
                        counts[k, at] += 1
