"""The two fields of an interlaced image, as arrays: rows 0, 2, 4, ... (parity 0, top) and 1, 3, 5, ... (parity 1)."""

from __future__ import annotations

import numpy as np

from airborne.types import Image


def weave(top: Image, bottom: Image) -> Image:
    """Interleave two fields (h, w, 3) into an image (2h, w, 3): `top` on rows 0, 2, ..., `bottom` on rows 1, 3, ..."""
    woven = np.empty((2 * top.shape[0], *top.shape[1:]), top.dtype)
    woven[0::2] = top
    woven[1::2] = bottom
    return woven


def fill_rows(field: Image, parity: int, height: int) -> Image:
    """Give a field (h, w, 3) the full `height`: its own rows stay untouched, missing rows are interpolated.

    A missing row is the mean of its two neighbours; at the edge it copies its only one. Rows keep their positions, so
    a still scene does not move between fields. Source: rigid-body tracking paper, "separation of fields and
    interpolation of missing horizontal lines".
    """
    full = np.empty((height, *field.shape[1:]), field.dtype)
    full[parity::2] = field
    missing = full[1 - parity :: 2]
    above = np.arange(len(missing)) - parity  # the field's row above each missing row
    last = len(field) - 1
    upper, lower = field[np.clip(above, 0, last)], field[np.clip(above + 1, 0, last)]
    missing[:] = (upper.astype(np.uint16) + lower + 1) // 2
    return full
