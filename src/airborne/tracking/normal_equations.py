"""Gauss-Newton kernels: how a blurred synthetic picture would change if the body moved, against what the camera saw.

Arrays in, arrays out. Planes are (channels, h, w) float32. A window (x0, y0) is where a
plane's pixel (0, 0) lies in the region of interest whose intrinsics are K.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from airborne.rendering.maps import surface_maps
from airborne.rendering.shapes import KERNEL
from airborne.scoring.lighting import compose, fit_light

BLOCK_PX = 16  # residuals this close are not independent: the side of a block of the covariance's sandwich
RADIUS_PX = 4  # reach of the blur: three sds of the widest one used
_PAD_PX = RADIUS_PX + 3  # beyond it, the blurred mask is nothing
_EDGE = 0.01  # blurred coverage below which a pixel says nothing of the body


class Sums(NamedTuple):
    """Normal equations of a motion (6,): A motion = g, summed over pixels and views."""

    A: Any  # (6, 6) curvature; the lower triangle is filled
    g: Any  # (6,) gradient
    S: Any  # (6, 6) sum of g g' over blocks of the pictures
    B: Any  # (6, 3) what a picture shifted right or down by a pixel, or an outline a pixel fatter, does to g

    @classmethod
    def zero(cls) -> Sums:
        """Begin with nothing."""
        return cls(np.zeros((6, 6)), np.zeros(6), np.zeros((6, 6)), np.zeros((6, 3)))

    @property
    def curvature(self) -> np.ndarray:
        """A with both triangles (6, 6)."""
        return self.A + np.tril(self.A, -1).T


def gaussian_taps(sigma_px: float) -> np.ndarray:
    """Return the five taps of a Gaussian, centre first: the four on either side are equal and are stored once."""
    taps = np.exp(-0.5 * (np.arange(RADIUS_PX + 1) / sigma_px) ** 2)
    return (taps / (2 * taps.sum() - taps[0])).astype(np.float32)


@njit(**KERNEL)
def blur(planes, taps_u, taps_v, out):
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
            rows[y] = rows[RADIUS_PX]
            rows[h + RADIUS_PX + y] = rows[h + RADIUS_PX - 1]
        for y in range(h):
            for x in range(w):
                out[k, y, x] = (
                    v0 * rows[y + 4, x]
                    + v1 * (rows[y + 3, x] + rows[y + 5, x])
                    + v2 * (rows[y + 2, x] + rows[y + 6, x])
                    + v3 * (rows[y + 1, x] + rows[y + 7, x])
                    + v4 * (rows[y, x] + rows[y + 8, x])
                )


@njit(**KERNEL)
def window_of(part):
    """Return the padded window (x0, y0, x1, y1) round the body's pixels; (0, 0, 0, 0) where there is none."""
    h, w = part.shape
    x0, y0, x1, y1 = w, h, -1, -1
    for y in range(h):
        for x in range(w):
            if part[y, x] >= 0:
                x0, x1 = min(x0, x), max(x1, x)
                y0, y1 = min(y0, y), max(y1, y)
    if x1 < 0:
        return 0, 0, 0, 0
    return max(x0 - _PAD_PX, 0), max(y0 - _PAD_PX, 0), min(x1 + _PAD_PX + 1, w), min(y1 + _PAD_PX + 1, h)


@njit(**KERNEL)
def accumulate(residual, shape, coverage, inverse_depth, scene, certainty, x0, y0, K, view, origin, clip, sums):
    """Add one view's normal equations for a rigid motion about `origin` [m]: A motion = g.

    residual, shape (c, h, w): blurred observed minus rendered, and the blurred colours of the body on black; coverage,
    inverse_depth (h, w) blurred alike; scene (c, region) what the body moves in front of; certainty (region) in (0, 1]
    scales a pixel's weight; clip: the residual at which a pixel's weight has fallen to a quarter. The motion is a
    translation [m] and a rotation vector [rad] in world axes. Adds to `sums`; returns (weighted squared residual,
    weight).
    """
    A, g, S, B = sums
    c, h, w = residual.shape
    fx, fy, cx, cy = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    a, b = np.zeros(6), np.zeros(6)
    blocks_a_row = w // BLOCK_PX + 1
    blocks = np.zeros(((h // BLOCK_PX + 1) * blocks_a_row, 6))
    total, weight_sum = 0.0, 0.0
    inverse_clip2, aspect = 1.0 / (clip * clip), fy / fx
    for y in range(1, h - 1):
        ry = (y + y0 - cy) / fy
        for x in range(1, w - 1):
            m = coverage[y, x]
            if m < _EDGE:
                continue
            sxx, sxy, syy, sx, sy, e2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            mx = 0.5 * (coverage[y, x + 1] - coverage[y, x - 1])
            my = 0.5 * (coverage[y + 1, x] - coverage[y - 1, x])
            for k in range(c):
                behind = scene[k, y + y0, x + x0]  # the body uncovers it where it leaves
                gx = 0.5 * (shape[k, y, x + 1] - shape[k, y, x - 1]) - behind * mx
                gy = 0.5 * (shape[k, y + 1, x] - shape[k, y - 1, x]) - behind * my
                r = residual[k, y, x]
                sxx += gx * gx
                sxy += gx * gy
                syy += gy * gy
                sx += gx * r
                sy += gy * r
                e2 += r * r
            down = 1.0 / (1.0 + e2 * inverse_clip2)
            weight = down * down * certainty[y + y0, x + x0]
            total += weight * e2
            weight_sum += weight
            if sxx + syy < 1e-10:
                continue
            inv_z = inverse_depth[y, x] / m
            rx = (x + x0 - cx) / fx
            px, py, pz = rx / inv_z - view[9], ry / inv_z - view[10], 1.0 / inv_z - view[11]
            ox = view[0] * px + view[3] * py + view[6] * pz - origin[0]
            oy = view[1] * px + view[4] * py + view[7] * pz - origin[1]
            oz = view[2] * px + view[5] * py + view[8] * pz - origin[2]
            for i in range(3):
                a[i] = fx * inv_z * (view[i] - rx * view[6 + i])
                b[i] = fy * inv_z * (view[3 + i] - ry * view[6 + i])
            a[3], a[4], a[5] = oy * a[2] - oz * a[1], oz * a[0] - ox * a[2], ox * a[1] - oy * a[0]
            b[3], b[4], b[5] = oy * b[2] - oz * b[1], oz * b[0] - ox * b[2], ox * b[1] - oy * b[0]
            sxx *= weight
            sxy *= weight
            syy *= weight
            sx *= weight
            sy *= weight
            steepness = np.sqrt(mx * mx + aspect * aspect * my * my) + 1e-9
            out_x, out_y = -mx / steepness, -aspect * aspect * my / steepness
            block = blocks[(y // BLOCK_PX) * blocks_a_row + x // BLOCK_PX]
            for i in range(6):
                # a body that moves by du takes its picture along: the picture changes by -gradient du
                block[i] -= sx * a[i] + sy * b[i]
                ai = sxx * a[i] + sxy * b[i]
                bi = sxy * a[i] + syy * b[i]
                B[i, 0] += ai
                B[i, 1] += bi
                B[i, 2] += ai * out_x + bi * out_y
                for j in range(i + 1):
                    A[i, j] += ai * a[j] + bi * b[j]
    for n in range(len(blocks)):
        for i in range(6):
            g[i] += blocks[n, i]
            for j in range(6):
                S[i, j] += blocks[n, i] * blocks[n, j]
    return total, weight_sum


@njit(**KERNEL)
def _coverage_and_depth(part, inverse_depth, x0, y0, x1, y1, taps_u, taps_v):
    planes = np.empty((2, y1 - y0, x1 - x0), np.float32)
    for y in range(y1 - y0):
        for x in range(x1 - x0):
            planes[0, y, x] = 1.0 if part[y + y0, x + x0] >= 0 else 0.0
            planes[1, y, x] = inverse_depth[y + y0, x + x0]
    out = np.empty_like(planes)
    blur(planes, taps_u, taps_v, out)
    return out


@njit(**KERNEL)
def silhouette_equations(shapes, geometry, R, t, view, K, posterior, black, certainty, maps, taps_u, taps_v, sums):
    """Add one view's normal equations of `blurred posterior - blurred mask`; see `accumulate`.

    posterior (h, w): the probability of each pixel to be body; black (1, h, w) zeros, certainty (h, w) ones;
    maps: workspace (part, inverse_depth, normals). Returns (weighted squared residual, weight).
    """
    part, inverse_depth, normals = maps
    surface_maps(shapes, geometry, R, t, view, part, inverse_depth, normals)
    x0, y0, x1, y1 = window_of(part)
    if x1 - x0 < 3 or y1 - y0 < 3:
        return 0.0, 0.0
    blurred = _coverage_and_depth(part, inverse_depth, x0, y0, x1, y1, taps_u, taps_v)
    seen = np.empty((1, y1 - y0, x1 - x0), np.float32)
    for y in range(y1 - y0):
        for x in range(x1 - x0):
            seen[0, y, x] = posterior[y + y0, x + x0]
    residual, shape = np.empty_like(seen), np.empty_like(seen)
    blur(seen, taps_u, taps_v, residual)
    for y in range(y1 - y0):
        for x in range(x1 - x0):
            shape[0, y, x] = np.float32(0.5) * (residual[0, y, x] + blurred[0, y, x])
            residual[0, y, x] -= blurred[0, y, x]
    return accumulate(residual, shape, blurred[0], blurred[1], black, certainty, x0, y0, K, view, t[0], 0.5, sums)


@njit(**KERNEL)
def photometric_equations(
    shapes,
    geometry,
    R,
    t,
    view,
    K,
    observed,
    scene,
    certainty,
    albedo,
    is_faceted,
    light,
    rounds,
    maps,
    taps_u,
    taps_v,
    clip,
    sums,
):
    """Add one view's normal equations of `blurred observed - blurred composite`; see `accumulate`.

    observed, scene (3, h, w): linear light of the picture and of the empty scene; albedo (parts, 3) linear and
    is_faceted (parts,): see `compose`; light (3, TERMS) the view's fitted light, refitted in place by `rounds` robust
    rounds. Returns (weighted squared residual, weight).
    """
    part, inverse_depth, normals = maps
    surface_maps(shapes, geometry, R, t, view, part, inverse_depth, normals)
    x0, y0, x1, y1 = window_of(part)
    if x1 - x0 < 3 or y1 - y0 < 3:
        return 0.0, 0.0
    fit_light(observed, part, normals, albedo, light, rounds, x0, y0, x1, y1)
    blurred = _coverage_and_depth(part, inverse_depth, x0, y0, x1, y1, taps_u, taps_v)
    sharp, residual = np.empty((3, y1 - y0, x1 - x0), np.float32), np.empty((3, y1 - y0, x1 - x0), np.float32)
    body, shape = np.empty_like(sharp), np.empty_like(sharp)
    compose(observed, scene, part, normals, albedo, is_faceted, light, x0, y0, sharp, body)
    blur(sharp, taps_u, taps_v, residual)
    blur(body, taps_u, taps_v, shape)
    return accumulate(residual, shape, blurred[0], blurred[1], scene, certainty, x0, y0, K, view, t[0], clip, sums)
