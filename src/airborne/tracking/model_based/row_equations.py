"""One view's normal equations, row by row: a row is drawn, blurred and compared while its numbers are in the cache.

A row of planes is one array: the blurred mask, the inverse depth on it, then for each channel the body's colour as it
moves with the body, and how much the body changes the image. Of a mask alone, with no colours, the first two.
"""

from __future__ import annotations

import numpy as np

from airborne.kernels import kernel
from airborne.rendering.rows import LANES, f4
from airborne.tracking.model_based.blur import RADIUS_PX, RING, blur_row
from airborne.tracking.model_based.lanes import (
    CHANGE,
    GRADIENT,
    MINE,
    SQUARE,
    STRIP,
    SUM_PLANES,
    TERM_PLANES,
    TOTAL,
    WEIGHT,
    WEIGHTS,
    add_channel,
    add_segment,
    begin_terms,
    total_of,
    weigh_pixels,
)
from airborne.tracking.model_based.twist_equations import BLOCK_PX

_PAD = LANES // 2  # columns of a row before the first that is compared, and after the last


@kernel(fastmath=True, is_inner=True)
def add_rows(lit, flat, maps, owner, nearness, projection, observation, comparison, sums, blocks):
    """Add one view's normal equations for the twist of each segment about the projection's origin: A twist = g.

    lit, flat (c, H, W): the body's colours, and the same as they move with the body, defined on the mask; c = 0 for a
    mask that is compared with its posterior. owner, nearness (H, W) as `find_owners` has them; (0, 0) of a body of one
    segment. Adds to `sums`, and to `blocks` of `new_blocks` the gradients block by block; sums of no segment ask for no
    equations. Returns (robust squared residual, less that of the image without a body, weighted squared residual,
    weight), the last two where there is body.
    """
    firsts, lasts = _columns_of_mask(maps.part)
    lows, highs, x0, x1, y0, y1 = _columns_to_compare(firsts, lasts, maps.part)
    if x1 <= x0:
        return 0.0, 0.0, 0.0
    c, rows, has_owners = len(lit), observation.rows, len(owner) > 0
    n_chunks, pitch, channels = (x1 - x0 + LANES - 1) // LANES, rows.shape[2], (rows.shape[1] - 2) // 2
    width, left = LANES * n_chunks + 2 * _PAD, x0 - _PAD
    n = width * (2 + 2 * c)
    ring, blurred, middle = np.zeros((RING, n), np.float32), np.zeros(3 * n, np.float32), np.empty(n, np.float32)
    shape, terms, near = np.zeros(3 * width, np.float32), np.empty(TERM_PLANES, np.float32), np.zeros(STRIP, np.float32)
    own, segments = np.empty(STRIP, np.int16), np.zeros(len(sums.A) * SUM_PLANES, np.float32)
    given, scale, inverse_clip2 = rows.ravel(), _scale(projection), f4(1.0 / comparison.clip**2)
    cost, total, weight, last_block = 0.0, 0.0, 0.0, (blocks.shape[0] - 1, blocks.shape[1] - 1)
    for y in range(y0 - 1 - RADIUS_PX, y1 + 1 + RADIUS_PX):
        _draw_row(lit, flat, maps, observation.background, firsts, lasts, y, left, width, ring[y % RING])
        ready = y - RADIUS_PX
        if ready < y0 - 1:
            continue
        blur_row(
            ring, ready, comparison.taps_u, comparison.taps_v, middle, blurred[n * (ready % 3) : n * (ready % 3 + 1)]
        )
        if c == 0:
            _mean_with_observed(rows[ready, 0], left, width, blurred, n * (ready % 3), shape, width * (ready % 3))
        v = ready - 1
        if v < y0 or highs[v] <= lows[v]:
            continue
        first, last = (lows[v] - x0) // LANES * LANES, (highs[v] - x0 + LANES - 1) // LANES * LANES
        for a in range(first, last, STRIP):
            m, at, row = min(STRIP, last - a), a + _PAD, v * rows.shape[1] * pitch + x0 + a
            above, here, below = n * ((v - 1) % 3) + at, n * (v % 3) + at, n * (ready % 3) + at
            begin_terms(terms, m, blurred, above, here, below)
            for k in range(c):
                s, change = (2 + k) * width, (2 + c + k) * width + here
                args = blurred, change, blurred, above + s, here + s, below + s
                add_channel(terms, m, given, row + k * pitch, row + (c + k) * pitch, *args)
            if c == 0:
                s = width * ((v - 1) % 3) + at, width * (v % 3) + at, width * (ready % 3) + at
                add_channel(terms, m, given, row, row + pitch, blurred, here, shape, *s)
            if has_owners:
                _take_owners(owner[v], nearness[v], x0 + a, min(m, x1 - x0 - a), own, near)
            ours = blurred, here, here + width, given, row + 2 * channels * pitch, row + (2 * channels + 1) * pitch
            cost += weigh_pixels(terms, m, highs[v] - x0 - a, *ours, near, inverse_clip2)
            if len(sums.A) == 0:
                for x in range(m):
                    total += terms[WEIGHT + x] * terms[SQUARE + x]
                    weight += terms[WEIGHT + x]
                continue
            for b in range(0, m, LANES):
                if total_of(terms, WEIGHT + b) > 0:
                    block = min((v - y0) // BLOCK_PX, last_block[0]), min((a + b) // LANES, last_block[1])
                    _add_owners(terms, b, own, has_owners, scale, x0 + a + b, v, segments, blocks, block)
    for e in range(len(sums.A)):
        total += total_of(segments, SUM_PLANES * e + TOTAL)
        weight += total_of(segments, SUM_PLANES * e + WEIGHTS)
    _add_to_world(segments, projection, sums, blocks)
    return cost, total, weight


@kernel(fastmath=True, is_inner=True)
def _columns_of_mask(part):
    """Return the first column of the body in each row of a map of parts (h, w), and one past the last: (h,) each."""
    h, w = part.shape
    firsts, lasts = np.empty(h, np.int32), np.empty(h, np.int32)
    for y in range(h):
        first, last = np.int32(w), np.int32(0)
        for x in range(w):
            is_body = part[y, x] >= 0
            first = min(first, np.int32(x) if is_body else np.int32(w))
            last = max(last, np.int32(x + 1) if is_body else np.int32(0))
        firsts[y], lasts[y] = first, last
    return firsts, lasts


@kernel(fastmath=True, is_inner=True)
def _columns_to_compare(firsts, lasts, part):
    """Return the columns of each row that the blurred body changes, off the border, and the box around them."""
    h, w = part.shape
    lows, highs = np.empty(h, np.int32), np.zeros(h, np.int32)
    x0, x1, y0, y1 = w, 0, h, 0
    for y in range(h):
        lows[y] = w
    for y in range(1, h - 1):
        low, high = np.int32(w), np.int32(0)
        for v in range(max(y - RADIUS_PX, 0), min(y + RADIUS_PX + 1, h)):
            low, high = min(low, firsts[v]), max(high, lasts[v])
        low, high = max(low - RADIUS_PX, 1), min(high + RADIUS_PX, w - 1)
        if high > low:
            lows[y], highs[y] = low, high
            x0, x1, y0, y1 = min(x0, low), max(x1, high), min(y0, y), y + 1
    return lows, highs, x0, x1, y0, y1


@kernel(fastmath=True, is_inner=True)
def _draw_row(lit, flat, maps, background, firsts, lasts, y, left, width, row):
    """Fill a row of planes, of the columns from `left`; beyond the image its border is repeated."""
    c = len(lit)
    h, w = maps.part.shape
    v = min(max(y, 0), h - 1)
    row[:] = 0
    first, n = max(firsts[v], left), min(lasts[v], left + width) - max(firsts[v], left)
    at = first - left
    if n <= 0 or first < 0 or at < 0 or width < 0:  # offsets known not to be negative are not wrapped around
        return
    part, depth = maps.part[v], maps.inverse_depth[v]
    for x in range(n):
        row[at + x] = f4(1) if part[first + x] >= 0 else f4(0)
    for x in range(n):
        row[at + width + x] = depth[first + x] if part[first + x] >= 0 else f4(0)
    for k in range(c):
        ours, theirs, even = lit[k, v], background[k, v], flat[k, v]
        shape, change = at + (2 + k) * width, at + (2 + c + k) * width
        for x in range(n):
            row[shape + x] = even[first + x] if part[first + x] >= 0 else f4(0)
        for x in range(n):
            row[change + x] = ours[first + x] - theirs[first + x] if part[first + x] >= 0 else f4(0)
    if first == 0 or first + n == w:
        for k in range(2 + 2 * c):
            for x in range(width):
                if x < -left or x >= w - left:
                    row[k * width + x] = row[k * width + min(max(x, -left), w - left - 1)]


@kernel(fastmath=True, is_inner=True)
def _mean_with_observed(difference, left, width, blurred, at, shape, to):
    """Fill a row of the mean of the blurred mask and the blurred posterior."""
    first = max(-left, 0)
    if at < 0 or to < 0 or left + first < 0:
        return
    for x in range(first, min(width, len(difference) - left)):
        shape[to + x] = f4(0.5) * (blurred[at + x] + difference[left + x])


@kernel(fastmath=True, is_inner=True)
def _take_owners(owner, nearness, first, n, own, near):
    """Copy the owners of n pixels of a row and their inverse depths; none owns what follows."""
    own[:] = -1
    near[:] = 0
    for x in range(n):
        own[x], near[x] = owner[first + x], nearness[first + x]


@kernel(fastmath=True, is_inner=True)
def _scale(projection):
    """Return the focal lengths and the principal point [px], and the origin in the camera [m]."""
    view, K, o = projection.packed_view, projection.K, projection.origin
    x = view[0] * o[0] + view[1] * o[1] + view[2] * o[2] + view[9]
    y = view[3] * o[0] + view[4] * o[1] + view[5] * o[2] + view[10]
    z = view[6] * o[0] + view[7] * o[1] + view[8] * o[2] + view[11]
    return K[0, 0], K[1, 1], K[0, 2], K[1, 2], f4(x), f4(y), f4(z)


@kernel(fastmath=True, is_inner=True)
def _add_owners(terms, at, own, has_owners, scale, x, y, segments, blocks, block):
    """Add 16 pixels, of which (x, y) is the first, to the sums of the segments that own them; empties `own` there."""
    fx, fy, cx, cy, ox, oy, oz = scale
    rx, ry, step, aspect = f4((x - cx) / fx), f4((y - cy) / fy), f4(1 / fx), fy / fx
    for start in range(LANES if has_owners else 1):
        e = own[at + start] if has_owners else 0
        if e < 0 or (has_owners and terms[at + WEIGHT + start] == 0):
            continue
        for j in range(LANES):
            terms[at + MINE + j] = f4(1) if not has_owners or own[at + j] == e else f4(0)
        for j in range(LANES):
            own[at + j] = -1 if own[at + j] == e else own[at + j]
        to = e * SUM_PLANES
        add_segment(terms, at, segments, to, rx, step, ry, f4(fx), f4(fy), ox, oy, oz, f4(aspect * aspect))
        for i in range(6):
            blocks[block[0], block[1], e, i] += total_of(segments, to + GRADIENT + LANES * i)


@kernel(fastmath=True, is_inner=True)
def _add_to_world(segments, projection, sums, blocks):
    """Rotate the sums from the camera's axes to the world's and add them; likewise the blocks, in place."""
    R = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            R[i, j] = projection.packed_view[3 * i + j]
    A, B, T = np.empty((6, 6)), np.empty((6, 3)), np.empty((6, 6))
    for e in range(len(sums.A)):
        k = e * SUM_PLANES
        for i in range(6):
            for j in range(i, 6):
                A[i, j] = A[j, i] = total_of(segments, k)
                k += LANES
            for j in range(3):
                B[i, j] = total_of(segments, e * SUM_PLANES + CHANGE + LANES * (6 * j + i))
        for p in range(6):  # A R, and from it R' A R, by blocks of 3 by 3
            for q in range(6):
                T[p, q] = 0.0
                for j in range(3):
                    T[p, q] += A[p, q // 3 * 3 + j] * R[j, q % 3]
        for p in range(6):
            for q in range(6):
                for i in range(3):
                    sums.A[e, p, q] += R[i, p % 3] * T[p // 3 * 3 + i, q]
            for j in range(3):
                for i in range(3):
                    sums.B[e, p, j] += R[i, p % 3] * B[p // 3 * 3 + i, j]
    g = np.empty(6)
    for row in range(blocks.shape[0]):
        for column in range(blocks.shape[1]):
            for e in range(blocks.shape[2]):
                block, size = blocks[row, column, e], 0.0
                for p in range(6):
                    size += abs(block[p])
                if size == 0:
                    continue
                for p in range(6):
                    g[p] = 0.0
                    for i in range(3):
                        g[p] += R[i, p % 3] * block[p // 3 * 3 + i]
                for p in range(6):
                    block[p] = g[p]
                    sums.g[e, p] += g[p]
