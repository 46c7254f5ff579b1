"""Normal equations of the segments' twists: summed over pixels here, then mapped to a body's degrees of freedom.

A twist (6,) is a translation [m] and a rotation vector in world axes.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from airborne.kernels import kernel

BLOCK_PX = 16  # residuals this close are correlated: the side of a block of the covariance's sandwich
_EDGE = 0.01  # blurred coverage below which a pixel is not used


class Sums(NamedTuple):
    """Normal equations of the twist (6,) of each of s segments, summed over pixels: A twist = g.

    A pixel belongs to one segment, so only the chain of joints couples two of them: see `map_equations`.
    """

    A: Any  # (s, 6, 6) curvature
    g: Any  # (s, 6) gradient
    B: Any  # (s, 6, 3) change of g by an image shifted right or down by a pixel, or an outline a pixel wider

    @classmethod
    def zero(cls, n_segments: int) -> Sums:
        """Return sums of zero."""
        return cls(np.zeros((n_segments, 6, 6)), np.zeros((n_segments, 6)), np.zeros((n_segments, 6, 3)))


def new_blocks(width: int, height: int, n_segments: int) -> np.ndarray:
    """Allocate the gradients of each block of an image, segment by segment: (rows, columns, s, 6)."""
    return np.zeros((height // BLOCK_PX + 1, width // BLOCK_PX + 1, n_segments, 6))


@kernel(fastmath=True)
def accumulate(residual, shape, coverage, owner, nearness, projection, observation, comparison, sums, blocks):
    """Add one view's normal equations for the twist of each segment about the projection's origin: A twist = g.

    residual, shape (c, h, w): blurred observed minus rendered, and the blurred colours of the body on black; coverage
    (h, w) blurred alike; owner, nearness (h, w) as `find_owners` has them. Adds to `sums`, and to `blocks` of
    `new_blocks` the gradients block by block. Returns (robust squared residual of the whole window, weighted squared
    residual, weight), the last two where there is body.
    """
    view, K, origin = projection.packed_view, projection.K, projection.origin
    background, certainty = observation.background, observation.certainty
    A, g, B = sums.A, sums.g, sums.B
    c, h, w = residual.shape
    x0, y0, clip = comparison.window.x0, comparison.window.y0, comparison.clip
    fx, fy, cx, cy = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    a, b, e2_of_row = np.zeros(6), np.zeros(6), np.empty(w, np.float32)
    cost, total, weight_sum = 0.0, 0.0, 0.0
    inverse_clip2, aspect = np.float32(1.0 / (clip * clip)), fy / fx
    for y in range(1, h - 1):
        ry = (y + y0 - cy) / fy
        e2_of_row[:] = 0
        for k in range(c):
            for x in range(1, w - 1):
                e2_of_row[x] += residual[k, y, x] * residual[k, y, x]
        for x in range(1, w - 1):
            cost += certainty[y + y0, x + x0] * e2_of_row[x] / (np.float32(1) + e2_of_row[x] * inverse_clip2)
        for x in range(1, w - 1):
            m, e, e2 = coverage[y, x], owner[y, x], e2_of_row[x]
            if m < _EDGE or e < 0:
                continue
            down = 1.0 / (1.0 + e2 * inverse_clip2)
            weight = certainty[y + y0, x + x0] * down * down
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
            z, rx = 1.0 / inv_z, (x + x0 - cx) / fx
            px, py, pz = rx * z - view[9], ry * z - view[10], z - view[11]
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
    for e in range(len(A)):
        for i in range(6):
            for j in range(i):
                A[e, j, i] = A[e, i, j]
    for row in range(blocks.shape[0]):
        for column in range(blocks.shape[1]):
            for e in range(len(g)):
                for i in range(6):
                    g[e, i] += blocks[row, column, e, i]
    return cost, total, weight_sum


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
