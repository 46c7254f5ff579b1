"""Evidence under the outline of tapered capsules: one pose of a person in one image, without visiting its pixels.

The sum of a map under a capsule is that of its spans. Where capsules overlap, the nearer one owns the pixels. The
derivatives of the sum by the discs come from the ends of the spans: only there, and at the border between a capsule's
two maps, pixels change owner.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from airborne.kernels import kernel
from airborne.tracking.capsules.outlines import BEHIND_M, border_in_row, outline, part_at
from airborne.tracking.capsules.spans import (
    MOST_SPANS,
    MapBorder,
    add_span,
    border_sum_at,
    border_value_at,
    contrast_at,
    merge_span,
    value_at,
    value_between,
)

_BORDER_SAMPLES = 5  # across an outline, of which a pixel is the mean
_LEVEL_RATIO = 2.0  # tangents that run this much further across than down are integrated over columns, not rows


class _Edge(NamedTuple):
    """An end of a span."""

    who: Any  # the capsule whose outline it is
    piece: Any  # of the outline, see `outline`
    y: Any  # of the row [px]
    side: Any  # 0: the span begins here; 1: it ends
    at: Any  # x in the region [px]
    gain: Any  # sign of what the span gains when the edge moves right
    contrast: Any  # of the map there


class _Nearer(NamedTuple):
    """A capsule, and what may be nearer."""

    order: Any  # (n,) capsules from near to far
    i: Any  # the capsule
    first: Any  # (n,) row of each outline
    last: Any  # (n,) one past the last row
    x: Any  # (n, 2, h) outlines, see `outline`


@kernel
def capsule_evidence(discs, depth, classes, share, sums, contrast, origin, work, out, gradient, curvature):
    """Sum maps under the capsules, and differentiate the sum by their discs.

    discs (n, 2, 3) and depth (n,) as `project` gives them, in the pixels of the maps; classes (n, 2) the map at either
    end of each capsule and share (n,) how far along its axis the first one reaches; sums (k, h, w + 1) running sums of
    the maps over a region whose first pixel is origin (x, y); contrast (k,) by how much each map falls across an edge
    of what it shows. What lies outside the region counts as 0. Fills out (n, 2, 2), the sum and the area [px] that each
    capsule owns of its first and its second map; and of the first m capsules the gradient (m, 7) and the curvature
    (m, 7, 7), which is what maps have that fall by their contrast within a pixel of every edge, by (x, y, radius) of
    both discs and the share.
    """
    n, (_, h, w) = len(discs), sums.shape
    n_moving = len(gradient)
    order = np.argsort(depth)
    out.fill(0)
    gradient.fill(0)
    curvature.fill(0)
    first, last = np.zeros(n, np.int64), np.zeros(n, np.int64)
    top, bottom = h, 0
    x, pieces, tangents = work.x, work.pieces, work.tangents
    for i in range(n):
        if depth[i] < BEHIND_M:
            first[i], last[i] = outline(discs[i, 0], discs[i, 1], origin[1], x[i], pieces[i], tangents[i])
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
            cut, weight, split = border_in_row(discs[i], share[i], y, 0.5 * (a + b) + ox)
            border = MapBorder(cut - ox, weight, split)
            map_0, map_1 = sums[classes[i, 0], row], sums[classes[i, 1], row]
            at, from_k = a, -1  # the gaps that nearer capsules have left
            for k in range(taken + 1):
                if k < taken and taken_x[k, 1] <= at:
                    continue
                is_open = k >= taken or taken_x[k, 0] >= b
                end = b if is_open else taken_x[k, 0]
                if end > at:
                    add_span(map_0, map_1, at, end, border, out[i])
                    if n_moving > 0:
                        who, side = (i, 0) if from_k < 0 else (taken_by[from_k, 1], 1)
                        if at > least and who < n_moving:
                            facing = contrast_at(contrast, classes[i, 0], classes[i, 1], at, border)
                            edge = _Edge(who, pieces[who, side, row], y, side, at, -1.0, facing)
                            _add_edge(discs, tangents, edge, ox, map_0, map_1, border, gradient, curvature)
                        who, side = (i, 1) if is_open else (taken_by[k, 0], 0)
                        if end < most and who < n_moving:
                            facing = contrast_at(contrast, classes[i, 0], classes[i, 1], end, border)
                            edge = _Edge(who, pieces[who, side, row], y, side, end, 1.0, facing)
                            _add_edge(discs, tangents, edge, ox, map_0, map_1, border, gradient, curvature)
                if is_open:
                    break
                at, from_k = max(at, taken_x[k, 1]), k
            taken = merge_span(taken_x, taken_by, taken, a, b, i)
    for i in range(n):
        if last[i] <= first[i]:
            continue
        nearer = _Nearer(order, i, first, last, x)
        _add_level_edges(discs, share, tangents[i], classes, sums, contrast, nearer, origin, out, gradient, curvature)
        if i < n_moving and classes[i, 0] != classes[i, 1]:
            sums_of = sums[classes[i, 0]], sums[classes[i, 1]]
            between = 0.5 * (contrast[classes[i, 0]] + contrast[classes[i, 1]])
            _add_border(discs[i], share[i], sums_of, between, nearer, origin, gradient[i], curvature[i])
    for i in range(n_moving):
        for p in range(6):
            for q in range(p):
                curvature[i, q, p] = curvature[i, p, q]


@kernel(inline="always")
def _row_interval(top, bottom, y):
    """Return which part of a height interval counts for the row at y: half way to its neighbours, or to the end."""
    return top if y - 1 < top else y - 0.5, bottom if y + 1 > bottom else y + 0.5


@kernel(is_inner=True)
def _edge_derivative(discs, tangents, who, piece, y, outward):
    """Differentiate an end of a span of capsule `who` by its discs: (x0, x1, t, by_y, by_r).

    It moves along with x of the discs, by_y times y and by_r times their radius: 1 - t of disc a and t of disc b. Over
    the height that counts for the row the outline runs from x0 to x1: a flat edge gains and loses pixels all along it.
    """
    if piece >= 2:
        k = piece - 2
        ax, ay, by = tangents[who, k, 0], tangents[who, k, 1], tangents[who, k, 2]
        slope, nx, ny = tangents[who, k, 3], tangents[who, k, 4], tangents[who, k, 5]
        top, bottom = _row_interval(min(ay, by), max(ay, by), y)
        run = slope * (bottom - top)
        t = min(max((0.5 * (top + bottom) - ay) / (by - ay), 0.0), 1.0) if abs(by - ay) > 1e-9 else 0.5
        along = nx - run * ny  # what a larger radius does
        return ax + slope * (top - ay), ax + slope * (bottom - ay), t, -run, along
    cx, cy, r = discs[who, piece, 0], discs[who, piece, 1], discs[who, piece, 2]
    top, bottom = _row_interval(cy - r, cy + r, y)
    top, bottom = min(max(top - cy, -r), r), min(max(bottom - cy, -r), r)
    h_top, h_bottom = np.sqrt(max(r * r - top * top, 0.0)), np.sqrt(max(r * r - bottom * bottom, 0.0))
    by_r = outward * r * (np.arcsin(bottom / r) - np.arcsin(top / r))
    return cx + outward * h_top, cx + outward * h_bottom, float(piece), -outward * (h_bottom - h_top), by_r


@kernel(is_inner=True)
def _add_edge(discs, tangents, edge, ox, map_0, map_1, border, gradient, curvature):
    """Add the derivatives at the end of a span by its capsule's discs; ox is the region's first column.

    A flat edge gains all along the interval that it covers within the row. Level ones are left to `_add_level_edges`.
    """
    who, piece = edge.who, edge.piece
    if piece >= 2 and _is_level(tangents[who, piece - 2]):
        return
    x0, x1, t, by_y, by_r = _edge_derivative(discs, tangents, who, piece, edge.y, 2.0 * edge.side - 1.0)
    last = np.float32(len(map_0) - 2.0)
    left = min(max(np.float32(min(x0, x1)) - ox, np.float32(0)), last)
    right = min(max(np.float32(max(x0, x1)) - ox, np.float32(0)), last)
    if right - left > 1:
        inside = border_sum_at(map_0, map_1, right, border) - border_sum_at(map_0, map_1, left, border)
        value = edge.gain * inside / (right - left)
    else:
        value = edge.gain * border_value_at(map_0, map_1, edge.at, border)
    facing = edge.contrast / np.sqrt(1 + by_y * by_y)
    _accumulate(1.0, by_y, by_r, t, value, facing, gradient[who], curvature[who])


@kernel
def _accumulate(by_x, by_y, by_r, t, value, facing, gradient, curvature):
    """Add an edge with derivatives by_x, by_y, by_r by x, y, radius: 1 - t of disc a, t of b; `value`: its gain."""
    of_a, of_b, by = 1 - t, t, (by_x, by_y, by_r)
    if of_a > 0:
        for p in range(3):
            gradient[p] += value * of_a * by[p]
            for q in range(p + 1):
                curvature[p, q] += facing * of_a * of_a * by[p] * by[q]
    if of_b > 0:
        for p in range(3):
            gradient[3 + p] += value * of_b * by[p]
            for q in range(p + 1):
                curvature[3 + p, 3 + q] += facing * of_b * of_b * by[p] * by[q]
        if of_a > 0:
            for p in range(3):
                for q in range(3):
                    curvature[3 + p, q] += facing * of_a * of_b * by[p] * by[q]


@kernel(inline="always")
def _is_level(tangent):
    """Return whether a tangent runs across rather than down; False where there is none."""
    return abs(tangent[6] - tangent[0]) > _LEVEL_RATIO * abs(tangent[2] - tangent[1])


@kernel(is_inner=True)
def _add_level_edges(discs, share, tangents, classes, sums, contrast, nearer, origin, out, gradient, curvature):
    """Correct the sums along a capsule's level tangents column by column, and add their derivatives.

    Rows meet such an edge once or not at all, and count whole: its sum would be a staircase. Its derivative outward is
    the map there, less that of what lies behind; where a nearer capsule covers it, it is 0.
    """
    order, i, first, last, x = nearer
    h, w = sums.shape[1:]
    for k in range(2):
        tangent = tangents[k]
        if not _is_level(tangent):
            continue
        ax, ay, by, ny, bx = tangent[0], tangent[1] - origin[1], tangent[2] - origin[1], tangent[5], tangent[6]
        low, high, m, outward = min(ay, by), max(ay, by), (by - ay) / (bx - ax), 1.0 if ny > 0 else -1.0
        for above in range(max(int(np.floor(low)), 0), min(int(np.floor(high)), h - 2) + 1):  # between two rows each
            t_0, t_1 = 0.0, 1.0
            if high - low > 1e-9:
                t_0, t_1 = (max(low, above) - ay) / (by - ay), (min(high, above + 1) - ay) / (by - ay)
            n = int(np.ceil(abs((t_1 - t_0) * (bx - ax))))
            for s in range(n):
                t, step = t_0 + (s + 0.5) / n * (t_1 - t_0), abs((t_1 - t_0) * (bx - ax)) / n
                u, height = ax + t * (bx - ax), ay + t * (by - ay)
                column, y, row = u - origin[0], height + origin[1], int(np.floor(height + 0.5))
                if not 0 <= column < w - 2 or _is_occluded(nearer, u, row):
                    continue
                rows_end = np.floor(height) + 0.5 if ny > 0 else np.ceil(height) - 0.5
                missed = step * outward * (height - rows_end)  # of the area
                half = part_at(discs[i], share[i], u, y)
                value, facing = value_between(sums[classes[i, half]], column, height, above), contrast[classes[i, half]]
                out[i, half, 0] += missed * value
                out[i, half, 1] += missed
                is_behind = False
                for j in order:
                    if is_behind and first[j] <= row < last[j] and x[j, 0, row] <= u <= x[j, 1, row]:
                        half = part_at(discs[j], share[j], u, y)
                        lost = value_between(sums[classes[j, half]], column, height, above)
                        out[j, half, 0] -= missed * lost
                        out[j, half, 1] -= missed
                        value, facing = value - lost, facing + contrast[classes[j, half]]
                        break
                    is_behind = is_behind or j == i
                if i < len(gradient):
                    facing *= step / np.sqrt(1 + m * m)
                    _accumulate(-m, 1.0, 1 / ny, t, outward * step * value, facing, gradient[i], curvature[i])


@kernel(is_inner=True)
def _is_occluded(nearer, u, row):
    """Return whether a nearer capsule covers a point of a row."""
    order, i, first, last, x = nearer
    for j in order:
        if j == i:
            return False
        if first[j] <= row < last[j] and x[j, 0, row] <= u <= x[j, 1, row]:
            return True
    return False


@kernel(is_inner=True)
def _add_border(disc, share, maps, contrast, nearer, origin, gradient, curvature):
    """Add the derivatives of the border across a capsule as it moves along the axis."""
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
        offset = radius * ((2 * i + 1) / _BORDER_SAMPLES - 1)
        x, row = cx - offset * uy, int(np.floor(cy + offset * ux + 0.5))
        if not (0 <= row < h and 0 <= x < w - 2) or _is_occluded(nearer, x + origin[0], row):
            continue
        value = (value_at(maps[0][row], x) - value_at(maps[1][row], x)) * step
        along = (ux * (1 - share), uy * (1 - share), 0.0, ux * share, uy * share, 0.0, length)
        for p in range(7):
            gradient[p] += value * along[p]
            for q in range(7):
                curvature[p, q] += contrast * step * along[p] * along[q]
