"""Pictures of how a rendering agrees with a view, all RGB uint8 (paper B, fig. 2)."""

from __future__ import annotations

import numpy as np

from airborne.rendering.drawing import Rendering
from airborne.types import Image


def model_picture(rendering: Rendering) -> Image:
    """Show the rendered body, on black (fig. 2b): (h, w, 3)."""
    return np.clip(np.rint(rendering.colour), 0, 255).astype(np.uint8)


def mask_picture(rendering: Rendering) -> Image:
    """Show the mask, white on black (fig. 2c): (h, w, 3)."""
    return np.repeat(rendering.mask[..., None].astype(np.uint8) * np.uint8(255), 3, axis=2)


def through_mask(rgb: Image, rendering: Rendering) -> Image:
    """Show the part of a view (H, W, 3) that the mask lets through, on black (fig. 2d): (h, w, 3)."""
    return np.where(rendering.mask[..., None], _region_of(rgb, rendering), np.uint8(0))


def match_picture(rgb: Image, rendering: Rendering) -> Image:
    """Show the agreement inside the mask, the brighter the better, on black (fig. 2e): (h, w, 3).

    Grey is 255 minus the root mean square difference of the channels.
    """
    difference = _region_of(rgb, rendering).astype(np.float32) - rendering.colour
    grey = 255 - np.sqrt(np.mean(difference**2, axis=2))
    grey = np.where(rendering.mask, np.clip(np.rint(grey), 0, 255), 0).astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=2)


def _region_of(rgb: Image, rendering: Rendering) -> Image:
    x0, y0, x1, y1 = rendering.region
    return rgb[y0:y1, x0:x1]
