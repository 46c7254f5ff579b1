"""The normal equations of one row, 16 pixels at a time, in float32; `twist_equations` says of what.

As in `rendering.rows`, all numbers of a step lie in one array, in planes of 16 at constant distances, so that LLVM puts
a plane into one register. Twists are about an origin near the body and in camera axes: the motion of a pixel (u, v)
on the ray (rx, ry, 1) by a twist is fx w (a . twist) to the right and fy w (b . twist) down, w its inverse depth, with
a = (1, 0, -rx, -rx qy, qz + rx qx, -qy), b = (0, 1, -ry, -qz - ry qy, ry qx, qx), q the point seen from the origin.
"""

from __future__ import annotations

import numpy as np

from airborne.kernels import kernel
from airborne.rendering.rows import LANES, f4

STRIP = 8 * LANES  # pixels of a row that are taken at once
EDGE = f4(0.01)  # blurred coverage below which a pixel is not used

# planes of a strip's terms: squared residual, its products with the gradients, the mask's gradient, what weighs a pixel
SQUARE, XX, XY, YY, X, Y, MX, MY, WEIGHT, NEARNESS, MINE, _R, _GX, _GY = (STRIP * k for k in range(14))
TERM_PLANES = STRIP * 14
# planes of the sums: the curvature's upper triangle (21), the changes of the gradient (18), the gradient (6), others
CHANGE, GRADIENT, TOTAL, WEIGHTS, SUM_PLANES = (LANES * k for k in (21, 39, 45, 46, 47))


@kernel(fastmath=True, is_inner=True)
def begin_terms(terms, n, blurred, above, here, below):
    """Begin the terms of n pixels with the blurred mask, of which `blurred` holds three rows at these offsets."""
    if n < 0 or above < 0 or here < 1 or below < 0:
        return
    for x in range(n):
        terms[MX + x] = f4(0.5) * (blurred[here + 1 + x] - blurred[here - 1 + x])
        terms[MY + x] = f4(0.5) * (blurred[below + x] - blurred[above + x])
    for k in range(6):
        for x in range(n):
            terms[SQUARE + STRIP * k + x] = f4(0)


@kernel(fastmath=True, is_inner=True)
def add_channel(terms, n, given, difference, background, blurred, change, shape, above, here, below):
    """Add a channel of n pixels: residual = difference - change; all but the first three arguments are offsets.

    shape holds rows like the blurred mask, at `above`, `here` and `below`.
    """
    if n < 0 or difference < 0 or background < 0 or change < 0 or above < 0 or here < 1 or below < 0:
        return
    for x in range(n):
        terms[_R + x] = given[difference + x] - blurred[change + x]
    for x in range(n):  # the background is uncovered where the body leaves
        along = f4(0.5) * (shape[here + 1 + x] - shape[here - 1 + x])
        terms[_GX + x] = along - given[background + x] * terms[MX + x]
    for x in range(n):
        terms[_GY + x] = f4(0.5) * (shape[below + x] - shape[above + x]) - given[background + x] * terms[MY + x]
    for x in range(n):
        r, gx, gy = terms[_R + x], terms[_GX + x], terms[_GY + x]
        terms[SQUARE + x] += r * r
        terms[XX + x] += gx * gx
        terms[XY + x] += gx * gy
        terms[YY + x] += gy * gy
        terms[X + x] += gx * r
        terms[Y + x] += gy * r


@kernel(fastmath=True, is_inner=True)
def weigh_pixels(terms, n, blurred, here, depth, given, certainty, empty, near, inverse_clip2):
    """Weigh n pixels by their residuals and fill in their inverse depth; return their costs, less the empty scene's.

    The inverse depth is `near` (n,), or where that is 0, the mean of what is blurred.
    """
    cost = f4(0)
    if n < 0 or here < 0 or depth < 0 or certainty < 0 or empty < 0:
        return cost
    for x in range(n):
        square = terms[SQUARE + x]
        down = f4(1) / (f4(1) + square * inverse_clip2)
        cost += given[certainty + x] * square * down - given[empty + x]
        terms[WEIGHT + x] = given[certainty + x] * down * down if blurred[here + x] >= EDGE else f4(0)
    for x in range(n):
        mean = blurred[depth + x] / max(blurred[here + x], EDGE)
        terms[NEARNESS + x] = near[x] if near[x] > 0 else mean
    return cost


@kernel(fastmath=True, is_inner=True)
def add_segment(terms, at, sums, to, rx_first, rx_step, ry, fx, fy, x, y, z, aspect2):
    """Add to a segment's sums those of 16 pixels that are its own, MINE being 1; (x, y, z) is the origin."""
    if at < 0 or to < 0:
        return
    for j in range(6 * LANES):
        sums[to + GRADIENT + j] = f4(0)
    for j in range(LANES):
        weight = terms[at + WEIGHT + j] * terms[at + MINE + j]
        sums[to + TOTAL + j] += weight * terms[at + SQUARE + j]
        sums[to + WEIGHTS + j] += weight
        w = terms[at + NEARNESS + j] if weight > 0 else f4(1)
        rx, depth = rx_first + f4(j) * rx_step, f4(1) / w
        qx, qy, qz = rx * depth - x, ry * depth - y, depth - z
        by_x, by_y = fx * w, fy * w
        p, q, r = (
            weight * terms[at + XX + j] * by_x * by_x,
            weight * terms[at + XY + j] * by_x * by_y,
            terms[at + YY + j],
        )
        r = weight * r * by_y * by_y
        s, t = weight * terms[at + X + j] * by_x, weight * terms[at + Y + j] * by_y
        a3, a4, a5 = -rx * qy, qz + rx * qx, -qy
        b3, b4, b5 = -qz - ry * qy, ry * qx, qx
        u2, v2 = -(p * rx + q * ry), -(q * rx + r * ry)
        u3, v3, u4, v4 = p * a3 + q * b3, q * a3 + r * b3, p * a4 + q * b4, q * a4 + r * b4
        u5, v5 = p * a5 + q * b5, q * a5 + r * b5
        mx, my = terms[at + MX + j], terms[at + MY + j]
        steepness = np.sqrt(mx * mx + aspect2 * my * my) + f4(1e-9)
        right, down = f4(1) / by_x, f4(1) / by_y
        out_x, out_y = -right * mx / steepness, -down * aspect2 * my / steepness
        sums[to + j] += p
        sums[to + LANES + j] += q
        sums[to + 2 * LANES + j] += u2
        sums[to + 3 * LANES + j] += u3
        sums[to + 4 * LANES + j] += u4
        sums[to + 5 * LANES + j] += u5
        sums[to + 6 * LANES + j] += r
        sums[to + 7 * LANES + j] += v2
        sums[to + 8 * LANES + j] += v3
        sums[to + 9 * LANES + j] += v4
        sums[to + 10 * LANES + j] += v5
        sums[to + 11 * LANES + j] -= rx * u2 + ry * v2
        sums[to + 12 * LANES + j] -= rx * u3 + ry * v3
        sums[to + 13 * LANES + j] -= rx * u4 + ry * v4
        sums[to + 14 * LANES + j] -= rx * u5 + ry * v5
        sums[to + 15 * LANES + j] += a3 * u3 + b3 * v3
        sums[to + 16 * LANES + j] += a3 * u4 + b3 * v4
        sums[to + 17 * LANES + j] += a3 * u5 + b3 * v5
        sums[to + 18 * LANES + j] += a4 * u4 + b4 * v4
        sums[to + 19 * LANES + j] += a4 * u5 + b4 * v5
        sums[to + 20 * LANES + j] += a5 * u5 + b5 * v5
        sums[to + 21 * LANES + j] += right * p
        sums[to + 22 * LANES + j] += right * q
        sums[to + 23 * LANES + j] += right * u2
        sums[to + 24 * LANES + j] += right * u3
        sums[to + 25 * LANES + j] += right * u4
        sums[to + 26 * LANES + j] += right * u5
        sums[to + 27 * LANES + j] += down * q
        sums[to + 28 * LANES + j] += down * r
        sums[to + 29 * LANES + j] += down * v2
        sums[to + 30 * LANES + j] += down * v3
        sums[to + 31 * LANES + j] += down * v4
        sums[to + 32 * LANES + j] += down * v5
        sums[to + 33 * LANES + j] += out_x * p + out_y * q
        sums[to + 34 * LANES + j] += out_x * q + out_y * r
        sums[to + 35 * LANES + j] += out_x * u2 + out_y * v2
        sums[to + 36 * LANES + j] += out_x * u3 + out_y * v3
        sums[to + 37 * LANES + j] += out_x * u4 + out_y * v4
        sums[to + 38 * LANES + j] += out_x * u5 + out_y * v5
        sums[to + 39 * LANES + j] -= s
        sums[to + 40 * LANES + j] -= t
        sums[to + 41 * LANES + j] += s * rx + t * ry
        sums[to + 42 * LANES + j] -= s * a3 + t * b3
        sums[to + 43 * LANES + j] -= s * a4 + t * b4
        sums[to + 44 * LANES + j] -= s * a5 + t * b5


@kernel(fastmath=True, is_inner=True)
def total_of(planes, start):
    """Return the sum of the 16 numbers of a plane."""
    total = 0.0
    for j in range(LANES):
        total += planes[start + j]
    return total
