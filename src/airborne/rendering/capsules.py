"""Evidence under the outline of tapered capsules: one pose of a person in one picture, without visiting its pixels.

A capsule is the hull of two balls; in the picture, of two discs. Its outline in a row is a span; the sum of a map over
a span is the difference of two running sums along that row. Where capsules overlap, the nearer one owns the pixels.
Along its axis a capsule may change from one map to another (shorts to skin). How the sum changes as the discs move is
read off at the ends of the spans: only there, and at the border between its two maps, pixels change hands.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

# no fast maths: sums keep their order, so that a run is the same to the last bit however the code was compiled
EXACT: dict[str, Any] = {"nogil": True, "error_model": "numpy", "cache": True}

MOST_SPANS = 64  # capsules in one row
BEHIND = 1e9  # depth of what is not in front of the camera [m]
_MOST_SLOPE = 4.0  # of an edge that a row cuts: flatter ones are seen at their ends
_BORDER_SAMPLES = 5


@njit(**EXACT)
def running_sums(maps, out):
    """Fill out (k, h, w + 1) with the sums of maps (k, h, w) over all pixels to the left of each pixel's left side."""
    k, h, w = maps.shape
    for c in range(k):
        for y in range(h):
            total = np.float32(0)
            out[c, y, 0] = 0
            for x in range(w):
                total += maps[c, y, x]
                out[c, y, x + 1] = total


@njit(**EXACT)
def project(ends, radii, camera, discs, depth):
    """Project capsules: ends (n, 2, 3) world [m], radii (n, 2) [m], camera (4, 4): K [R t], then the focal length [px].

    Fills discs (n, 2, 3), the centre (x, y) and the radius of each end's disc [px], and depth (n,) [m], BEHIND for a
    capsule that is not in front of the camera.
    """
    f = camera[3, 0]
    for i in range(len(ends)):
        nearest, mean = BEHIND, 0.0
        for e in range(2):
            x, y, z = ends[i, e, 0], ends[i, e, 1], ends[i, e, 2]
            w = camera[2, 0] * x + camera[2, 1] * y + camera[2, 2] * z + camera[2, 3]
            nearest = min(nearest, w)
            mean += 0.5 * w
            w = max(w, 1e-3)
            discs[i, e, 0] = (camera[0, 0] * x + camera[0, 1] * y + camera[0, 2] * z + camera[0, 3]) / w
            discs[i, e, 1] = (camera[1, 0] * x + camera[1, 1] * y + camera[1, 2] * z + camera[1, 3]) / w
            discs[i, e, 2] = f * radii[i, e] / w
        depth[i] = mean if nearest > 0.1 else BEHIND


@njit(**EXACT)
def outline(disc_a, disc_b, y_first, x, tangents):
    """Outline the hull of two discs (x, y, radius) [px] in rows at y_first, y_first + 1, ...

    Fills x (2, rows), where it begins and ends in each row, and tangents (2, 8), what `_motion` takes of either side.
    Returns the first and one past the last row that is met.
    """
    n = x.shape[1]
    top = min(disc_a[1] - disc_a[2], disc_b[1] - disc_b[2])
    bottom = max(disc_a[1] + disc_a[2], disc_b[1] + disc_b[2])
    first = int(min(max(np.ceil(top - y_first), 0.0), n))
    last = int(min(max(np.floor(bottom - y_first) + 1, first), n))
    ux, uy, dr = disc_b[0] - disc_a[0], disc_b[1] - disc_a[1], disc_a[2] - disc_b[2]
    d2 = ux * ux + uy * uy
    is_one = d2 <= dr * dr * 1.0001  # one disc lies in the other
    cosine, sine = 0.0, 0.0
    if not is_one:
        cosine, sine = dr / d2, np.sqrt(d2 - dr * dr) / d2
    for side in range(2):
        outward = 2.0 * side - 1.0
        high, low, ax, ay, slope, nx, ny, length = BEHIND, BEHIND, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0
        upper = 0.0 if dr > 0 else 1.0
        lower = upper
        if not is_one:  # the common tangent on this side
            sign = 1.0 if (side == 0) == (uy > 0) else -1.0
            nx, ny = ux * cosine - sign * uy * sine, uy * cosine + sign * ux * sine
            ax, ay = disc_a[0] + disc_a[2] * nx, disc_a[1] + disc_a[2] * ny
            bx, by = disc_b[0] + disc_b[2] * nx, disc_b[1] + disc_b[2] * ny
            length = by - ay
            slope = (bx - ax) / length if abs(length) > 1e-9 else 0.0
            upper, lower = (0.0, 1.0) if ay < by else (1.0, 0.0)
            high, low = min(ay, by), max(ay, by)
        for k, value in enumerate((high, low, ay, slope, nx, ny, length, upper)):
            tangents[side, k] = value
        in_tangent = int(min(max(np.ceil(high - y_first), first), last))
        after_tangent = int(min(max(np.floor(low - y_first) + 1, in_tangent), last))
        _cap(disc_a if upper == 0 else disc_b, y_first, outward, first, in_tangent, x[side])
        for i in range(in_tangent, after_tangent):
            x[side, i] = ax + slope * (y_first + i - ay)
        _cap(disc_a if lower == 0 else disc_b, y_first, outward, after_tangent, last, x[side])
    return first, last


@njit(**EXACT)
def _cap(disc, y_first, outward, start, stop, x):
    for i in range(start, stop):
        dy = y_first + i - disc[1]
        x[i] = disc[0] + outward * np.sqrt(max(disc[2] * disc[2] - dy * dy, 0.0))


@njit(**EXACT)
def _motion(disc_a, disc_b, tangent, y, outward, dx):
    """Fill dx (6,) with how a side of an outline moves in a row, by (x, y, radius) of disc a, then of disc b."""
    high, low, ay, slope, nx, ny, length, upper = tangent
    if high <= y <= low:
        t = (y - ay) / length if abs(length) > 1e-9 else 0.5
        steep = min(max(slope, -_MOST_SLOPE), _MOST_SLOPE)
        along = nx - steep * ny  # what a larger radius does
        dx[0], dx[1], dx[2] = 1 - t, -steep * (1 - t), along * (1 - t)
        dx[3], dx[4], dx[5] = t, -steep * t, along * t
        return
    at_a = (upper == 0) == (y < high) or (high == BEHIND and upper == 0)
    disc, k = (disc_a, 0) if at_a else (disc_b, 3)
    dy = y - disc[1]
    h = max(np.sqrt(max(disc[2] * disc[2] - dy * dy, 0.0)), disc[2] / _MOST_SLOPE, 1e-6)
    dx[:] = 0
    dx[k], dx[k + 1], dx[k + 2] = 1, outward * dy / h, outward * disc[2] / h


@njit(**EXACT)
def _read(row, x):
    """Read running sums between pixels: pixel i reaches from i - 0.5 to i + 0.5."""
    i = int(x + np.float32(0.5))
    return row[i] + (x + np.float32(0.5) - i) * (row[i + 1] - row[i])


@njit(**EXACT)
def _value(row, x):
    """Read the map itself from its running sums: linear between the pixels' middles."""
    i = int(x)
    f = x - i
    return (1 - f) * (row[i + 1] - row[i]) + f * (row[i + 2] - row[i + 1])


@njit(**EXACT)
def evidence(discs, depth, kinds, share, sums, contrast, origin, work, out, gradient, curvature):
    """Add up maps under the capsules, and how the sum changes as their discs move.

    discs (n, 2, 3) and depth (n,) as `project` gives them, in the pixels of the maps; kinds (n, 2) the map at either
    end of each capsule and share (n,) how far along its axis the first one reaches; sums (k, h, w + 1) running sums of
    the maps over a region whose first pixel is origin (x, y); contrast (k,) by how much each map falls across an edge
    of what it shows. What lies outside the region counts nothing. work is
    x (n, 2, h) and tangents (n, 2, 8). Fills out (n, 2, 2), the sum and the area [px] that each capsule owns of its
    first and its second map; and if gradient (n, 7) is not empty, that and curvature (n, 7, 7), which is what maps
    have that fall by their contrast within a pixel of every edge, by (x, y, radius) of both discs and the share.
    """
    n, (_, h, w) = len(discs), sums.shape
    with_gradient = len(gradient) > 0
    order = np.argsort(depth)
    out[:], gradient[:], curvature[:] = 0, 0, 0
    first, last = np.zeros(n, np.int64), np.zeros(n, np.int64)
    top, bottom = h, 0
    x, tangents = work
    dx = np.empty(6)
    for i in range(n):
        if depth[i] < BEHIND:
            first[i], last[i] = outline(discs[i, 0], discs[i, 1], origin[1], x[i], tangents[i])
            if last[i] > first[i]:
                top, bottom = min(top, first[i]), max(bottom, last[i])
    taken_x, taken_by = np.empty((MOST_SPANS, 2), np.float32), np.empty((MOST_SPANS, 2), np.int64)
    least, most = np.float32(0), np.float32(w) - np.float32(2)
    ox = np.float32(origin[0])
    for row in range(top, bottom):
        taken, y = 0, row + origin[1]
        for j in range(n):
            i = order[j]
            if row < first[i] or row >= last[i]:
                continue
            a, b = max(np.float32(x[i, 0, row]) - ox, least), min(np.float32(x[i, 1, row]) - ox, most)
            if b <= a:
                continue
            cut, weight, split = _border(discs[i], share[i], y, 0.5 * (a + b) + ox)
            cut -= ox
            map_0, map_1 = sums[kinds[i, 0], row], sums[kinds[i, 1], row]
            at, from_k = a, -1  # walk through what nearer capsules have left free
            for k in range(taken + 1):
                if k < taken and taken_x[k, 1] <= at:
                    continue
                is_open = k >= taken or taken_x[k, 0] >= b
                end = b if is_open else taken_x[k, 0]
                if end > at:
                    _own(map_0, map_1, at, end, cut, weight, split, out[i])
                    if with_gradient:
                        who, side = (i, 0) if from_k < 0 else (taken_by[from_k, 1], 1)
                        if at > least:
                            value = _at_edge(map_0, map_1, at, cut, weight, split)
                            _motion(discs[who, 0], discs[who, 1], tangents[who, side], y, 2.0 * side - 1.0, dx)
                            _pull(
                                dx,
                                -value,
                                _at_edge_of(contrast, kinds[i], at, cut, weight, split),
                                gradient[who],
                                curvature[who],
                            )
                        who, side = (i, 1) if is_open else (taken_by[k, 0], 0)
                        if end < most:
                            value = _at_edge(map_0, map_1, end, cut, weight, split)
                            _motion(discs[who, 0], discs[who, 1], tangents[who, side], y, 2.0 * side - 1.0, dx)
                            _pull(
                                dx,
                                value,
                                _at_edge_of(contrast, kinds[i], end, cut, weight, split),
                                gradient[who],
                                curvature[who],
                            )
                if is_open:
                    break
                at, from_k = max(at, taken_x[k, 1]), k
            taken = _claim(taken_x, taken_by, taken, a, b, i)
    if with_gradient:
        for i in range(n):
            for p in range(6):
                for q in range(p):
                    curvature[i, q, p] = curvature[i, p, q]
            if last[i] > first[i] and kinds[i, 0] != kinds[i, 1]:
                maps = sums[kinds[i, 0]], sums[kinds[i, 1]]
                between = 0.5 * (contrast[kinds[i, 0]] + contrast[kinds[i, 1]])
                _pull_border(discs[i], share[i], maps, between, origin, gradient[i], curvature[i])


@njit(**EXACT)
def _border(disc, share, y, x_middle):
    """Say where a row meets the border across a capsule, at a share of its axis: (x, weight, split).

    split is 0 where the border lies along the row: then `weight` of the row belongs to the first map; else 1 where the
    first map lies left of x, -1 where it lies right.
    """
    ux, uy = disc[1, 0] - disc[0, 0], disc[1, 1] - disc[0, 1]
    cx, cy = disc[0, 0] + share * ux, disc[0, 1] + share * uy
    if abs(ux) > 0.3 * abs(uy):
        return cx - (y - cy) * uy / ux, 1.0, 1 if ux > 0 else -1
    if uy == 0:
        return cx, 1.0, 0
    y_border = cy - (x_middle - cx) * ux / uy
    beyond = (y - y_border) * (1.0 if uy > 0 else -1.0)
    return cx, min(max(0.5 - beyond, 0.0), 1.0), 0


@njit(**EXACT)
def _own(map_0, map_1, at, end, cut, weight, split, out):
    """Add the sums and the areas from `at` to `end` of a row of running sums to out (2, 2)."""
    if split == 0:
        if weight > 0:
            out[0, 0] += weight * (_read(map_0, end) - _read(map_0, at))
            out[0, 1] += weight * (end - at)
        if weight < 1:
            out[1, 0] += (1 - weight) * (_read(map_1, end) - _read(map_1, at))
            out[1, 1] += (1 - weight) * (end - at)
        return
    middle = min(max(np.float32(cut), at), end)
    i, j = (0, 1) if split > 0 else (1, 0)
    on_left, on_right = (map_0, map_1) if split > 0 else (map_1, map_0)
    out[i, 0] += _read(on_left, middle) - _read(on_left, at)
    out[i, 1] += middle - at
    out[j, 0] += _read(on_right, end) - _read(on_right, middle)
    out[j, 1] += end - middle


@njit(**EXACT)
def _at_edge(map_0, map_1, edge, cut, weight, split):
    """Read the map that holds at an edge of a span."""
    if split == 0:
        return weight * _value(map_0, edge) + (1 - weight) * _value(map_1, edge)
    return _value(map_0, edge) if (edge < cut) == (split > 0) else _value(map_1, edge)


@njit(**EXACT)
def _at_edge_of(contrast, kinds, edge, cut, weight, split):
    """Read the contrast of the map that holds at an edge of a span."""
    if split == 0:
        return weight * contrast[kinds[0]] + (1 - weight) * contrast[kinds[1]]
    return contrast[kinds[0]] if (edge < cut) == (split > 0) else contrast[kinds[1]]


@njit(**EXACT)
def _pull(dx, value, contrast, gradient, curvature):
    """Add an edge that gains `value` per pixel of motion dx (6,) to the right."""
    slope = dx[1] + dx[4]
    facing = contrast / np.sqrt(1 + slope * slope)
    for p in range(6):
        gradient[p] += value * dx[p]
        for q in range(p + 1):
            curvature[p, q] += facing * dx[p] * dx[q]


@njit(**EXACT)
def _pull_border(disc, share, maps, contrast, origin, gradient, curvature):
    """Add what a border across a capsule gains when it moves along the axis."""
    ux, uy = disc[1, 0] - disc[0, 0], disc[1, 1] - disc[0, 1]
    length = np.sqrt(ux * ux + uy * uy)
    if length < 1 or not 0 < share < 1:
        return
    ux, uy = ux / length, uy / length
    radius = (1 - share) * disc[0, 2] + share * disc[1, 2]
    cx = (1 - share) * disc[0, 0] + share * disc[1, 0] - origin[0]
    cy = (1 - share) * disc[0, 1] + share * disc[1, 1] - origin[1]
    h, w = maps[0].shape
    step = 2 * radius / _BORDER_SAMPLES
    for i in range(_BORDER_SAMPLES):
        offset = (i + 0.5) * step - radius
        x, row = cx - offset * uy, int(np.floor(cy + offset * ux + 0.5))
        if not (0 <= row < h and 0 <= x < w - 2):
            continue
        value = (_value(maps[0][row], x) - _value(maps[1][row], x)) * step
        along = (ux * (1 - share), uy * (1 - share), 0.0, ux * share, uy * share, 0.0, length)
        for p in range(7):
            gradient[p] += value * along[p]
            for q in range(7):
                curvature[p, q] += contrast * step * along[p] * along[q]


@njit(**EXACT)
def _claim(taken_x, taken_by, taken, a, b, owner):
    """Join a span to the ordered, separate ones taken so far, each end with its owner; return how many there are."""
    left_by, right_by, kept = owner, owner, 0
    for k in range(taken):
        if taken_x[k, 1] < a or taken_x[k, 0] > b:
            taken_x[kept], taken_by[kept] = taken_x[k], taken_by[k]
            kept += 1
            continue
        if taken_x[k, 0] <= a:
            a, left_by = taken_x[k, 0], taken_by[k, 0]
        if taken_x[k, 1] >= b:
            b, right_by = taken_x[k, 1], taken_by[k, 1]
    if kept == MOST_SPANS:
        return kept
    k = kept
    while k > 0 and taken_x[k - 1, 0] > a:
        taken_x[k], taken_by[k] = taken_x[k - 1], taken_by[k - 1]
        k -= 1
    taken_x[k, 0], taken_x[k, 1], taken_by[k, 0], taken_by[k, 1] = a, b, left_by, right_by
    return kept + 1


@njit(**EXACT)
def labels(discs, depth, kinds, share, out):
    """Fill out (h, w) with the kind of the nearest capsule at each pixel, -1 where there is none; see `evidence`."""
    h, w = out.shape
    out[:] = -1
    x, tangents = np.empty((2, h)), np.empty((2, 8))
    order = np.argsort(-depth)
    for i in order:
        if depth[i] >= BEHIND:
            continue
        first, last = outline(discs[i, 0], discs[i, 1], 0.0, x, tangents)
        ux, uy = discs[i, 1, 0] - discs[i, 0, 0], discs[i, 1, 1] - discs[i, 0, 1]
        cx, cy = discs[i, 0, 0] + share[i] * ux, discs[i, 0, 1] + share[i] * uy
        for y in range(first, last):
            for u in range(max(int(np.ceil(x[0, y])), 0), min(int(np.floor(x[1, y])), w - 1) + 1):
                is_first = share[i] >= 1 or (u - cx) * ux + (y - cy) * uy < 0
                out[y, u] = kinds[i, 0] if is_first else kinds[i, 1]
