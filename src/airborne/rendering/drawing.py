"""One view of a posed body: which part each pixel shows, how near it is and in what colour."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from airborne.body import PosedBody, SurfaceArrays
from airborne.cameras import Camera
from airborne.kernels import kernel
from airborne.rendering.lights import Lights
from airborne.rendering.packing import pack_lights, pack_view, shift_view
from airborne.rendering.rows import (
    BLOCK,
    BLUE,
    GREEN,
    LANES,
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
from airborne.rendering.shapes import VIEW_K, new_shapes, pose_shapes
from airborne.rendering.spans import list_spans


@dataclass(frozen=True, slots=True, eq=False)
class Rendering:
    """The maps of one view, or of the region x0 <= x < x1, y0 <= y < y1 of it; h rows, w columns."""

    region: tuple[int, int, int, int]  # x0, y0, x1, y1 [px]
    part: NDArray[np.int16]  # (h, w) index into BodyModel.parts, -1 where there is no body
    segment: NDArray[np.int16]  # (h, w) index into BodyModel.segments, -1 where there is no body
    inverse_depth: NDArray[np.floating]  # (h, w) [1/m] along the optical axis, 0 where there is no body
    colour: NDArray[np.floating]  # (h, w, 3) lit sRGB 0..255 and above, black where there is no body

    @property
    def mask(self) -> NDArray[np.bool_]:
        """Where the body is: (h, w)."""
        return self.part >= 0


def render(
    geometry: SurfaceArrays,
    posed: PosedBody,
    camera: Camera,
    lights: Lights,
    *,
    region: tuple[int, int, int, int] | None = None,
    shapes: Any = None,
) -> Rendering:
    """Draw a body in one view, or in the region x0, y0, x1, y1 of it, which is cut to the image.

    `shapes` is a workspace of `new_shapes(geometry)` to use again, for callers that draw often. Raises CalibrationError
    for a distorted camera.
    """
    width, height = camera.size
    x0, y0, x1, y1 = region or (0, 0, width, height)
    x0, y0, x1, y1 = max(x0, 0), max(y0, 0), min(x1, width), min(y1, height)
    view = shift_view(pack_view(camera), x0, y0)
    size = (max(y1 - y0, 0), max(x1 - x0, 0))
    part, segment = np.full(size, -1, np.int16), np.full(size, -1, np.int16)
    inverse_depth, colour = np.zeros(size, np.float32), np.zeros((*size, 3), np.float32)
    draw_maps(
        new_shapes(geometry) if shapes is None else shapes,
        geometry,
        posed.R,
        posed.t,
        view,
        pack_lights(lights, camera),
        np.float32(lights.ambient),
        part,
        segment,
        inverse_depth,
        colour,
    )
    return Rendering((x0, y0, x1, y1), part, segment, inverse_depth, colour)


@kernel(fastmath=True)
def draw_maps(shapes, geometry, R, t, view, lights, ambient, part, segment, inverse_depth, colour):
    """Draw on maps that hold background everywhere; see `Rendering` for them, `sum_hypotheses` for the rest."""
    height, width = part.shape
    pose_shapes(shapes, geometry, R, t)
    top, row_start, row_stop, ends, curves = list_spans(shapes, geometry, view, width, height)
    row = new_row(width)
    n_ellipsoids = len(geometry.ellipsoid_part)
    x_step, y_step = f4(view[VIEW_K]), f4(view[VIEW_K + 3])
    for i in range(len(row_stop)):
        v, start, stop = top + i, row_start[i], row_stop[i]
        if stop == start:
            continue
        first, last = block_range(ends, start, stop)
        draw_row(row, shapes.outline, shapes.surface, ends, curves, start, stop, v, first)
        for b in range(first, last + 1):
            u = b * LANES
            block = row[(b - first) * BLOCK : (b - first + 1) * BLOCK]
            x = f4(view[VIEW_K] * u + view[VIEW_K + 1] * v + view[VIEW_K + 2])
            y = f4(view[VIEW_K + 3] * u + view[VIEW_K + 4] * v + view[VIEW_K + 5])
            light_block(block, lights, x, x_step, y, y_step)
            for j in range(min(LANES, width - u)):
                if block[W + j] > 0:
                    shape = int(block[SHAPE + j])
                    if shape < n_ellipsoids:
                        part[v, u + j] = geometry.ellipsoid_part[shape]
                        segment[v, u + j] = geometry.ellipsoid_segment[shape]
                    else:
                        part[v, u + j] = geometry.polygon_part[shape - n_ellipsoids]
                        segment[v, u + j] = geometry.polygon_segment[shape - n_ellipsoids]
                    inverse_depth[v, u + j] = block[W + j]
                    light = ambient + block[SHADE + j]
                    colour[v, u + j, 0] = light * block[RED + j]
                    colour[v, u + j, 1] = light * block[GREEN + j]
                    colour[v, u + j, 2] = light * block[BLUE + j]
            for j in range(LANES):
                block[W + j] = 0
                block[SHADE + j] = 0
