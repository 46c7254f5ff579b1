"""Which pixels a body moves, and by which of its segments. Kernels on the maps of `surface_maps`."""

from __future__ import annotations

import numpy as np

from airborne.kernels import kernel
from airborne.tracking.model_based.kernel_arguments import Window

REACH_PX = 3  # an edge matters this far away: most of the blur's weight


@kernel(fastmath=True)
def mask_box(part):
    """Return the box x0, y0, x1, y1 around the body's pixels of a map of parts (h, w); all 0 where there is none."""
    h, w = part.shape
    x0, y0, x1, y1 = w, h, 0, 0
    for y in range(h):
        first, last = w, 0
        for x in range(w):
            is_body = part[y, x] >= 0
            first, last = min(first, x if is_body else w), max(last, x + 1 if is_body else 0)
        if last > 0:
            x0, x1, y0, y1 = min(x0, first), max(x1, last), min(y0, y), y + 1
    return Window(x0, y0, x1, y1) if x1 > 0 else Window(0, 0, 0, 0)


@kernel(fastmath=True)
def find_owners(part, inverse_depth, segment_of_part, owner, nearness):
    """Assign each pixel to the segment whose edge moves it: of those within REACH_PX, the one nearest to the camera.

    An occluding contour moves with the surface in front, never with the one behind. part, inverse_depth (h, w) maps of
    a region; owner (h, w) segment or -1, nearness (h, w) its inverse depth near there [1/m].
    """
    h, w = owner.shape
    distance = np.zeros((h, w), np.int16)  # squared, to the edge that owns a pixel; 0 inside
    for y in range(h):
        for x in range(w):
            p = part[y, x]
            owner[y, x] = segment_of_part[p] if p >= 0 else -1
            nearness[y, x] = inverse_depth[y, x]
    for v in range(h):
        for u in range(w):
            p = part[v, u]
            if p < 0 or not _is_front_edge(part, inverse_depth, segment_of_part, v, u):
                continue
            own, near = segment_of_part[p], inverse_depth[v, u]
            for y in range(max(v - REACH_PX, 0), min(v + REACH_PX + 1, h)):
                for x in range(max(u - REACH_PX, 0), min(u + REACH_PX + 1, w)):
                    d = (v - y) ** 2 + (u - x) ** 2
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
