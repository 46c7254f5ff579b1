"""The kernel that compares a body with the pixels: sums over its mask, for many hypotheses and all views."""

from __future__ import annotations

import numpy as np
from numba import njit

from airborne.rendering.rows import BLOCK, BLUE, GREEN, LANES, RED, SHADE, W, count_rows, draw_row, f4, find_spans
from airborne.rendering.rows import light_block, new_row
from airborne.rendering.shapes import INNER, KERNEL, VIEW_K, new_shapes, outline_all, place

DARK = 30.0  # a pixel whose R + G + B is below this has no colour to speak of

# what is summed over the mask, r = observed - model over the three channels
PIXELS, ERROR, CROSS, MODEL, COLOURED, CHROMA_ERROR, SUMS = 0, 1, 2, 3, 4, 5, 6


@njit(**INNER)
def _compare_row(row, n_blocks, lights, ambient, x, x_step, y, y_step, images, offset, totals):
    """Light the blocks of a row, add their differences from the image to `totals` (SUMS * LANES,), empty them."""
    for b in range(n_blocks):
        block = row[b * BLOCK : b * BLOCK + BLOCK]
        light_block(block, lights, x, x_step, y, y_step)
        seen = images[offset + 3 * LANES * b : offset + 3 * LANES * (b + 1)]
        for j in range(LANES):
            is_on = block[W + j] > f4(0)
            light = ambient + block[SHADE + j]
            m0, m1, m2 = light * block[RED + j], light * block[GREEN + j], light * block[BLUE + j]
            o0, o1, o2 = f4(seen[j]), f4(seen[LANES + j]), f4(seen[2 * LANES + j])
            r0, r1, r2 = o0 - m0, o1 - m1, o2 - m2
            totals[PIXELS * LANES + j] += f4(1) if is_on else f4(0)
            totals[ERROR * LANES + j] += r0 * r0 + r1 * r1 + r2 * r2 if is_on else f4(0)
            totals[CROSS * LANES + j] += r0 * m0 + r1 * m1 + r2 * m2 if is_on else f4(0)
            totals[MODEL * LANES + j] += m0 * m0 + m1 * m1 + m2 * m2 if is_on else f4(0)
            o_sum, m_sum = o0 + o1 + o2, block[RED + j] + block[GREEN + j] + block[BLUE + j]
            is_coloured = is_on & (o_sum >= f4(DARK)) & (m_sum >= f4(DARK))
            o_scale, m_scale = f4(255) / max(o_sum, f4(1)), f4(255) / max(m_sum, f4(1))
            c0 = o0 * o_scale - block[RED + j] * m_scale
            c1 = o1 * o_scale - block[GREEN + j] * m_scale
            c2 = o2 * o_scale - block[BLUE + j] * m_scale
            totals[COLOURED * LANES + j] += f4(1) if is_coloured else f4(0)
            totals[CHROMA_ERROR * LANES + j] += c0 * c0 + c1 * c1 + c2 * c2 if is_coloured else f4(0)
            block[W + j] = f4(0)
            block[SHADE + j] = f4(0)
        x += f4(LANES) * x_step
        y += f4(LANES) * y_step


@njit(**KERNEL)
def sum_hypotheses(geometry, R, t, views, sizes, lights, ambient, images, out):
    """Fill `out` (n, views, SUMS) for the hypotheses R (n, s, 3, 3), t (n, s, 3) [m].

    `views` (v, VIEW_COLUMNS), `sizes` (v, 3): width, height, offset of the view in `images`; `lights` (v, l, 8);
    `images` holds, view by view and row by row, blocks of 16 reds, 16 greens, 16 blues.
    """
    shapes = new_shapes(geometry)
    max_width, max_height = 0, 0
    for i in range(len(sizes)):
        max_width, max_height = max(max_width, sizes[i, 0]), max(max_height, sizes[i, 1])
    row = new_row(max_width)
    row_start, row_stop = np.empty(max_height + 1, np.int64), np.empty(max_height, np.int64)
    ends, curves = np.empty((0, 3), np.int64), np.empty((0, 2))
    totals = np.empty(SUMS * LANES, np.float32)
    for h in range(len(R)):
        place(shapes, geometry, R[h], t[h])
        for i in range(len(views)):
            width, height, offset = sizes[i, 0], sizes[i, 1], sizes[i, 2]
            blocks = (width + LANES - 1) // LANES
            view = views[i]
            outline_all(shapes, geometry, view, width, height)
            n_spans = count_rows(shapes.rows, row_start[: height + 1])
            if n_spans > len(ends):
                ends, curves = np.empty((2 * n_spans, 3), np.int64), np.empty((2 * n_spans, 2))
            find_spans(shapes, geometry, width, row_start[: height + 1], row_stop[:height], ends, curves)
            for k in range(SUMS * LANES):
                totals[k] = 0
            x_step, y_step = f4(view[VIEW_K]), f4(view[VIEW_K + 3])
            for v in range(height):
                start, stop = row_start[v], row_stop[v]
                if stop == start:
                    continue
                first, last = width, -1
                for k in range(start, stop):
                    first, last = min(first, ends[k, 0]), max(last, ends[k, 1])
                first, last = first // LANES, last // LANES
                draw_row(row, shapes.outline, shapes.surface, ends, curves, start, stop, v, first)
                u = first * LANES
                x = f4(view[VIEW_K] * u + view[VIEW_K + 1] * v + view[VIEW_K + 2])
                y = f4(view[VIEW_K + 3] * u + view[VIEW_K + 4] * v + view[VIEW_K + 5])
                at = offset + 3 * LANES * (v * blocks + first)
                _compare_row(row, last - first + 1, lights[i], ambient, x, x_step, y, y_step, images, at, totals)
            for k in range(SUMS):
                out[h, i, k] = 0.0
                for j in range(LANES):
                    out[h, i, k] += totals[k * LANES + j]
