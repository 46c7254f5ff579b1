"""Gauss-Newton kernels: residuals between blurred observed and rendered images, and their derivatives by the pose.

Arrays in, arrays out, in tuples: `body` is shapes, geometry and the segment of each part; `projection` is R (s, 3, 3),
t (s, 3) [m], the packed view (18,), its intrinsics K and the origin (3,) [m] of all twists; `observation` is the
observed planes (c, H, W), those of the background, and each pixel's certainty (H, W), the factor 0..1 of its weight;
`comparison` is the window x0, y0, x1, y1 of the image (H, W) that is compared, the taps of the blur along rows and
columns, and the residual at which a pixel's weight has fallen to a quarter; `maps` is the workspace of `surface_maps`.
Planes are float32; (h, w) is the size of the window.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from airborne.appearance.lighting import fit_light, flatten_shading, shade_body
from airborne.kernels import kernel
from airborne.rendering.drawing import draw_maps
from airborne.rendering.maps import surface_maps

BLOCK_PX = 16  # residuals this close are correlated: the side of a block of the covariance's sandwich
RADIUS_PX = 4  # radius of the blur: three sds of the widest one used
REACH_PX = 3  # an edge matters this far away: most of the blur's weight
_PAD_PX = RADIUS_PX + 3  # beyond it, the blurred mask is zero
_EDGE = 0.01  # blurred coverage below which a pixel is not used


class Sums(NamedTuple):
    """Normal equations of the twist (6,) of each of s segments, summed over pixels: A twist = g.

    A pixel belongs to one segment, so only the chain of joints couples two of them: see `map_equations`.
    """

    A: Any  # (s, 6, 6) curvature; the lower triangles are filled
    g: Any  # (s, 6) gradient
    B: Any  # (s, 6, 3) change of g by an image shifted right or down by a pixel, or an outline a pixel wider

    @classmethod
    def zero(cls, n_segments: int) -> Sums:
        """Return sums of zero."""
        return cls(np.zeros((n_segments, 6, 6)), np.zeros((n_segments, 6)), np.zeros((n_segments, 6, 3)))

    @property
    def curvature(self) -> np.ndarray:
        """A with both triangles (s, 6, 6)."""
        return self.A + np.tril(self.A, -1).swapaxes(1, 2)


def new_blocks(width: int, height: int, n_segments: int) -> np.ndarray:
    """Allocate the gradients of each block of an image, segment by segment: (rows, columns, s, 6)."""
    return np.zeros((height // BLOCK_PX + 1, width // BLOCK_PX + 1, n_segments, 6))


def gaussian_taps(sigma_px: float) -> np.ndarray:
    """Return the five taps of a Gaussian, centre first: the four on either side are equal and are stored once."""
    taps = np.exp(-0.5 * (np.arange(RADIUS_PX + 1) / sigma_px) ** 2)
    return (taps / (2 * taps.sum() - taps[0])).astype(np.float32)


@kernel(fastmath=True)
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


@kernel(fastmath=True)
def mask_window(part):
    """Return the padded window (x0, y0, x1, y1) around the body's pixels; (0, 0, 0, 0) where there is none."""
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


@kernel(fastmath=True)
def find_owners(part, inverse_depth, segment_of_part, x0, y0, owner, nearness):
    """Assign each pixel to the segment whose edge moves it: of those within REACH_PX, the one nearest to the camera.

    An occluding contour moves with the surface in front, never with the one behind. part, inverse_depth (H, W) maps of
    a region; owner (h, w) segment or -1, nearness (h, w) its inverse depth near there [1/m], both of the window at
    (x0, y0).
    """
    h, w = owner.shape
    height, width = part.shape
    distance = np.zeros((h, w), np.int16)  # squared, to the edge that owns a pixel; 0 inside
    for y in range(h):
        for x in range(w):
            p = part[y + y0, x + x0]
            owner[y, x] = segment_of_part[p] if p >= 0 else -1
            nearness[y, x] = inverse_depth[y + y0, x + x0]
    for v in range(max(y0 - REACH_PX, 0), min(y0 + h + REACH_PX, height)):
        for u in range(max(x0 - REACH_PX, 0), min(x0 + w + REACH_PX, width)):
            p = part[v, u]
            if p < 0 or not _is_front_edge(part, inverse_depth, segment_of_part, v, u):
                continue
            own, near = segment_of_part[p], inverse_depth[v, u]
            for y in range(max(v - y0 - REACH_PX, 0), min(v - y0 + REACH_PX + 1, h)):
                for x in range(max(u - x0 - REACH_PX, 0), min(u - x0 + REACH_PX + 1, w)):
                    d = (v - y0 - y) ** 2 + (u - x0 - x) ** 2
                    is_closer = d < distance[y, x] if owner[y, x] == own else near > nearness[y, x]
                    if is_closer:
                        owner[y, x], nearness[y, x], distance[y, x] = own, near, d


@kernel(fastmath=True)
def _is_front_edge(part, inverse_depth, segment_of_part, v, u):
    """Return whether a pixel of the body borders on a segment behind it, or on the background."""
    height, width = part.shape
    own, near = segment_of_part[part[v, u]], inverse_depth[v, u]
    for dv, du in ((0, -1), (0, 1), (-1, 0), (1, 0)):
        y, x = v + dv, u + du
        if 0 <= y < height and 0 <= x < width:
            p = part[y, x]
            if p < 0 or (segment_of_part[p] != own and inverse_depth[y, x] < near):
                return True
    return False


@kernel(fastmath=True)
def _accumulate(residual, shape, coverage, owner, nearness, projection, observation, comparison, sums, blocks):
    """Add one view's normal equations for the twist of each segment about the origin: A twist = g.

    residual, shape (c, h, w): blurred observed minus rendered, and the blurred colours of the body on black; coverage
    (h, w) blurred alike; owner, nearness (h, w) as `find_owners` has them. A twist is a translation [m] and a rotation
    vector [rad] in world axes. Adds to `sums`, and to `blocks` of `new_blocks` the gradients block by block. Returns
    (robust squared residual of the whole window, weighted squared residual, weight), the last two where there is body.
    """
    _, _, view, K, origin = projection
    _, background, certainty = observation
    window, _, _, clip = comparison
    A, g, B = sums
    c, h, w = residual.shape
    x0, y0 = window[0], window[1]
    fx, fy, cx, cy = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    a, b = np.zeros(6), np.zeros(6)
    cost, total, weight_sum = 0.0, 0.0, 0.0
    inverse_clip2, aspect = 1.0 / (clip * clip), fy / fx
    for y in range(1, h - 1):
        ry = (y + y0 - cy) / fy
        for x in range(1, w - 1):
            m = coverage[y, x]
            e2 = 0.0
            for k in range(c):
                e2 += residual[k, y, x] * residual[k, y, x]
            down = 1.0 / (1.0 + e2 * inverse_clip2)
            weight = certainty[y + y0, x + x0]
            cost += weight * e2 * down
            e = owner[y, x]
            if m < _EDGE or e < 0:
                continue
            weight *= down * down
            sxx, sxy, syy, sx, sy = 0.0, 0.0, 0.0, 0.0, 0.0
            mx = 0.5 * (coverage[y, x + 1] - coverage[y, x - 1])
            my = 0.5 * (coverage[y + 1, x] - coverage[y - 1, x])
            for k in range(c):
                behind = background[k, y + y0, x + x0]  # uncovered where the body leaves
                gx = 0.5 * (shape[k, y, x + 1] - shape[k, y, x - 1]) - behind * mx
                gy = 0.5 * (shape[k, y + 1, x] - shape[k, y - 1, x]) - behind * my
                r = residual[k, y, x]
                sxx += gx * gx
                sxy += gx * gy
                syy += gy * gy
                sx += gx * r
                sy += gy * r
            total += weight * e2
            weight_sum += weight
            if sxx + syy < 1e-10:
                continue
            inv_z = nearness[y, x]
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
            block = blocks[y // BLOCK_PX, x // BLOCK_PX, e]
            A_e, B_e = A[e], B[e]
            for i in range(6):
                # a body that moves by du takes its image along: the image changes by -gradient du
                block[i] -= sx * a[i] + sy * b[i]
                ai = sxx * a[i] + sxy * b[i]
                bi = sxy * a[i] + syy * b[i]
                B_e[i, 0] += ai
                B_e[i, 1] += bi
                B_e[i, 2] += ai * out_x + bi * out_y
                for j in range(i + 1):
                    A_e[i, j] += ai * a[j] + bi * b[j]
    for row in range(blocks.shape[0]):
        for column in range(blocks.shape[1]):
            for e in range(len(g)):
                for i in range(6):
                    g[e, i] += blocks[row, column, e, i]
    return cost, total, weight_sum


@kernel(fastmath=True)
def silhouette_equations(body, projection, observation, comparison, maps, sums, blocks):
    """Add one view's normal equations of `blurred posterior - blurred mask`; see `_accumulate`.

    The observed plane is the posterior (1, H, W), each pixel's probability to be body; the background is black.
    """
    posterior, _, _ = observation
    window, taps_u, taps_v, _ = comparison
    owner, nearness = _draw(body, projection, maps, window)
    x0, y0, x1, y1 = window
    residual = np.empty((1, y1 - y0, x1 - x0), np.float32)
    blur(posterior[:, y0:y1, x0:x1], taps_u, taps_v, residual)
    coverage = _mask_coverage(maps[0], comparison)
    shape = np.empty_like(residual)
    for y in range(y1 - y0):
        for x in range(x1 - x0):
            shape[0, y, x] = np.float32(0.5) * (residual[0, y, x] + coverage[0, y, x])
            residual[0, y, x] -= coverage[0, y, x]
    return _accumulate(residual, shape, coverage[0], owner, nearness, projection, observation, comparison, sums, blocks)


@kernel(fastmath=True)
def photometric_equations(body, projection, observation, comparison, maps, paint, light, iterations, sums, blocks):
    """Add one view's normal equations of `blurred observed - blurred composite`, in linear light; see `_accumulate`.

    paint: albedo (parts, 3) linear and is_faceted (parts,), see `flatten_shading`; light (3, LIGHT_TERMS) the view's
    fitted light, refitted in place by `iterations` of reweighting.
    """
    observed, _, _ = observation
    albedo, is_faceted = paint
    window, _, _, _ = comparison
    owner, nearness = _draw(body, projection, maps, window)
    part, _, normals = maps
    x0, y0, x1, y1 = window
    fit_light(observed, part, normals, albedo, light, iterations, x0, y0, x1, y1)
    lit = np.zeros((3, y1 - y0, x1 - x0), np.float32)
    shade_body(part, normals, albedo, light, x0, y0, lit)
    return _composite_equations(
        lit, is_faceted, part, owner, nearness, projection, observation, comparison, sums, blocks
    )


@kernel(fastmath=True)
def known_light_equations(
    body, projection, observation, comparison, maps, workspace, is_faceted, lamps, ambient, sums, blocks
):
    """Add one view's normal equations under known lights, in shares of full sRGB; see `photometric_equations`.

    lamps (l, 8), ambient as `draw_maps` takes them; workspace: maps (part, segment, inverse_depth, colour).
    """
    window, _, _, _ = comparison
    owner, nearness = _draw(body, projection, maps, window)
    R, t, view, _, _ = projection
    colour = workspace[3]
    colour[:] = 0
    draw_maps(body[0], body[1], R, t, view, lamps, ambient, workspace[0], workspace[1], workspace[2], colour)
    x0, y0, x1, y1 = window
    lit = np.empty((3, y1 - y0, x1 - x0), np.float32)
    for k in range(3):
        for y in range(y1 - y0):
            for x in range(x1 - x0):
                lit[k, y, x] = min(colour[y + y0, x + x0, k] * np.float32(1 / 255), np.float32(1))
    return _composite_equations(
        lit, is_faceted, maps[0], owner, nearness, projection, observation, comparison, sums, blocks
    )


@kernel(fastmath=True)
def _draw(body, projection, maps, window):
    """Draw the maps of a view; return the segment that owns each pixel of the window, and its inverse depth."""
    shapes, geometry, segment_of_part = body
    R, t, view, _, _ = projection
    part, inverse_depth, normals = maps
    surface_maps(shapes, geometry, R, t, view, part, inverse_depth, normals)
    x0, y0, x1, y1 = window
    owner, nearness = np.empty((y1 - y0, x1 - x0), np.int16), np.empty((y1 - y0, x1 - x0), np.float32)
    find_owners(part, inverse_depth, segment_of_part, x0, y0, owner, nearness)
    return owner, nearness


@kernel(fastmath=True)
def _mask_coverage(part, comparison):
    window, taps_u, taps_v, _ = comparison
    x0, y0, x1, y1 = window
    mask, coverage = np.empty((1, y1 - y0, x1 - x0), np.float32), np.empty((1, y1 - y0, x1 - x0), np.float32)
    for y in range(y1 - y0):
        for x in range(x1 - x0):
            mask[0, y, x] = 1.0 if part[y + y0, x + x0] >= 0 else 0.0
    blur(mask, taps_u, taps_v, coverage)
    return coverage


@kernel(fastmath=True)
def _composite_equations(lit, is_faceted, part, owner, nearness, projection, observation, comparison, sums, blocks):
    """Compare the image with the lit body (3, h, w) in front of the background."""
    observed, background, _ = observation
    window, taps_u, taps_v, _ = comparison
    x0, y0, _, _ = window
    sharp, residual = np.empty_like(lit), np.empty_like(lit)
    for k in range(3):
        for y in range(lit.shape[1]):
            for x in range(lit.shape[2]):
                rendered = lit[k, y, x] if part[y + y0, x + x0] >= 0 else background[k, y + y0, x + x0]
                sharp[k, y, x] = observed[k, y + y0, x + x0] - rendered
    blur(sharp, taps_u, taps_v, residual)
    coverage = _mask_coverage(part, comparison)
    flatten_shading(part, is_faceted, x0, y0, lit)
    shape = sharp
    blur(lit, taps_u, taps_v, shape)
    return _accumulate(residual, shape, coverage[0], owner, nearness, projection, observation, comparison, sums, blocks)


@kernel(fastmath=True)
def map_equations(A, g, jacobians, H, gradient):
    """Add the segments' equations, A (s, 6, 6) and g (s, 6), mapped by the jacobians (s, 6, d), to H (d, d) and (d,).

    Segments without visible pixels are skipped, and so are degrees of freedom that do not move a segment.
    """
    d = len(gradient)
    for e in range(len(A)):
        J = jacobians[e]
        if A[e, 0, 0] == 0 and A[e, 1, 1] == 0 and A[e, 2, 2] == 0:
            continue
        AJ = np.zeros((6, d))
        moves = np.zeros(d, np.bool_)
        for i in range(d):
            for p in range(6):
                if J[p, i] != 0:
                    moves[i] = True
        for i in range(d):
            if moves[i]:
                for p in range(6):
                    gradient[i] += J[p, i] * g[e, p]
                    for q in range(6):
                        AJ[p, i] += A[e, p, q] * J[q, i]
        for i in range(d):
            if moves[i]:
                for j in range(d):
                    if moves[j]:
                        for p in range(6):
                            H[i, j] += J[p, i] * AJ[p, j]


@kernel(fastmath=True)
def add_score_covariance(blocks, jacobians, S):
    """Add to S (d, d) the sum of G G' over the blocks (n, s, 6), G a block's gradient mapped by jacobians (s, 6, d)."""
    d = len(S)
    G = np.empty(d)
    for n in range(len(blocks)):
        G[:] = 0
        is_empty = True
        for e in range(blocks.shape[1]):
            for p in range(6):
                value = blocks[n, e, p]
                if value != 0:
                    is_empty = False
                    for i in range(d):
                        G[i] += value * jacobians[e, p, i]
        if not is_empty:
            for i in range(d):
                for j in range(d):
                    S[i, j] += G[i] * G[j]
