"""Separable blur of float32 planes, by a Gaussian of nine taps."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from airborne.kernels import kernel

RADIUS_PX = 4  # radius of the blur: three sds of the widest one used
RING = 2 * RADIUS_PX + 1  # rows that a blur needs at once
_LEAST_TAP = 1e-5  # less is below the rounding of what is blurred, 8 bits


@lru_cache(maxsize=64)
def gaussian_taps(sigma_px: float) -> np.ndarray:
    """Return the five taps of a Gaussian, centre first: the four on either side are equal and are stored once."""
    taps = np.exp(-0.5 * (np.arange(RADIUS_PX + 1) / sigma_px) ** 2)
    return (taps / (2 * taps.sum() - taps[0])).astype(np.float32)


@kernel(fastmath=True)
def blur_planes(planes, taps_u, taps_v, out):
    """Blur planes (c, h, w) with separable symmetric taps (5,) into out; outside the planes the border is repeated."""
    c, h, w = planes.shape
    u0, u1, u2, u3, u4 = taps_u[0], taps_u[1], taps_u[2], taps_u[3], taps_u[4]
    v0, v1, v2, v3, v4 = taps_v[0], taps_v[1], taps_v[2], taps_v[3], taps_v[4]
    padded = np.empty(w + 2 * RADIUS_PX, np.float32)
    rows = np.empty((h + 2 * RADIUS_PX, w), np.float32)
    for k in range(c):
        for y in range(h):
            for x in range(RADIUS_PX):
                padded[x] = planes[k, y, 0]
                padded[w + RADIUS_PX + x] = planes[k, y, w - 1]
            for x in range(w):
                padded[RADIUS_PX + x] = planes[k, y, x]
            for x in range(w):
                rows[y + RADIUS_PX, x] = (
                    u0 * padded[x + 4]
                    + u1 * (padded[x + 3] + padded[x + 5])
                    + u2 * (padded[x + 2] + padded[x + 6])
                    + u3 * (padded[x + 1] + padded[x + 7])
                    + u4 * (padded[x] + padded[x + 8])
                )
        for y in range(RADIUS_PX):
            for x in range(w):
                rows[y, x], rows[h + RADIUS_PX + y, x] = rows[RADIUS_PX, x], rows[h + RADIUS_PX - 1, x]
        for y in range(h):
            for x in range(w):
                out[k, y, x] = (
                    v0 * rows[y + 4, x]
                    + v1 * (rows[y + 3, x] + rows[y + 5, x])
                    + v2 * (rows[y + 2, x] + rows[y + 6, x])
                    + v3 * (rows[y + 1, x] + rows[y + 7, x])
                    + v4 * (rows[y, x] + rows[y + 8, x])
                )


@kernel(fastmath=True, is_inner=True)
def blur_row(ring, y, taps_u, taps_v, middle, out):
    """Blur row y of n numbers, planes side by side; `ring` (9, n) holds it at y % 9, and the rows around it too.

    Fills out (n,), but for its ends. Where planes meet, within RADIUS_PX, the result is of both. middle (n,) is
    overwritten.
    """
    n, row, v = len(middle), ring[y % RING], taps_v[0]
    for x in range(n):
        middle[x] = v * row[x]
    for i in range(1, RADIUS_PX + 1):
        v = taps_v[i]
        if v < _LEAST_TAP:
            break
        above, below = ring[(y - i) % RING], ring[(y + i) % RING]
        for x in range(n):
            middle[x] += v * (above[x] + below[x])
    u0, u1, u2, u3, u4 = taps_u[0], taps_u[1], taps_u[2], taps_u[3], taps_u[4]
    for x in range(n - 2 * RADIUS_PX):
        out[x + 4] = (
            u0 * middle[x + 4]
            + u1 * (middle[x + 3] + middle[x + 5])
            + u2 * (middle[x + 2] + middle[x + 6])
            + u3 * (middle[x + 1] + middle[x + 7])
            + u4 * (middle[x] + middle[x + 8])
        )
