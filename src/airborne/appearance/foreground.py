"""Which pixels look like the body: colour histograms of body and background, learned while tracking.

The histograms have 32 bins a channel of sRGB. A pixel's evidence is log p(colour | body) - log p(colour | background)
in nats; where a background model exists, a pixel that agrees with it is background whatever its colour.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airborne.kernels import kernel

BINS_PER_CHANNEL = 32  # of sRGB: 5 of its 8 bits
EVIDENCE_LIMIT = 5.0  # [nats] bound of a single pixel's evidence
_MOST = np.float32(1 / (1 + np.exp(-EVIDENCE_LIMIT)))  # posterior of that evidence, and of minus it
_LEAST = np.float32(1) - _MOST
_FLOOR = np.float32(2e-5)  # probability of a bin that was never observed
_BIN_AT_PEAK = np.float32(37.1)  # a bin's volume times the Student density's peak at an sd of one grey level
_HALF = np.float32(0.5)  # a float32, so that the kernel computes in single precision
_KERNEL = np.array([0.25, 0.5, 0.25], np.float32)  # a colour also counts in its neighbours' bins


@kernel
def count_colours(rgb, chosen, stride, counts, reach=1):
    """Add the colours of the chosen pixels to counts (32, 32, 32), each blurred over the 27 bins around it.

    rgb (h, w, 3) uint8, chosen (h, w) bool; every `stride`-th chosen pixel is taken. Returns how many. With a `reach`
    of 0 each is blurred over the 9 bins of its own red alone, at half the weight.
    """
    h, w, _ = rgb.shape
    n_chosen, taken = 0, 0
    for y in range(h):
        for x in range(w):
            if not chosen[y, x]:
                continue
            n_chosen += 1
            if n_chosen % stride:
                continue
            taken += 1
            _count_colour(rgb[y, x, 0] >> 3, rgb[y, x, 1] >> 3, rgb[y, x, 2] >> 3, reach, counts)
    return taken


@kernel
def _count_colour(r, g, b, reach, counts):
    """Add one pixel's colour, blurred over the bins around its own, to counts (32, 32, 32)."""
    for i in range(-reach, reach + 1):
        for j in range(-1, 2):
            for k in range(-1, 2):
                ri, gj, bk = min(max(r + i, 0), 31), min(max(g + j, 0), 31), min(max(b + k, 0), 31)
                counts[ri, gj, bk] += _KERNEL[i + 1] * _KERNEL[j + 1] * _KERNEL[k + 1]


@kernel(fastmath=True)
def blend_colours(rgb, chosen, stride, rate, old, out):
    """Fill out (32, 32, 32) with (1 - rate) old + rate times the shares of the chosen pixels' colours.

    The colours are counted as by `count_colours`. Returns how many pixels were taken; with none, out is not filled.
    """
    n_chosen = 0
    for y in range(chosen.shape[0]):
        for x in range(chosen.shape[1]):
            n_chosen += chosen[y, x]
    taken = n_chosen // stride
    if taken == 0:
        return taken
    counts = np.zeros_like(out)
    count_colours(rgb, chosen, stride, counts, 0)  # red is blurred below, for all pixels at once
    keep, share, last = np.float32(1 - rate), np.float32(rate / taken), BINS_PER_CHANNEL - 1
    for i in range(BINS_PER_CHANNEL):
        before, own, after = counts[max(i - 1, 0)], counts[i], counts[min(i + 1, last)]
        for j in range(BINS_PER_CHANNEL):
            for k in range(BINS_PER_CHANNEL):
                count = own[j, k] + _HALF * (before[j, k] + after[j, k])
                out[i, j, k] = keep * old[i, j, k] + share * count
    return taken


@kernel
def count_limb_colours(rgb, part, pair_of_part, most, counts, taken):
    """Count the colours of pairs of limbs in counts (pairs, 32, 32, 32), and in taken (pairs,) how many pixels.

    rgb (h, w, 3) uint8; part (h, w), -1 where none; pair_of_part (parts + 1,), -1 of none, which is the last. Pixels
    count between two of the same pair along a row, of a pair about `most`.
    """
    h, w = part.shape
    n_pairs = len(counts)
    seen = np.zeros(n_pairs, np.int64)
    for y in range(h):
        for x in range(w):
            pair = pair_of_part[part[y, x]]
            if pair >= 0:
                seen[pair] += 1
    stride = np.maximum(seen // most, 1)
    seen[:] = 0
    for y in range(h):
        for x in range(1, w - 1):
            pair = pair_of_part[part[y, x]]
            if pair < 0 or pair_of_part[part[y, x - 1]] != pair or pair_of_part[part[y, x + 1]] != pair:
                continue
            seen[pair] += 1
            if seen[pair] % stride[pair] == 0:
                taken[pair] += 1
                _count_colour(rgb[y, x, 0] >> 3, rgb[y, x, 1] >> 3, rgb[y, x, 2] >> 3, 1, counts[pair])


@kernel(fastmath=True)
def posterior(rgb, body, background, mean, sd, n_observations, out):
    """Fill out (h, w) with each pixel's probability to be body, at even odds.

    rgb (h, w, 3) uint8; body, background (32, 32, 32) probabilities; mean (h, w, 3), sd (h, w) the background model in
    grey levels, used where n_observations (h, w) is above zero: half of the background's probability is then a
    Student distribution (5 degrees of freedom) about the mean.
    """
    h, w, _ = rgb.shape
    for y in range(h):
        for x in range(w):
            r, g, b = rgb[y, x, 0], rgb[y, x, 1], rgb[y, x, 2]
            p_body = body[r >> 3, g >> 3, b >> 3] + _FLOOR
            p_back = background[r >> 3, g >> 3, b >> 3] + _FLOOR
            if n_observations[y, x] > 0:
                d0, d1, d2 = r - mean[y, x, 0], g - mean[y, x, 1], b - mean[y, x, 2]
                s2 = sd[y, x] * sd[y, x]
                near = _BIN_AT_PEAK / (s2 * sd[y, x])
                far2 = np.float32(1) + (d0 * d0 + d1 * d1 + d2 * d2) / (np.float32(5) * s2)
                far4 = far2 * far2
                p_back = _HALF * p_back + _HALF * min(near, np.float32(1)) / (far4 * far4)
            out[y, x] = p_body / (p_body + p_back)


@kernel(fastmath=True)
def log_odds(posterior, out):
    """Fill out (h, w) with the evidence of posterior (h, w): its log-odds [nats], within EVIDENCE_LIMIT."""
    limit = np.float32(EVIDENCE_LIMIT)
    h, w = posterior.shape
    for y in range(h):
        for x in range(w):
            p = min(max(posterior[y, x], np.float32(1e-6)), np.float32(1 - 1e-6))
            out[y, x] = min(max(np.log(p / (np.float32(1) - p)), -limit), limit)


@kernel  # under fast maths every pixel's logarithm is taken, and thrown away outside the mask: seven times slower
def posterior_sums(posterior, part, margin_u, margin_v):
    """Sum the posterior (h, w) over a mask, part (h, w) >= 0, and around it.

    Returns (pixels of the mask, posterior summed inside, posterior summed over the mask's box widened by the margins,
    evidence summed inside [nats]).
    """
    h, w = part.shape
    x0, y0, x1, y1 = w, h, -1, -1
    pixels, inside, nats = 0, 0.0, 0.0
    for y in range(h):
        before = pixels
        for x in range(w):
            if part[y, x] >= 0:
                x0, x1 = min(x0, x), max(x1, x)
                pixels += 1
                p = posterior[y, x]
                inside += p
                p = min(max(p, _LEAST), _MOST)
                nats += np.log(p / (np.float32(1) - p))
        if pixels > before:
            y0, y1 = min(y0, y), y
    near = 0.0
    for y in range(max(y0 - margin_v, 0), min(y1 + margin_v + 1, h)):
        near += posterior[y, max(x0 - margin_u, 0) : min(x1 + margin_u + 1, w)].sum()
    return pixels, inside, near, nats


def body_like(rgb: NDArray[np.uint8], part: NDArray[np.int16], colours: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Return which pixels of a mask have a hue nearer to their part's colour than to the background's: (h, w).

    rgb (h, w, 3); part (h, w) index or -1; colours (parts, 3) sRGB. Hues are chromaticities, which do not depend on the
    light's strength. Where less than a tenth of the mask would be left, the whole mask is returned.
    """
    observed, own = _chromaticity(rgb), _chromaticity(colours)
    inside = part >= 0
    if not inside.any() or inside.all():
        return inside
    background, to_body2, to_background2 = ~inside, np.zeros(part.shape, np.float32), np.zeros(part.shape, np.float32)
    for channel, own_channel in zip(observed, own, strict=True):
        to_body2 += (channel - own_channel[part]) ** 2
        to_background2 += (channel - np.median(channel[background])) ** 2
    alike = inside & (to_body2 < to_background2)
    return alike if np.count_nonzero(alike) > 0.1 * np.count_nonzero(inside) else inside


def _chromaticity(rgb: NDArray) -> list[NDArray[np.floating]]:
    """Return each channel's share of the sum of all three, which hardly depends on the light: 3 arrays (...)."""
    channels = [rgb[..., k].astype(np.float32) for k in range(3)]
    total = channels[0] + channels[1] + channels[2] + 1
    return [channel / total for channel in channels]
