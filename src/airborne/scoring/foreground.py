"""Which pixels look like the body: colour histograms of body and background, learned while tracking.

The histograms have 32 bins a channel of sRGB. A pixel's evidence is log p(colour | body) - log p(colour | background)
in nats; where the empty scene is known (`plate`), a pixel that looks like it is background whatever its colour.
"""

from __future__ import annotations

import numpy as np
from numba import njit

BINS = 32
EVIDENCE_LIMIT = 5.0  # nats; no single pixel may shout louder
_UNSEEN = 2e-5  # probability given to a colour never seen, a bin
_SPREAD = np.array([0.25, 0.5, 0.25], np.float32)  # a colour also counts in its neighbours' bins


@njit(cache=True, nogil=True)
def count_colours(rgb, chosen, stride, counts):
    """Add the colours of the chosen pixels to counts (32, 32, 32), each spread over its 27 neighbours' bins.

    rgb (h, w, 3) uint8, chosen (h, w) bool; every `stride`-th chosen pixel is taken. Returns how many were.
    """
    h, w, _ = rgb.shape
    seen, taken = 0, 0
    for y in range(h):
        for x in range(w):
            if not chosen[y, x]:
                continue
            seen += 1
            if seen % stride:
                continue
            taken += 1
            r, g, b = rgb[y, x, 0] >> 3, rgb[y, x, 1] >> 3, rgb[y, x, 2] >> 3
            for i in range(-1, 2):
                for j in range(-1, 2):
                    for k in range(-1, 2):
                        ri, gj, bk = min(max(r + i, 0), 31), min(max(g + j, 0), 31), min(max(b + k, 0), 31)
                        counts[ri, gj, bk] += _SPREAD[i + 1] * _SPREAD[j + 1] * _SPREAD[k + 1]
    return taken


@njit(cache=True, nogil=True, fastmath=True)
def evidence(rgb, body, background, plate, plate_sd, known, evidence_out, posterior_out):
    """Fill evidence_out (h, w) [nats] and posterior_out (h, w), the body's probability at even odds.

    rgb (h, w, 3) uint8; body, background (32, 32, 32) probabilities; plate (h, w, 3) the empty scene's sRGB with sd
    plate_sd (h, w) grey levels, used where known (h, w) is above zero.
    """
    h, w, _ = rgb.shape
    limit = np.float32(EVIDENCE_LIMIT)
    for y in range(h):
        for x in range(w):
            r, g, b = rgb[y, x, 0], rgb[y, x, 1], rgb[y, x, 2]
            p_body = body[r >> 3, g >> 3, b >> 3] + _UNSEEN
            p_back = background[r >> 3, g >> 3, b >> 3] + _UNSEEN
            if known[y, x] > 0:
                d0, d1, d2 = r - plate[y, x, 0], g - plate[y, x, 1], b - plate[y, x, 2]
                s = plate_sd[y, x]
                mass = 32.5 / (s * s * s)  # a bin's share of the normal density at its centre: 8^3 / (2 pi)^1.5
                near = min(mass, 1.0) * np.exp(-0.5 * (d0 * d0 + d1 * d1 + d2 * d2) / (s * s))
                p_back = 0.5 * p_back + 0.5 * near
            value = np.log(p_body / p_back)
            evidence_out[y, x] = min(max(value, -limit), limit)
            posterior_out[y, x] = p_body / (p_body + p_back)
