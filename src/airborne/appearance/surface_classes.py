"""Surface classes (skin, shorts, shoes): evidence maps of all of them, by one look-up a pixel.

The evidence of a pixel for a class, in nats, is log((1 - o) p(colour | class) + o p(colour | anyone)) less the same of
the background: o is the probability that somebody else is there, in front of the player or beside him, dressed like him
or not. No kernel uses fast maths, so that maps are the same to the last bit however it was compiled.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airborne.appearance.foreground import BINS_PER_CHANNEL
from airborne.kernels import kernel
from airborne.types import Array32

TABLE_COLUMNS = 8  # room for the classes, a whole number of cache lines
_FLOOR = 1e-6  # probability of a bin that was never observed
_SHARED_COLOURS = 0.8  # share of what anyone wears that has the player's own colours


def log_ratio_table(classes: NDArray, background: NDArray, occlusion: NDArray) -> Array32:
    """Return the table (32768, TABLE_COLUMNS) of evidence [nats]; classes (k, 32, 32, 32) are colour probabilities.

    background (32, 32, 32) likewise, occlusion (k,) the probability that somebody else covers a pixel of that class.
    """
    table = np.zeros((BINS_PER_CHANNEL**3, TABLE_COLUMNS), np.float32)
    flat = np.ascontiguousarray(classes.reshape(len(classes), -1), np.float32)
    _fill_table(flat, np.ascontiguousarray(background.reshape(-1), np.float32), occlusion.astype(np.float32), table)
    return table


@kernel
def _fill_table(classes, background, occlusion, table):
    n, cells = classes.shape
    one = np.float32(1)
    for cell in range(cells):
        most = background[cell]
        for c in range(n):
            most = max(most, classes[c, cell])
        if most == 0:  # a colour that nothing has is no evidence
            continue
        anyone = np.float32((1 - _SHARED_COLOURS) / cells)
        for c in range(n):
            anyone += np.float32(_SHARED_COLOURS / n) * classes[c, cell]
        for c in range(n):
            o = occlusion[c]
            other = o * anyone + np.float32(_FLOOR)
            table[cell, c] = np.log(((one - o) * classes[c, cell] + other) / ((one - o) * background[cell] + other))


@kernel
def class_evidence(rgb, table, reduction, out):
    """Fill out (5, h // r, w // r) with the mean evidence over blocks of r x r pixels of rgb (h, w, 3) uint8."""
    _, h, w = out.shape
    share = np.float32(1.0 / (reduction * reduction))
    for y in range(h):
        for x in range(w):
            a, b, c, d, e = np.float32(0), np.float32(0), np.float32(0), np.float32(0), np.float32(0)
            for j in range(y * reduction, (y + 1) * reduction):
                for i in range(x * reduction, (x + 1) * reduction):
                    cell = (int(rgb[j, i, 0]) >> 3 << 10) | (int(rgb[j, i, 1]) >> 3 << 5) | (int(rgb[j, i, 2]) >> 3)
                    a += table[cell, 0]
                    b += table[cell, 1]
                    c += table[cell, 2]
                    d += table[cell, 3]
                    e += table[cell, 4]
            out[0, y, x], out[1, y, x], out[2, y, x] = share * a, share * b, share * c
            out[3, y, x], out[4, y, x] = share * d, share * e


@kernel
def blur_maps(maps, out):
    """Blur maps (k, h, w) with [1 2 1] / 4 along rows and columns into out; the border stays."""
    k, h, w = maps.shape
    quarter, two = np.float32(0.25), np.float32(2)
    row = np.empty(w, np.float32)
    for c in range(k):
        for y in range(h):
            above, here, below, to = maps[c, max(y - 1, 0)], maps[c, y], maps[c, min(y + 1, h - 1)], out[c, y]
            for x in range(w):
                row[x] = quarter * (above[x] + two * here[x] + below[x])
            for x in range(1, w - 1):
                to[x] = quarter * (row[x - 1] + two * row[x] + row[x + 1])
            for x in (0, w - 1):
                to[x] = quarter * (row[max(x - 1, 0)] + two * row[x] + row[min(x + 1, w - 1)])
