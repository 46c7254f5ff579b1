"""Spans of rows over maps stored as cumulative sums: the sum over a span costs two reads, however long it is.

Where a row crosses from one map to another, a `MapBorder` says how.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from airborne.kernels import kernel

MOST_SPANS = 64  # disjoint ones in one row


class MapBorder(NamedTuple):
    """Where a row meets the border between the first and the second map of a capsule."""

    cut: Any  # x [px]
    weight: Any  # with split 0: the first map's share of the row
    split: Any  # 0: the border lies along the row; 1: the first map lies left of cut; -1: right


@kernel
def cumulative_sums(maps, out):
    """Fill out (k, h, w + 1) with the sums of maps (k, h, w) over all pixels to the left of each pixel's left side."""
    k, h, w = maps.shape
    for c in range(k):
        for y in range(h):
            total = np.float32(0)
            out[c, y, 0] = 0
            for x in range(w):
                total += maps[c, y, x]
                out[c, y, x + 1] = total


@kernel(inline="always")
def sum_at(row, x):
    """Interpolate cumulative sums between pixels: pixel i reaches from i - 0.5 to i + 0.5."""
    i = int(x + np.float32(0.5))
    return row[i] + (x + np.float32(0.5) - i) * (row[i + 1] - row[i])


@kernel(inline="always")
def value_at(row, x):
    """Interpolate the map itself from its cumulative sums: linear between pixel centres."""
    i = int(x)
    f = x - i
    return (1 - f) * (row[i + 1] - row[i]) + f * (row[i + 2] - row[i + 1])


@kernel(inline="always")
def value_between(sums, x, y, above):
    """Interpolate a map between its rows, of which `above` is the upper one."""
    return (above + 1 - y) * value_at(sums[above], x) + (y - above) * value_at(sums[above + 1], x)


@kernel(inline="always")
def border_sum_at(map_0, map_1, x, border):
    """Interpolate the cumulative sums of the maps that apply left of x, up to a constant."""
    cut, weight, split = border
    if split == 0:
        return weight * sum_at(map_0, x) + (1 - weight) * sum_at(map_1, x)
    on_left, on_right = (map_0, map_1) if split > 0 else (map_1, map_0)
    middle = min(max(np.float32(cut), np.float32(0)), np.float32(len(map_0) - 2.0))
    if x <= middle:
        return sum_at(on_left, x)
    return sum_at(on_left, middle) + sum_at(on_right, x) - sum_at(on_right, middle)


@kernel(inline="always")
def border_value_at(map_0, map_1, edge, border):
    """Interpolate the map that applies at an edge of a span."""
    cut, weight, split = border
    if split == 0:
        return weight * value_at(map_0, edge) + (1 - weight) * value_at(map_1, edge)
    return value_at(map_0, edge) if (edge < cut) == (split > 0) else value_at(map_1, edge)


@kernel(inline="always")
def contrast_at(contrast, class_0, class_1, edge, border):
    """Return the contrast of the map that applies at an edge of a span."""
    cut, weight, split = border
    if split == 0:
        return weight * contrast[class_0] + (1 - weight) * contrast[class_1]
    return contrast[class_0] if (edge < cut) == (split > 0) else contrast[class_1]


@kernel(is_inner=True)
def add_span(map_0, map_1, at, end, border, out):
    """Add the sums and the areas from `at` to `end` of a row of cumulative sums to out (2, 2)."""
    cut, weight, split = border
    if split == 0:
        if weight > 0:
            out[0, 0] += weight * (sum_at(map_0, end) - sum_at(map_0, at))
            out[0, 1] += weight * (end - at)
        if weight < 1:
            out[1, 0] += (1 - weight) * (sum_at(map_1, end) - sum_at(map_1, at))
            out[1, 1] += (1 - weight) * (end - at)
        return
    middle = min(max(np.float32(cut), at), end)
    i, j = (0, 1) if split > 0 else (1, 0)
    on_left, on_right = (map_0, map_1) if split > 0 else (map_1, map_0)
    out[i, 0] += sum_at(on_left, middle) - sum_at(on_left, at)
    out[i, 1] += middle - at
    out[j, 0] += sum_at(on_right, end) - sum_at(on_right, middle)
    out[j, 1] += end - middle


@kernel(is_inner=True)
def merge_span(taken_x, taken_by, taken, a, b, owner):
    """Merge a span into the ordered, disjoint ones taken so far, each end with its owner; return their number."""
    left_by, right_by, n = owner, owner, 0
    for k in range(taken):
        if taken_x[k, 1] < a or taken_x[k, 0] > b:
            _copy_span(taken_x, taken_by, n, k)
            n += 1
            continue
        if taken_x[k, 0] <= a:
            a, left_by = taken_x[k, 0], taken_by[k, 0]
        if taken_x[k, 1] >= b:
            b, right_by = taken_x[k, 1], taken_by[k, 1]
    if n == MOST_SPANS:
        return n
    k = n
    while k > 0 and taken_x[k - 1, 0] > a:
        _copy_span(taken_x, taken_by, k, k - 1)
        k -= 1
    taken_x[k, 0], taken_x[k, 1], taken_by[k, 0], taken_by[k, 1] = a, b, left_by, right_by
    return n + 1


@kernel(inline="always")
def _copy_span(taken_x, taken_by, to, k):
    for end in range(2):
        taken_x[to, end], taken_by[to, end] = taken_x[k, end], taken_by[k, end]
