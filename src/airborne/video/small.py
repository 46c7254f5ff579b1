"""Small pictures of large ones."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from airborne.video.frames import View

_WIDTH_PX = 640  # about the usual width of small pictures


def shrink(view: View, width_px: int = _WIDTH_PX) -> View:
    """Return a view about as many columns wide, averages of areas that are about square."""
    camera, rgb = view.camera, view.rgb
    columns = max(1, round(camera.size[0] / width_px))
    rows = max(1, round(columns * camera.K[1, 1] / camera.K[0, 0]))
    if columns == rows == 1:
        return replace(view, image=rgb)
    size = camera.size[0] // columns, camera.size[1] // rows
    small = cv2.resize(rgb[: size[1] * rows, : size[0] * columns], size, interpolation=cv2.INTER_AREA)
    middle = ((columns - 1) / 2, (rows - 1) / 2)
    own = camera.resample(scale=(columns, rows), offset=middle, size=size)
    return replace(view, camera=own, image=np.asarray(small, np.uint8))
