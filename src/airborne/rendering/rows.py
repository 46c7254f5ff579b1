"""Kernels that turn outlines into spans and spans into pixels: one row at a time, 16 pixels at a time, float32.

A row's pixels live in blocks of 16: each block holds nine planes of 16 numbers side by side, so that every distance in
memory is a constant and LLVM can put a whole plane into one register. Inverse depth is the z-buffer: larger is nearer.
A lane loop that is too small gets unrolled instead of vectorised, and then costs ten times as much; so does one that
adds to memory under a condition (add a selected value instead). Measure with `benchmarks/speed/yardstick.py` after any
change.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from airborne.kernels import kernel
from airborne.rendering.shapes import (
    ALPHA,
    B_1,
    B_U,
    B_V,
    BEND,
    CENTRE_HEIGHT,
    COLOUR,
    HALF_1,
    HALF_V,
    HALF_VV,
    HEIGHT,
    ID,
    MID_1,
    MID_V,
    N_STEP,
    NORMAL,
    W_STEP,
    G,
    outline_all,
)

LANES = 16  # pixels computed together: a vector register of 512 bits holds as many floats
# planes of a block, as offsets: inverse depth, normal (3), colour (3), shape, light
W, NX, NY, NZ, RED, GREEN, BLUE, SHAPE, SHADE, BLOCK = 0, 16, 32, 48, 64, 80, 96, 112, 128, 144
f4 = np.float32


class Spans(NamedTuple):
    """The pixels of every shape in every row: row v's spans are row_start[v] to row_stop[v] - 1."""

    row_start: Any  # (height + 1,)
    row_stop: Any  # (height,)
    ends: Any  # (spans, 3) first pixel, last pixel, shape
    curves: Any  # (spans, 2) the middle and the half width squared [px]


@kernel(fastmath=True, is_inner=True)
def new_row(width):
    """Allocate the blocks of one row, all empty."""
    row = np.empty((width // LANES + 2) * BLOCK, np.float32)
    for i in range(len(row)):
        row[i] = 0
    return row


@kernel(fastmath=True, is_inner=True)
def _count_rows(shapes, row_start):
    """Fill `row_start` (height + 1,) with room for a shape's spans in each row; return the number of spans."""
    for v in range(len(row_start)):
        row_start[v] = 0
    rows = shapes.rows
    for s in range(len(rows)):
        for v in range(rows[s, 0], rows[s, 1] + 1):
            row_start[v + 1] += 1
    for e in range(len(shapes.is_cut)):
        if shapes.is_cut[e]:
            for v in range(rows[e, 0], rows[e, 1] + 1):
                row_start[v + 1] += 1
    for v in range(1, len(row_start)):
        row_start[v] += row_start[v - 1]
    return row_start[-1]


@kernel(fastmath=True, is_inner=True)
def _find_spans(shapes, geometry, width, row_start, row_stop, ends, curves):
    """List the pixels of every shape in every row; see `Spans`."""
    for v in range(len(row_stop)):
        row_stop[v] = row_start[v]
    n_ellipsoids = len(geometry.ellipsoid_segment)
    for s in range(len(shapes.rows)):
        if s < n_ellipsoids and shapes.is_cut[s]:
            continue
        outline = shapes.outline[s]
        for v in range(shapes.rows[s, 0], shapes.rows[s, 1] + 1):
            low, high, middle, half_squared = 0.0, width - 1.0, 0.0, 0.0
            if s < n_ellipsoids:
                half_squared = outline[HALF_1] + v * (outline[HALF_V] + v * outline[HALF_VV])
                middle = outline[MID_V] * v + outline[MID_1]
                half = math.sqrt(max(half_squared, 0.0))
                low, high = max(low, middle - half), min(high, middle + half)
            else:
                p = s - n_ellipsoids
                for i in range(geometry.start[p], geometry.start[p + 1]):
                    side, bound = shapes.edges[i, 0], shapes.edges[i, 1] * v + shapes.edges[i, 2]
                    if side > 0:
                        low = max(low, bound)
                    elif side < 0:
                        high = min(high, bound)
                    elif bound < 0:
                        high = -1.0
            if high < low:
                continue
            first, last = math.ceil(low), math.floor(high)
            if last >= first:
                i = row_stop[v]
                ends[i, 0], ends[i, 1], ends[i, 2] = first, last, s
                curves[i, 0], curves[i, 1] = middle, half_squared
                row_stop[v] = i + 1
    for e in range(n_ellipsoids):
        if shapes.is_cut[e]:
            _cut_spans(shapes, e, width, row_stop, ends, curves)


@kernel(fastmath=True, is_inner=True)
def _add_span(low, high, middle, half_squared, s, v, row_stop, ends, curves):
    """List the pixels of a shape from `low` to `high`, where there are any."""
    if high < low:
        return
    first, last = math.ceil(low), math.floor(high)
    if last >= first:
        i = row_stop[v]
        ends[i, 0], ends[i, 1], ends[i, 2] = first, last, s
        curves[i, 0], curves[i, 1] = middle, half_squared
        row_stop[v] = i + 1


@kernel(fastmath=True, is_inner=True)
def _cut_spans(shapes, s, width, row_stop, ends, curves):
    """List the pixels at which the near surface of an ellipsoid lies in its slab: at most two spans a row.

    In a row, each plane of the slab parts the surface into one piece and the rest (`_beyond`); the piece of the upper
    plane is above it only where that of the lower one is above it too. That leaves one piece, or one with a hole.
    """
    outline, slab = shapes.outline[s], shapes.slab[s]
    for v in range(shapes.rows[s, 0], shapes.rows[s, 1] + 1):
        half_squared = max(outline[HALF_1] + v * (outline[HALF_V] + v * outline[HALF_VV]), 0.0)
        middle, half = outline[MID_V] * v + outline[MID_1], math.sqrt(half_squared)
        is_below_top, top_0, top_1 = _beyond(outline, slab[1], v, middle, half)
        is_below_foot, foot_0, foot_1 = _beyond(outline, slab[0], v, middle, half)
        low, high, hole_0, hole_1 = -half, half, half, -half
        if is_below_top:
            low, high = top_0, top_1
        else:
            hole_0, hole_1 = top_0, top_1
        if is_below_foot:
            hole_0, hole_1 = foot_0, foot_1
        else:
            low, high = max(low, foot_0), min(high, foot_1)
        least, most = max(middle + low, 0.0), min(middle + high, width - 1.0)
        if hole_1 < hole_0:
            _add_span(least, most, middle, half_squared, s, v, row_stop, ends, curves)
        else:
            _add_span(least, min(most, middle + hole_0), middle, half_squared, s, v, row_stop, ends, curves)
            _add_span(max(least, middle + hole_1), most, middle, half_squared, s, v, row_stop, ends, curves)


@kernel(fastmath=True, is_inner=True)
def _beyond(outline, height, v, middle, half):
    """Cut row v of an ellipsoid's near surface by the plane at a height: (is_below, low, high), u - middle [px].

    Between `low` and `high` the surface lies below the plane, or where not `is_below`, above it; high < low: nowhere.
    With d the plane's height over the camera, the surface is below it where L(x) < d S(x), L = m x + q being linear and
    S the root in the inverse depth. For d >= 0 that is where the convex L - d S is negative, between its two zeros,
    which are among those of L^2 - d^2 S^2; for d < 0 the same holds of -L and the side above.
    """
    d = height + outline[CENTRE_HEIGHT]
    m = outline[HEIGHT] - d * outline[B_U]
    q = outline[HEIGHT] * middle + outline[HEIGHT + 1] * v + outline[HEIGHT + 2]
    q -= d * (outline[B_U] * middle + outline[B_V] * v + outline[B_1])
    bend = d * d * outline[BEND]
    a, b, c = m * m + bend, m * q, q * q - bend * half * half
    discriminant = b * b - a * c
    sign = 1.0 if d >= 0 else -1.0
    is_in_first, is_in_last = sign * (q - m * half) < 0, sign * (q + m * half) < 0  # S is zero at the ends
    low, high = half, -half
    if is_in_first and is_in_last:
        low, high = -half, half
    elif is_in_first or is_in_last or (discriminant >= 0 and a > 1e-30):  # a = 0: a plane seen edge-on, along the row
        root = math.sqrt(max(discriminant, 0.0))
        low = -half if is_in_first else (-b - root) / a
        high = half if is_in_last else (-b + root) / a
    return d >= 0, low, high


@kernel(fastmath=True, is_inner=True)
def list_spans(shapes, geometry, view, width, height):
    """Outline the posed shapes in a view and list their spans."""
    outline_all(shapes, geometry, view, width, height)
    row_start, row_stop = np.empty(height + 1, np.int64), np.empty(height, np.int64)
    n_spans = _count_rows(shapes, row_start)
    ends, curves = np.empty((n_spans, 3), np.int64), np.empty((n_spans, 2))
    _find_spans(shapes, geometry, width, row_start, row_stop, ends, curves)
    return Spans(row_start, row_stop, ends, curves)


@kernel(fastmath=True, is_inner=True)
def block_range(ends, start, stop):
    """Return the first block that the spans `start` to `stop - 1` touch, and the last."""
    first, last = ends[start, 0], ends[start, 1]
    for i in range(start + 1, stop):
        first, last = min(first, ends[i, 0]), max(last, ends[i, 1])
    return first // LANES, last // LANES


@kernel(fastmath=True, is_inner=True)
def draw_row(row, outlines, surfaces, ends, curves, start, stop, v, first_block, lights=True):
    """Draw the spans `start` to `stop - 1` of row v into the blocks of `row`, the nearest surface on top.

    Where `lights` is None no normals are drawn, in half the time.
    """
    for i in range(start, stop):
        u0, u1, s = ends[i, 0], ends[i, 1], ends[i, 2]
        outline, surface = outlines[s], surfaces[s]
        alpha, w_step, half_squared = surface[ALPHA], surface[W_STEP], f4(curves[i, 1])
        s0, s1, s2 = surface[N_STEP], surface[N_STEP + 1], surface[N_STEP + 2]
        g0, g1, g2 = surface[G], surface[G + 1], surface[G + 2]
        red, green, blue, shape = surface[COLOUR], surface[COLOUR + 1], surface[COLOUR + 2], surface[ID]
        w_row = outline[B_V] * v + outline[B_1]
        n0_row = outline[NORMAL + 1] * v + outline[NORMAL + 2]
        n1_row = outline[NORMAL + 4] * v + outline[NORMAL + 5]
        n2_row = outline[NORMAL + 7] * v + outline[NORMAL + 8]
        for b in range(u0 // LANES, u1 // LANES + 1):
            u = b * LANES
            block = row[(b - first_block) * BLOCK : (b - first_block) * BLOCK + BLOCK]
            first, last, x = f4(u0 - u), f4(u1 - u), f4(u - curves[i, 0])
            w_0 = f4(outline[B_U] * u + w_row)
            if lights is None:
                for j in range(LANES):
                    f = f4(j)
                    dx = x + f
                    w = w_0 + w_step * f + np.sqrt(alpha * max(half_squared - dx * dx, f4(0)))
                    is_nearest = (f >= first) & (f <= last) & (w > block[W + j])
                    block[W + j] = w if is_nearest else block[W + j]
                    block[RED + j] = red if is_nearest else block[RED + j]
                    block[GREEN + j] = green if is_nearest else block[GREEN + j]
                    block[BLUE + j] = blue if is_nearest else block[BLUE + j]
                    block[SHAPE + j] = shape if is_nearest else block[SHAPE + j]
                continue
            n0_0 = f4(outline[NORMAL] * u + n0_row)
            n1_0 = f4(outline[NORMAL + 3] * u + n1_row)
            n2_0 = f4(outline[NORMAL + 6] * u + n2_row)
            for j in range(LANES):
                f = f4(j)
                dx = x + f
                w = w_0 + w_step * f + np.sqrt(alpha * max(half_squared - dx * dx, f4(0)))
                is_nearest = (f >= first) & (f <= last) & (w > block[W + j])
                block[W + j] = w if is_nearest else block[W + j]
                block[NX + j] = n0_0 + s0 * f - w * g0 if is_nearest else block[NX + j]
                block[NY + j] = n1_0 + s1 * f - w * g1 if is_nearest else block[NY + j]
                block[NZ + j] = n2_0 + s2 * f - w * g2 if is_nearest else block[NZ + j]
                block[RED + j] = red if is_nearest else block[RED + j]
                block[GREEN + j] = green if is_nearest else block[GREEN + j]
                block[BLUE + j] = blue if is_nearest else block[BLUE + j]
                block[SHAPE + j] = shape if is_nearest else block[SHAPE + j]


@kernel(fastmath=True, is_inner=True)
def light_block(block, lights, x, x_step, y, y_step):
    """Add to the block's light what each lamp gives: intensity times the cosine to the normal, inside its cone.

    `lights` (l, 8): position in camera axes, intensity, axis of the cone, cosine of its half angle (-2: no cone). The
    ray of lane j is (x + j x_step, y + j y_step, 1). With w times the vector to the lamp, depth is never divided by.
    """
    for i in range(len(lights)):
        p0, p1, p2, intensity = lights[i, 0], lights[i, 1], lights[i, 2], lights[i, 3]
        d0, d1, d2, cone = lights[i, 4], lights[i, 5], lights[i, 6], lights[i, 7]
        for j in range(LANES):
            w, n0, n1, n2 = block[W + j], block[NX + j], block[NY + j], block[NZ + j]
            a0, a1, a2 = w * p0 - (x + x_step * f4(j)), w * p1 - (y + y_step * f4(j)), w * p2 - f4(1)
            near = f4(1) / np.sqrt(a0 * a0 + a1 * a1 + a2 * a2)
            facing = max(n0 * a0 + n1 * a1 + n2 * a2, f4(0)) * near * (f4(1) / np.sqrt(n0 * n0 + n1 * n1 + n2 * n2))
            is_lit = -(a0 * d0 + a1 * d1 + a2 * d2) * near >= cone
            block[SHADE + j] += intensity * facing if is_lit else f4(0)
