"""Unknown light, fitted in closed form: brightness as a linear function of the surface normal, per view and channel.

A face's light is a + b . n, the first two orders of spherical harmonics: enough for a diffuse body under any distant
lamps. Cast shadows are outliers and are weighted down. Colours are linear light, 0..1.
"""

from __future__ import annotations

import numpy as np
from numba import njit

_srgb = np.arange(1024) / 1023
TO_LIGHT = np.where(_srgb <= 0.04045, _srgb / 12.92, ((_srgb + 0.055) / 1.055) ** 2.4).astype(np.float32)
_RIDGE = 1e-4  # pull of the direction-dependent part toward zero, per pixel of unit albedo
_MOST_SAMPLES = 500


def light_from_srgb(colours):
    """Turn sRGB 0..255 into linear light 0..1, any shape."""
    c = np.asarray(colours, float) / 255
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


@njit(cache=True, nogil=True, fastmath=True)
def light_planes(image, table, out):
    """Turn an image (h, w, 3), sRGB 0..255 of any type, into planes (3, h, w) by a table of 1024 entries (`TO_LIGHT`)."""
    h, w, _ = image.shape
    for k in range(3):
        for y in range(h):
            for x in range(w):
                out[k, y, x] = table[int(image[y, x, k] * np.float32(1023 / 255) + np.float32(0.5))]


@njit(cache=True, nogil=True, fastmath=True)
def fit_light(observed, part, normals, albedo, coefficients, rounds, x0, y0, x1, y1):
    """Fit coefficients (3, 4) in place so that albedo * (a + b . n) is the observed light inside the mask.

    observed (3, h, w) linear light, part (h, w) index or -1, normals (3, h, w) unit, albedo (parts, 3); only the window
    x0 <= x < x1, y0 <= y < y1 is looked at, and pixels at the mask's border are left out. Under twelve pixels, the
    coefficients stay. Returns the robust sd of what stays unexplained.
    """
    inside = 0
    for y in range(y0, y1):
        for x in range(x0 + 1, x1 - 1):
            if part[y, x] >= 0 and part[y, x - 1] >= 0 and part[y, x + 1] >= 0:
                inside += 1
    if inside < 12:
        return np.float32(1.0)
    stride = max(1, inside // _MOST_SAMPLES)
    n = inside // stride
    rows = np.empty((n, 4), np.float32)
    seen = np.empty((n, 3), np.float32)
    own = np.empty((n, 3), np.float32)
    i, count = 0, 0
    for y in range(y0, y1):
        for x in range(x0 + 1, x1 - 1):
            if part[y, x] >= 0 and part[y, x - 1] >= 0 and part[y, x + 1] >= 0:
                if count % stride == 0 and i < n:
                    rows[i, 0] = 1
                    for k in range(3):
                        rows[i, k + 1] = normals[k, y, x]
                        seen[i, k] = observed[k, y, x]
                        own[i, k] = albedo[part[y, x], k]
                    i += 1
                count += 1
    error = np.empty(i, np.float32)
    sd = np.float32(1.0)
    for step in range(rounds + 1):
        for j in range(i):
            e = np.float32(0)
            for k in range(3):
                light = np.float32(0)
                for q in range(4):
                    light += coefficients[k, q] * rows[j, q]
                e += abs(seen[j, k] - own[j, k] * light)
            error[j] = e
        sd = np.float32(1.48) * np.median(error) + np.float32(1e-3)
        if step == rounds:
            break
        for k in range(3):
            normal_matrix = np.zeros((4, 4))
            right = np.zeros(4)
            for j in range(i):
                q = error[j] / (2 * sd)
                weight = 1.0 / (1.0 + q * q)
                weight *= weight * own[j, k]
                for p in range(4):
                    right[p] += weight * rows[j, p] * seen[j, k]
                    for r in range(4):
                        normal_matrix[p, r] += weight * own[j, k] * rows[j, p] * rows[j, r]
            trace = normal_matrix[0, 0]
            normal_matrix[0, 0] += 1e-9
            for p in range(1, 4):
                normal_matrix[p, p] += _RIDGE * trace + 1e-9
            solved = np.linalg.solve(normal_matrix, right)
            for p in range(4):
                coefficients[k, p] = solved[p]
    return sd


@njit(cache=True, nogil=True, fastmath=True)
def compose(observed, scene, part, normals, albedo, is_faceted, coefficients, x0, y0, residual, shape):
    """Fill residual = observed - composite and shape = the body's light on black, both (3, h, w) linear light.

    scene (3, ...) is the empty scene; the composite shows the lit body in front of it. In `shape`, which says how the
    picture would move with the body, a part that is not faceted has its mean light all over: shading does not turn with
    a smooth surface. (x0, y0) is the first pixel of the window that residual and shape cover.
    """
    _, h, w = residual.shape
    total, count = np.empty(len(albedo), np.float32), np.empty(len(albedo), np.float32)
    for k in range(3):
        total[:] = 0
        count[:] = 1e-6
        for y in range(h):
            for x in range(w):
                p = part[y + y0, x + x0]
                empty = scene[k, y + y0, x + x0]
                if p < 0:
                    residual[k, y, x] = observed[k, y + y0, x + x0] - empty
                    shape[k, y, x] = 0
                    continue
                light = coefficients[k, 0]
                for q in range(3):
                    light += coefficients[k, q + 1] * normals[q, y + y0, x + x0]
                light = max(light, np.float32(0))
                colour = albedo[p, k] * light
                residual[k, y, x] = observed[k, y + y0, x + x0] - colour
                shape[k, y, x] = colour
                total[p] += light
                count[p] += 1
        for p in range(len(albedo)):
            if not is_faceted[p] and count[p] > 1:
                _paint_evenly(part, k, p, albedo[p, k] * total[p] / count[p], x0, y0, shape)


@njit(cache=True, nogil=True, fastmath=True)
def _paint_evenly(part, k, p, colour, x0, y0, shape):
    _, h, w = shape.shape
    for y in range(h):
        for x in range(w):
            if part[y + y0, x + x0] == p:
                shape[k, y, x] = colour
