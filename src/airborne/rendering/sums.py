"""The kernel that compares a body with the pixels: sums over its mask, for many hypotheses and all views."""

from __future__ import annotations

import numpy as np

from airborne.kernels import kernel
from airborne.rendering.rows import (
    BLOCK,
    BLUE,
    GREEN,
    LANES,
    RED,
    SHADE,
    W,
    block_range,
    draw_row,
    f4,
    light_block,
    new_row,
)
from airborne.rendering.shapes import VIEW_K, pose_shapes
from airborne.rendering.spans import list_spans

_DARK_SUM = 30.0  # a pixel whose R + G + B is below this has no usable chromaticity

# what is summed over the mask, r = observed - model over the three channels
PIXELS, ERROR, CROSS, MODEL, COLOURED, CHROMA_ERROR, SUMS = 0, 1, 2, 3, 4, 5, 6


@kernel(fastmath=True, is_inner=True)
def _compare_row(row, n_blocks, lights, ambient, x, x_step, y, y_step, images, offset, totals):
    """Light the blocks of a row and add their differences from the image to `totals` (SUMS * LANES,)."""
    for b in range(n_blocks):
        block = row[b * BLOCK : b * BLOCK + BLOCK]
        light_block(block, lights, x, x_step, y, y_step)
        observed = images[offset + 3 * LANES * b : offset + 3 * LANES * (b + 1)]
        for j in range(LANES):
            is_on = block[W + j] > f4(0)
            on = f4(1) if is_on else f4(0)
            light = ambient + block[SHADE + j] if is_on else f4(0)
            m0, m1, m2 = light * block[RED + j], light * block[GREEN + j], light * block[BLUE + j]
            o0, o1, o2 = f4(observed[j]), f4(observed[LANES + j]), f4(observed[2 * LANES + j])
            r0, r1, r2 = o0 - m0, o1 - m1, o2 - m2
            totals[PIXELS * LANES + j] += on
            totals[ERROR * LANES + j] += on * (r0 * r0 + r1 * r1 + r2 * r2)
            totals[CROSS * LANES + j] += r0 * m0 + r1 * m1 + r2 * m2
            totals[MODEL * LANES + j] += m0 * m0 + m1 * m1 + m2 * m2
        x += f4(LANES) * x_step
        y += f4(LANES) * y_step


@kernel(fastmath=True, is_inner=True)
def _compare_chroma_row(row, n_blocks, images, offset, totals):
    """Add the differences in chromaticity, 255 RGB / (R + G + B), to `totals`; dark pixels and parts are left out."""
    for b in range(n_blocks):
        block = row[b * BLOCK : b * BLOCK + BLOCK]
        observed = images[offset + 3 * LANES * b : offset + 3 * LANES * (b + 1)]
        for j in range(LANES):
            m0, m1, m2 = block[RED + j], block[GREEN + j], block[BLUE + j]
            o0, o1, o2 = f4(observed[j]), f4(observed[LANES + j]), f4(observed[2 * LANES + j])
            m_sum, o_sum = m0 + m1 + m2, o0 + o1 + o2
            on = f4(1) if (block[W + j] > f4(0)) & (m_sum >= f4(_DARK_SUM)) & (o_sum >= f4(_DARK_SUM)) else f4(0)
            m_scale, o_scale = f4(255) / max(m_sum, f4(1)), f4(255) / max(o_sum, f4(1))
            r0, r1, r2 = o0 * o_scale - m0 * m_scale, o1 * o_scale - m1 * m_scale, o2 * o_scale - m2 * m_scale
            totals[COLOURED * LANES + j] += on
            totals[CHROMA_ERROR * LANES + j] += on * (r0 * r0 + r1 * r1 + r2 * r2)


@kernel(fastmath=True, is_inner=True)
def _empty_row(row, n_blocks):
    for b in range(n_blocks):
        block = row[b * BLOCK : b * BLOCK + BLOCK]
        for j in range(LANES):
            block[W + j] = f4(0)
            block[SHADE + j] = f4(0)


@kernel(fastmath=True)
def sum_hypotheses(shapes, geometry, R, t, views, sizes, lights, ambient, images, with_chroma, out):
    """Fill `out` (n, views, SUMS) for the hypotheses R (n, s, 3, 3), t (n, s, 3) [m]; sums not asked for are zero.

    `shapes` is the thread's workspace; `views` (v, 18); `sizes` (v, 3): pixels a row, rows, offset in
    `images`, which holds, view by view and row by row, blocks of 16 reds, 16 greens, 16 blues; `lights` (v, l, 8), or
    None: no light, and chroma alone.
    """
    row = new_row(_largest_width(sizes))
    totals = np.empty(SUMS * LANES, np.float32)
    for h in range(len(R)):
        pose_shapes(shapes, geometry, R[h], t[h])
        for i in range(len(views)):
            width, height, offset, view = sizes[i, 0], sizes[i, 1], sizes[i, 2], views[i]
            blocks = (width + LANES - 1) // LANES
            top, row_start, row_stop, ends, curves = list_spans(shapes, geometry, view, width, height)
            for k in range(SUMS * LANES):
                totals[k] = 0
            x_step, y_step = f4(view[VIEW_K]), f4(view[VIEW_K + 3])
            for k in range(len(row_stop)):
                v, start, stop = top + k, row_start[k], row_stop[k]
                if stop == start:
                    continue
                first, last = block_range(ends, start, stop)
                draw_row(row, shapes.outline, shapes.surface, ends, curves, start, stop, v, first, lights)
                u, n_blocks, at = first * LANES, last - first + 1, offset + 3 * LANES * (v * blocks + first)
                x = f4(view[VIEW_K] * u + view[VIEW_K + 1] * v + view[VIEW_K + 2])
                y = f4(view[VIEW_K + 3] * u + view[VIEW_K + 4] * v + view[VIEW_K + 5])
                if with_chroma:
                    _compare_chroma_row(row, n_blocks, images, at, totals)
                if lights is not None:
                    _compare_row(row, n_blocks, lights[i], ambient, x, x_step, y, y_step, images, at, totals)
                _empty_row(row, n_blocks)
            for k in range(SUMS):
                total = 0.0
                for j in range(LANES):
                    total += totals[k * LANES + j]
                out[h, i, k] = total


@kernel(fastmath=True, is_inner=True)
def _largest_width(sizes):
    width = 0
    for i in range(len(sizes)):
        width = max(width, sizes[i, 0])
    return width
