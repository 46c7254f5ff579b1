"""The kernel that draws what each pixel of one view shows of a body: which part, how near, facing where or lit how."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.kernels import kernel
from airborne.rendering.rows import (
    BLOCK,
    LANES,
    NX,
    NY,
    NZ,
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
from airborne.rendering.shapes import B_1, B_U, B_V, VIEW_K, pose_shapes
from airborne.rendering.spans import list_spans
from airborne.types import Array32


class SurfaceMaps(NamedTuple):
    """What each pixel of a view shows; see `surface_maps`."""

    part: NDArray[np.int16]  # (h, w)
    inverse_depth: Array32  # (h, w) [1/m]
    normals: Array32  # (3, h, w); (3, 0, 0) where they are not asked for


def empty_maps(size: tuple[int, int], *, with_normals: bool = True) -> SurfaceMaps:
    """Allocate the maps of a view of (width, height)."""
    width, height = size
    return SurfaceMaps(
        np.empty((height, width), np.int16),
        np.empty((height, width), np.float32),
        np.zeros((3, height, width) if with_normals else (3, 0, 0), np.float32),
    )


@kernel(fastmath=True)
def surface_maps(shapes, geometry, R, t, view, part, inverse_depth, values, lights=None, ambient=0.0):
    """Fill the maps of one view with the surface nearest to the camera.

    shapes: a workspace of `new_shapes(geometry)`; R (s, 3, 3), t (s, 3) [m] world from segment; view (18,) packed.
    part (h, w) int16: index into BodyModel.parts, -1 where there is none; inverse_depth (h, w) float32 [1/m], 0 where
    there is none, and for an ellipsoid that of the plane in which its outline lies, because only the outline's motion
    changes the image. values (3, h, w) float32, unchanged where there is none, or of no size: sRGB colours 0..255 and
    above under the packed `lights` (l, 8) and the ambient light, or where `lights` is None outward unit normals in
    camera axes.
    """
    height, width = part.shape
    part[:] = -1
    inverse_depth[:] = 0
    pose_shapes(shapes, geometry, R, t)
    top, row_start, row_stop, ends, curves = list_spans(shapes, geometry, view, width, height)
    row, with_values = new_row(width), values.size > 0
    n_ellipsoids = len(geometry.ellipsoid_part)
    x_step, y_step = f4(view[VIEW_K]), f4(view[VIEW_K + 3])
    for i in range(len(row_stop)):
        v, start, stop = top + i, row_start[i], row_stop[i]
        if stop == start:
            continue
        first, last = block_range(ends, start, stop)
        draw_row(row, shapes.outline, shapes.surface, ends, curves, start, stop, v, first)
        if lights is not None:
            for b in range(first, last + 1):
                u = b * LANES
                x = f4(view[VIEW_K] * u + view[VIEW_K + 1] * v + view[VIEW_K + 2])
                y = f4(view[VIEW_K + 3] * u + view[VIEW_K + 4] * v + view[VIEW_K + 5])
                block = row[(b - first) * BLOCK : (b - first + 1) * BLOCK]
                light_block(block, lights, x, x_step, y, y_step)
        for u in range(first * LANES, min((last + 1) * LANES, width)):
            at = (u // LANES - first) * BLOCK + u % LANES
            w = row[at + W]
            if w > 0:
                shape = int(row[at + SHAPE])
                if shape < n_ellipsoids:
                    outline = shapes.outline[shape]
                    part[v, u] = geometry.ellipsoid_part[shape]
                    inverse_depth[v, u] = outline[B_U] * u + outline[B_V] * v + outline[B_1]
                else:
                    part[v, u] = geometry.polygon_part[shape - n_ellipsoids]
                    inverse_depth[v, u] = w
                if not with_values:
                    continue
                if lights is not None:
                    light = ambient + row[at + SHADE]
                    for k in range(3):
                        values[k, v, u] = light * row[at + RED + LANES * k]
                else:
                    x, y, z = row[at + NX], row[at + NY], row[at + NZ]
                    length = np.sqrt(x * x + y * y + z * z)
                    values[0, v, u], values[1, v, u], values[2, v, u] = x / length, y / length, z / length
        for b in range(last - first + 1):
            for j in range(LANES):
                row[b * BLOCK + W + j] = row[b * BLOCK + SHADE + j] = 0
