"""The kernel that draws a body in two layers: what each pixel shows, and what it would show without that segment."""

from __future__ import annotations

import numpy as np

from airborne.kernels import kernel
from airborne.rendering.rows import (
    BLOCK,
    LANES,
    NX,
    RED,
    SHADE,
    SHAPE,
    W,
    block_range,
    draw_row,
    f4,
    light_block,
    new_row,
)
from airborne.rendering.shapes import VIEW_K, pose_shapes
from airborne.rendering.spans import list_spans


@kernel(fastmath=True)
def draw_layers(shapes, geometry, R, t, view, lights, ambient, part, segment, values):
    """Fill the maps of two layers of one view: the nearest surface, and the nearest one of any other segment.

    part, segment (2, h, w) int16: indices, -1 where there is none. values (2, 3, h, w) float32, unchanged where there
    is none: sRGB colours 0..255 and above under the packed `lights` (l, 8) and the ambient light, or where `lights` is
    None outward unit normals in camera axes. For the others see `surface_maps`.
    """
    height, width = part.shape[1], part.shape[2]
    part[:] = -1
    segment[:] = -1
    pose_shapes(shapes, geometry, R, t)
    top, row_start, row_stop, ends, curves = list_spans(shapes, geometry, view, width, height)
    most = 0
    for i in range(len(row_stop)):
        most = max(most, row_stop[i] - row_start[i])
    row, most = new_row(width), most * (width // 2 + 1)
    ends_behind, curves_behind = np.empty((most, 3), np.int64), np.empty((most, 2))
    for i in range(len(row_stop)):
        v, start, stop = top + i, row_start[i], row_stop[i]
        if stop == start:
            continue
        first, last = block_range(ends, start, stop)
        draw_row(row, shapes.outline, shapes.surface, ends, curves, start, stop, v, first)
        _take_row(row, first, last, geometry, view, lights, ambient, v, part[0], segment[0], values[0])
        n = _spans_behind(ends, curves, start, stop, geometry, segment[0, v], ends_behind, curves_behind)
        if n == 0:
            continue
        first, last = block_range(ends_behind, 0, n)
        draw_row(row, shapes.outline, shapes.surface, ends_behind, curves_behind, 0, n, v, first)
        _take_row(row, first, last, geometry, view, lights, ambient, v, part[1], segment[1], values[1])


@kernel(fastmath=True, is_inner=True)
def _spans_behind(ends, curves, start, stop, geometry, segment, ends_behind, curves_behind):
    """List the runs of a row's spans where another segment (w,) than the span's own is in front; return how many."""
    n, n_ellipsoids = 0, len(geometry.ellipsoid_segment)
    for i in range(start, stop):
        s = ends[i, 2]
        own = geometry.ellipsoid_segment[s] if s < n_ellipsoids else geometry.polygon_segment[s - n_ellipsoids]
        is_in_run = False
        for u in range(ends[i, 0], ends[i, 1] + 1):
            is_behind = segment[u] != own
            if is_behind and not is_in_run:
                ends_behind[n, 0], ends_behind[n, 2] = u, s
                curves_behind[n, 0], curves_behind[n, 1] = curves[i, 0], curves[i, 1]
                n += 1
            if is_behind:
                ends_behind[n - 1, 1] = u
            is_in_run = is_behind
    return n


@kernel(fastmath=True, is_inner=True)
def _take_row(row, first, last, geometry, view, lights, ambient, v, part, segment, values):
    """Copy blocks `first` to `last` of a drawn row to the maps of one layer, and empty them."""
    n_ellipsoids, width = len(geometry.ellipsoid_segment), part.shape[1]
    x_step, y_step = f4(view[VIEW_K]), f4(view[VIEW_K + 3])
    for b in range(first, last + 1):
        u = b * LANES
        block = row[(b - first) * BLOCK : (b - first + 1) * BLOCK]
        nearest = f4(0)
        for j in range(LANES):
            nearest = max(nearest, block[W + j])
        if nearest == 0:
            continue
        if lights is not None:
            x = f4(view[VIEW_K] * u + view[VIEW_K + 1] * v + view[VIEW_K + 2])
            y = f4(view[VIEW_K + 3] * u + view[VIEW_K + 4] * v + view[VIEW_K + 5])
            light_block(block, lights, x, x_step, y, y_step)
        for j in range(min(LANES, width - u)):
            if block[W + j] > 0:
                s = int(block[SHAPE + j])
                p = s - n_ellipsoids
                part[v, u + j] = geometry.ellipsoid_part[s] if p < 0 else geometry.polygon_part[p]
                segment[v, u + j] = geometry.ellipsoid_segment[s] if p < 0 else geometry.polygon_segment[p]
                if lights is not None:
                    factor, plane = ambient + block[SHADE + j], RED
                else:
                    nx, ny, nz = block[NX + j], block[NX + LANES + j], block[NX + 2 * LANES + j]
                    factor, plane = f4(1) / np.sqrt(nx * nx + ny * ny + nz * nz), NX
                for k in range(3):
                    values[k, v, u + j] = factor * block[plane + LANES * k + j]
        for j in range(LANES):
            block[W + j] = 0
            block[SHADE + j] = 0
