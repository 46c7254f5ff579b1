"""Kernels: the normal equations of a silhouette's offset, by what stands out from the empty scene or by its light.

An offset (5,): shift right, shift down [px], turn clockwise [rad], log scale, about the silhouette's middle, and how
much wider the outline is [px]. Pixels on the border of an image do not count, as they have no gradient.
"""

from __future__ import annotations

import numpy as np

from airborne.kernels import kernel
from airborne.rendering.rows import f4

_LEAST_COVERED = 1e-6  # keeps quotients finite


@kernel(fastmath=True)
def foreground_equations(drawn, image, middle, offset, clip, least_steep):
    """Return H (5, 5) and g (5,) of H step = g, for a blurred foreground and the silhouette drawn at the offset.

    drawn, image (h, w); middle (2,) [px]. A residual of `clip` has a quarter of the weight; pixels count whose gradient
    is `least_steep` of the steepest or more.
    """
    H, g, J = np.zeros((5, 5)), np.zeros(5), np.empty(5)
    h, w = drawn.shape
    gradient, steep2, steepest2 = np.empty((2, h, w), np.float32), np.empty((h, w), np.float32), f4(0)
    for y in range(1, h - 1):
        for x in range(1, w - 1):
            gx, gy = _gradient(drawn, y, x)
            gradient[0, y, x], gradient[1, y, x], steep2[y, x] = gx, gy, gx * gx + gy * gy
            steepest2 = max(steepest2, steep2[y, x])
    least = f4(least_steep**2) * steepest2
    for y in range(1, h - 1):
        for x in range(1, w - 1):
            if steep2[y, x] <= least:
                continue
            steep = np.sqrt(steep2[y, x])
            r = image[y, x] - (drawn[y, x] + offset[4] * steep)
            gx, gy = gradient[0, y, x], gradient[1, y, x]
            _fill_row(J, gx, gy, steep, x - middle[0] - offset[0], y - middle[1] - offset[1])
            _add_row(H, g, J, r, 1 / (1 + (r / clip) ** 2) ** 2)
    _mirror(H)
    return H, g


@kernel(fastmath=True)
def mixture_equations(shares, rows, columns, light, scene):
    """Return A (k, k) and B (k, 3) of A own = B, `own` being the light of each of k sides, by the pixels inside.

    shares (k, h, w): of each side in every pixel; light, scene (n, 3): what the image shows at rows, columns (n,), and
    what lies behind the body.
    """
    k = len(shares)
    A, B = np.zeros((k, k)), np.zeros((k, 3))
    for n in range(len(rows)):
        y, x, covered = rows[n], columns[n], 0.0
        for i in range(k):
            covered += shares[i, y, x]
        if covered <= 0.5:
            continue
        for i in range(k):
            share = shares[i, y, x]
            if share == 0:
                continue
            for j in range(k):
                A[i, j] += share * shares[j, y, x]
            for c in range(3):
                B[i, c] += share * (light[n, c] - (1 - covered) * scene[n, c])
    return A, B


@kernel(fastmath=True)
def light_residuals(shares, own, rows, columns, light, scene):
    """Return the squared residual (n,) of a mixture of the sides' light `own` (k, 3) and the scene."""
    mixed, squares = _mix(shares, own), np.empty(len(rows))
    for n in range(len(rows)):
        y, x, square = rows[n], columns[n], 0.0
        for c in range(3):
            r = light[n, c] - (mixed[c, y, x] + (1 - mixed[3, y, x]) * scene[n, c])
            square += r * r
        squares[n] = square
    return squares


@kernel(fastmath=True)
def light_equations(shares, own, rows, columns, light, scene, middle, offset, clip2):
    """Return H (5, 5) and g (5,) of H step = g, for sides of a light `own` (k, 3) that are drawn at the offset.

    A squared residual of `clip2` has a quarter of the weight.
    """
    mixed, H, g = _mix(shares, own), np.zeros((5, 5)), np.zeros(5)
    J, r, h, w = np.empty((3, 5)), np.empty(3), mixed.shape[1], mixed.shape[2]
    for n in range(len(rows)):
        y, x, square = rows[n], columns[n], 0.0
        if y < 1 or x < 1 or y > h - 2 or x > w - 2:
            continue
        covered, (covered_x, covered_y) = mixed[3, y, x], _gradient(mixed[3], y, x)
        steep = np.sqrt(covered_x * covered_x + covered_y * covered_y)
        for c in range(3):
            gx, gy = _gradient(mixed[c], y, x)
            by_width = steep * (mixed[c, y, x] / max(covered, _LEAST_COVERED) - scene[n, c])
            by_x, by_y = gx - covered_x * scene[n, c], gy - covered_y * scene[n, c]
            _fill_row(J[c], by_x, by_y, by_width, x - middle[0] - offset[0], y - middle[1] - offset[1])
            r[c] = light[n, c] - (mixed[c, y, x] + (1 - covered) * scene[n, c]) - offset[4] * by_width
            square += r[c] * r[c]
        for c in range(3):
            _add_row(H, g, J[c], r[c], 1 / (1 + square / clip2) ** 2)
    _mirror(H)
    return H, g


@kernel(fastmath=True, is_inner=True)
def _mix(shares, own):
    """Return the sides' light in every pixel, and at last how much of it they cover: (4, h, w)."""
    mixed = np.zeros((4, shares.shape[1], shares.shape[2]), np.float32)
    for i in range(len(shares)):
        for c in range(4):
            value = np.float32(own[i, c] if c < 3 else 1.0)
            for y in range(shares.shape[1]):
                for x in range(shares.shape[2]):
                    mixed[c, y, x] += value * shares[i, y, x]
    return mixed


@kernel(fastmath=True, is_inner=True)
def _gradient(plane, y, x):
    """Return the gradient of a plane (h, w) by Sobel's operator [per px]."""
    a, b, c = plane[y - 1, x - 1], plane[y - 1, x], plane[y - 1, x + 1]
    d, e = plane[y, x - 1], plane[y, x + 1]
    f, g, h = plane[y + 1, x - 1], plane[y + 1, x], plane[y + 1, x + 1]
    two, scale = f4(2), f4(1 / 8)
    return scale * ((c - a) + two * (e - d) + (h - f)), scale * ((f - a) + two * (g - b) + (h - c))


@kernel(fastmath=True, is_inner=True)
def _fill_row(J, gx, gy, by_width, dx, dy):
    """Fill J (5,) with how a drawn value of this gradient changes by the offset, (dx, dy) from its middle."""
    J[0], J[1], J[2], J[3], J[4] = -gx, -gy, gx * dy - gy * dx, -gx * dx - gy * dy, by_width


@kernel(fastmath=True, is_inner=True)
def _add_row(H, g, J, r, weight):
    """Add a row's products to the upper triangle of H (5, 5) and to g (5,)."""
    for i in range(5):
        g[i] += weight * J[i] * r
        for j in range(i, 5):
            H[i, j] += weight * J[i] * J[j]


@kernel(fastmath=True, is_inner=True)
def _mirror(H):
    """Fill the lower triangle of a symmetric matrix."""
    for i in range(len(H)):
        for j in range(i):
            H[i, j] = H[j, i]
