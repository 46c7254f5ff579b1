"""Colours as bins of hue and saturation, read through a table.

There are 110 bins (after Pérez et al. 2002): 10 of hue by 10 of saturation for pixels with colour (saturation above
0.1, value above 0.2), then 10 of value for the rest. What lies outside an image has a bin of its own.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from airborne.kernels import kernel
from airborne.types import Array32

HSV_BINS = 110  # 10 hues x 10 saturations, and 10 values of what has no colour (Pérez et al. 2002)
OUTSIDE = HSV_BINS  # the bin of what no image shows
CODES = 1 << 15  # RGB with 5 bits a channel

_SATURATION_FROM, _VALUE_FROM = 0.1, 0.2  # above both, a pixel has a colour


def hsv_bins(rgb: NDArray) -> NDArray[np.uint8]:
    """Return the bin 0 to 109 of each sRGB colour (..., 3), 0 to 255: (...)."""
    rgb = np.asarray(rgb, float) / 255
    value, least = rgb.max(axis=-1), rgb.min(axis=-1)
    chroma = value - least
    saturation = np.divide(chroma, value, out=np.zeros_like(value), where=value > 0)
    r, g, b = np.moveaxis(rgb, -1, 0)
    sixth = np.select([value == r, value == g], [g - b, b - r + 2 * chroma], r - g + 4 * chroma)
    hue = np.divide(sixth, 6 * chroma, out=np.zeros_like(value), where=chroma > 0) % 1.0
    tenth = [np.minimum((10 * x).astype(int), 9) for x in (hue, saturation, value)]
    has_colour = (saturation > _SATURATION_FROM) & (value > _VALUE_FROM)
    return np.where(has_colour, 10 * tenth[0] + tenth[1], 100 + tenth[2]).astype(np.uint8)


@cache
def bin_table() -> NDArray[np.uint16]:
    """Return the bin of every colour of 5 bits a channel, at the middle of its cell: (32768,), red slowest."""
    levels = 8.0 * np.arange(32) + 3.5
    table = hsv_bins(np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=-1)).astype(np.uint16).ravel()
    table.flags.writeable = False
    return table


@kernel
def look_up(rgb, table):
    """Return table[colour] of every pixel: rgb (h, w, 3) uint8, table (32768,) uint16 -> (h, w) uint16."""
    h, w, _ = rgb.shape
    codes = np.empty((h, w), np.uint16)
    for y in range(h):
        for x in range(w):
            r, g, b = np.int64(rgb[y, x, 0]), np.int64(rgb[y, x, 1]), np.int64(rgb[y, x, 2])
            codes[y, x] = table[((r >> 3) << 10) | ((g >> 3) << 5) | (b >> 3)]
    return codes


def root_histograms(counts: NDArray) -> Array32:
    """Return the square roots of histograms (..., bins) scaled to sum 1; zeros where nothing was counted."""
    counts = np.asarray(counts, float)
    total = counts.sum(axis=-1, keepdims=True)
    return np.sqrt(np.divide(counts, total, out=np.zeros_like(counts), where=total > 0)).astype(np.float32)
