"""Unknown light, fitted in closed form: brightness as a linear function of the surface normal, per view and channel.

A face's light is a + b . n, the first two orders of spherical harmonics: enough for a diffuse body under any distant
lamps. Cast shadows are outliers and are weighted down. Colours are linear light, 0..1.
"""

from __future__ import annotations

import numpy as np

from airborne.kernels import kernel
from airborne.kernels.arrays import solve_positive
from airborne.rendering.srgb import light_from_srgb

LIGHT_FROM_SRGB = light_from_srgb(np.arange(1024.0) * (255 / 1023)).astype(np.float32)
_RIDGE = 1e-4  # of the direction-dependent part toward zero, per pixel of unit albedo
LIGHT_TERMS = 6  # ambient light, normal (3), image coordinates (2)
_MOST_SAMPLES = 300  # pixels of a face from which its light is fitted
_BORDER_WEIGHT = np.float32(0.02)  # weight of a mixed pixel: it matters only for faces that have no other
_SAME_FACE = 0.9  # cosine between neighbouring normals


@kernel(fastmath=True)
def light_planes(image, table, out):
    """Turn an image (h, w, 3), sRGB 0..255 of any type, into planes (3, h, w) by a table like `LIGHT_FROM_SRGB`."""
    h, w, _ = image.shape
    for y in range(h):
        for k in range(3):
            for x in range(w):
                out[k, y, x] = table[np.uint32(np.float32(image[y, x, k]) * np.float32(1023 / 255) + np.float32(0.5))]


@kernel(fastmath=True)
def fit_light(observed, part, normals, albedo, cloth, coefficients, iterations, x0, y0, x1, y1):
    """Fit coefficients (3, LIGHT_TERMS) in place: albedo * (a + b . n + c . u) is the light observed inside the mask.

    u (2,) runs from -1 to 1 over the region. observed (3, h, w) linear light, part (h, w) index or -1, normals
    (3, h, w) unit, albedo (parts, 3), cloth (parts,) alike for parts of one cloth; only the window x0 <= x < x1,
    y0 <= y < y1 is used. Pixels at a border of the mask, of a cloth or of a face are mixed and count little. With fewer
    than twelve pixels the coefficients do not change. Returns the robust sd of the residual.
    """
    inside = 0
    for y in range(y0, y1):
        for x in range(x0, x1):
            inside += part[y, x] >= 0
    if inside < 12:
        return np.float32(1.0)
    n = min(inside, _MOST_SAMPLES)
    share = np.uint64(n / inside * 2**32)
    rows, confidence = np.empty((LIGHT_TERMS, n), np.float32), np.empty(n, np.float32)
    values, own = np.empty((3, n), np.float32), np.empty((3, n), np.float32)
    i, count = 0, 0
    for y in range(y0, y1):
        for x in range(x0, x1):
            if part[y, x] < 0:
                continue
            scattered = (np.uint64(count) * np.uint64(2654435761)) & np.uint64(0xFFFFFFFF)  # no pattern
            if i < n and (n == inside or scattered < share):
                confidence[i] = 1 if _is_surrounded(part, cloth, normals, y, x) else _BORDER_WEIGHT
                rows[0, i] = 1
                rows[4, i], rows[5, i] = _region_coordinates(part, y, x)
                for k in range(3):
                    rows[k + 1, i] = normals[k, y, x]
                    values[k, i] = observed[k, y, x]
                    own[k, i] = albedo[part[y, x], k]
                i += 1
            count += 1
    error, light, weight, weighted = np.empty((4, i), np.float32)
    sd = np.float32(1.0)
    for step in range(iterations + 1):
        error[:] = 0
        for k in range(3):
            light[:] = 0
            for q in range(LIGHT_TERMS):
                c = coefficients[k, q]
                for j in range(i):
                    light[j] += c * rows[q, j]
            for j in range(i):
                error[j] += abs(values[k, j] - own[k, j] * light[j])
        sd = np.float32(1.48) * np.median(error) + np.float32(1e-3)
        if step == iterations:
            break
        half = np.float32(0.5) / sd
        for k in range(3):
            normal_matrix = np.zeros((LIGHT_TERMS, LIGHT_TERMS))
            right = np.zeros(LIGHT_TERMS)
            for j in range(i):
                q = error[j] * half
                down = np.float32(1) / (np.float32(1) + q * q)
                weight[j] = down * down * own[k, j] * confidence[j]
            for p in range(LIGHT_TERMS):
                total = 0.0
                for j in range(i):
                    total += weight[j] * rows[p, j] * values[k, j]
                right[p] = total
                for j in range(i):
                    weighted[j] = weight[j] * own[k, j] * rows[p, j]
                for r in range(p + 1):
                    total = 0.0
                    for j in range(i):
                        total += weighted[j] * rows[r, j]
                    normal_matrix[p, r] = total
            trace = normal_matrix[0, 0]
            normal_matrix[0, 0] += 1e-9
            for p in range(1, LIGHT_TERMS):
                normal_matrix[p, p] += _RIDGE * trace + 1e-9
            solve_positive(normal_matrix, right)
            for p in range(LIGHT_TERMS):
                coefficients[k, p] = right[p]
    return sd


@kernel(fastmath=True, is_inner=True)
def _region_coordinates(part, y, x):
    """Return a pixel's coordinates in its region, -1 to 1 in both directions."""
    h, w = part.shape
    return np.float32(2) * x / w - np.float32(1), np.float32(2) * y / h - np.float32(1)


@kernel(fastmath=True, is_inner=True)
def _is_surrounded(part, cloth, normals, y, x):
    """Say whether the four neighbours show the same cloth, facing nearly the same way."""
    h, w = part.shape
    for dy, dx in ((0, -1), (0, 1), (-1, 0), (1, 0)):
        v, u = y + dy, x + dx
        if not (0 <= v < h and 0 <= u < w) or part[v, u] < 0 or cloth[part[v, u]] != cloth[part[y, x]]:
            return False
        cosine = np.float32(0)
        for k in range(3):
            cosine += normals[k, y, x] * normals[k, v, u]
        if cosine < _SAME_FACE:
            return False
    return True


@kernel(fastmath=True)
def shade_body(part, normals, albedo, coefficients, x0, y0, lit):
    """Fill lit (3, h, w), zero before, with the body's linear light; (x0, y0) is the first pixel of its window.

    part (H, W) index or -1, normals (3, H, W) unit, albedo (parts, 3), coefficients (3, LIGHT_TERMS) of `fit_light`.
    """
    _, h, w = lit.shape
    for y in range(h):
        for x in range(w):
            p = part[y + y0, x + x0]
            if p < 0:
                continue
            u, v = _region_coordinates(part, y + y0, x + x0)
            n0, n1, n2 = normals[0, y + y0, x + x0], normals[1, y + y0, x + x0], normals[2, y + y0, x + x0]
            for k in range(3):
                c = coefficients[k]
                light = max(c[0] + c[1] * n0 + c[2] * n1 + c[3] * n2 + c[4] * u + c[5] * v, np.float32(0))
                lit[k, y, x] = albedo[p, k] * light


@kernel(fastmath=True)
def flatten_shading(part, albedo, is_faceted, cloth, lit):
    """Give every cloth that is not faceted its mean light: shading does not rotate with a smooth surface.

    What is left shows how the image would move with the body; see `shade_body` for the arguments.
    """
    _, h, w = lit.shape
    total, whole = np.zeros((2, len(is_faceted), 3), np.float32)
    for y in range(h):
        for x in range(w):
            p = part[y, x]
            if p >= 0:
                c = cloth[p]
                for k in range(3):
                    total[c, k] += lit[k, y, x]
                    whole[c, k] += albedo[p, k]
    for y in range(h):
        for x in range(w):
            p = part[y, x]
            if p >= 0 and not is_faceted[p]:
                for k in range(3):
                    if whole[cloth[p], k] > 0:
                        lit[k, y, x] = albedo[p, k] * (total[cloth[p], k] / whole[cloth[p], k])
