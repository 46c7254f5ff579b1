"""sRGB, as image files store it, and linear light, as edges and exposures mix it. Source: IEC 61966-2-1."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airborne.types import Array, Array32, Floats

_LEVELS = 1 << 14  # of linear light in the table


def light_from_srgb(colours: Array | NDArray[np.uint8]) -> Array:
    """Turn sRGB 0..255 into linear light 0..1, any shape."""
    c = np.asarray(colours, float) / 255
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def srgb_from_light(light: Floats) -> Array32:
    """Turn linear light into sRGB 0..255, any shape, not rounded; what is brighter than 1 is clipped to 255."""
    index = np.clip(light * (_LEVELS - 1) + 0.5, 0, _LEVELS - 1).astype(np.int32)
    return _SRGB[index]


def _srgb_table() -> Array32:
    c = np.arange(_LEVELS) / (_LEVELS - 1)
    return (255 * np.where(c <= 0.0031308, 12.92 * c, 1.055 * c ** (1 / 2.4) - 0.055)).astype(np.float32)


_SRGB = _srgb_table()
