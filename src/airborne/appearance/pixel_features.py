"""Hue, saturation and brightness of pixels, by which colours are sorted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airborne.types import Array

_BLACK = 30.0  # [grey levels] added to all channels: dark pixels have no hue
_BRIGHTNESS_WEIGHT = 0.5  # of brightness, which shading changes, beside hue


def colour_features(rgb: NDArray[np.uint8]) -> Array:
    """Return by what pixels' colours are sorted: hue and saturation, and brightness with less weight: (..., 3)."""
    level = rgb.astype(float) + _BLACK
    total = level.sum(axis=-1)
    return np.stack(
        [level[..., 0] / total * 6, level[..., 2] / total * 6, _BRIGHTNESS_WEIGHT * np.log(total / 3 / 100)], axis=-1
    )
