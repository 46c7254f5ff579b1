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
    segment, depth = np.empty((h + 2, w + 2), np.int16), np.empty((h + 2, w + 2), np.float32)  # its border repeated
    for y in range(h + 2):
        v = min(max(y - 1, 0), h - 1)
        for x in range(w):
            p = part[v, x]
            segment[y, x + 1] = segment_of_part[p] if p >= 0 else -1
            depth[y, x + 1] = inverse_depth[v, x]
        segment[y, 0], segment[y, w + 1] = segment[y, 1], segment[y, w]
        depth[y, 0], depth[y, w + 1] = depth[y, 1], depth[y, w]
    for y in range(h):
        for x in range(w):
            owner[y, x], nearness[y, x] = segment[y + 1, x + 1], inverse_depth[y, x]
    is_edge = np.empty(w, np.bool_)
    for v in range(h):
        _find_front_edges(segment, depth, v, is_edge)
        for u in range(w):
            if not is_edge[u]:
                continue
            own, near = segment[v + 1, u + 1], inverse_depth[v, u]
            for y in range(max(v - REACH_PX, 0), min(v + REACH_PX + 1, h)):
                for x in range(max(u - REACH_PX, 0), min(u + REACH_PX + 1, w)):
                    d = (v - y) ** 2 + (u - x) ** 2
                    is_closer = d < distance[y, x] if owner[y, x] == own else near > nearness[y, x]
                    if is_closer:
                        owner[y, x], nearness[y, x], distance[y, x] = own, near, d


@kernel(fastmath=True, is_inner=True)
def _find_front_edges(segment, depth, v, is_edge):
    """Fill is_edge (w,): where row v of the body borders on a segment behind it, or on the background.

    segment, depth (h + 2, w + 2): of each pixel, with a border around them that repeats their own.
    """
    here, above, below = segment[v + 1], segment[v], segment[v + 2]
    near, near_above, near_below = depth[v + 1], depth[v], depth[v + 2]
    for x in range(len(is_edge)):
        own, w = here[x + 1], near[x + 1]
        left = (here[x] < 0) | ((here[x] != own) & (near[x] < w))
        right = (here[x + 2] < 0) | ((here[x + 2] != own) & (near[x + 2] < w))
        up = (above[x + 1] < 0) | ((above[x + 1] != own) & (near_above[x + 1] < w))
        down = (below[x + 1] < 0) | ((below[x + 1] != own) & (near_below[x + 1] < w))
        is_edge[x] = (own >= 0) & (left | right | up | down)
