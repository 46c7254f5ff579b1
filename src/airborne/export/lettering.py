"""Antialiased text in images, from the outlines of the font of the figures."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.io.figures import any_letters
from airborne.types import Image

Outline = NDArray[np.floating]

_BITS = 4  # of a pixel, for smooth edges
_EM = 100.0  # size at which outlines are kept


def draw_text(
    image: Image,
    text: str,
    at: tuple[float, float],
    *,
    size_px: float,
    rgb: tuple[int, int, int],
    bold: bool = False,
) -> None:
    """Write a line whose baseline begins at a pixel (x, y); `size_px` is the font's size."""
    outlines = [outline * [size_px / _EM, -size_px / _EM] + at for outline in _outlines(text, bold)]
    if outlines:
        points = [np.rint(outline * (1 << _BITS)).astype(np.int32) for outline in outlines]
        cv2.fillPoly(image, points, rgb, cv2.LINE_AA, _BITS)  # holes: what two outlines enclose stays free


def text_width(text: str, *, size_px: float, bold: bool = False) -> float:
    """Return how far a line reaches to the right [px]."""
    outlines = _outlines(text, bold)
    return max((float(outline[:, 0].max()) for outline in outlines), default=0.0) * size_px / _EM


@lru_cache(maxsize=512)
def _outlines(text: str, bold: bool) -> tuple[Outline, ...]:
    if not text:
        return ()
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    font = FontProperties(family="DejaVu Sans", weight="bold" if bold else "normal")
    with any_letters():
        path = TextPath((0, 0), text, size=_EM, prop=font)
    return tuple(np.asarray(polygon, float) for polygon in path.to_polygons())
