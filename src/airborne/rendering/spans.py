"""Kernels that turn outlines into spans: the runs of pixels that a shape covers in each row of the picture.

To a kernel of many arguments a call costs as much as a row: where rows are looped over, arrays are handed on, not the
tuples that hold them.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from airborne.kernels import kernel
from airborne.rendering.shapes import (
    B_1,
    B_U,
    B_V,
    BEND,
    CENTRE_HEIGHT,
    HALF_1,
    HALF_V,
    HALF_VV,
    HEIGHT,
    MID_1,
    MID_V,
    outline_all,
)


class Spans(NamedTuple):
    """The pixels of every shape in every row: those of row top + i are spans row_start[i] to row_stop[i] - 1."""

    top: Any  # first row of the picture that shows a shape
    row_start: Any  # (rows + 1,)
    row_stop: Any  # (rows,)
    ends: Any  # (spans, 3) first pixel, last pixel, shape
    curves: Any  # (spans, 2) the middle and the half width squared [px]


@kernel(fastmath=True, is_inner=True)
def _count_rows(shapes, top, row_start):
    """Fill `row_start` (rows + 1,) with room for a shape's spans in each row; return the number of spans."""
    for i in range(len(row_start)):
        row_start[i] = 0
    rows = shapes.rows
    for s in range(len(rows)):
        for v in range(rows[s, 0], rows[s, 1] + 1):
            row_start[v - top + 1] += 1
    for e in range(len(shapes.is_cut)):
        if shapes.is_cut[e]:
            for v in range(rows[e, 0], rows[e, 1] + 1):
                row_start[v - top + 1] += 1
    for i in range(1, len(row_start)):
        row_start[i] += row_start[i - 1]
    return row_start[-1]


@kernel(fastmath=True, is_inner=True)
def _find_spans(shapes, geometry, width, top, row_start, row_stop, ends, curves):
    """List the pixels of every shape in every row; see `Spans`."""
    for i in range(len(row_stop)):
        row_stop[i] = row_start[i]
    n_ellipsoids = len(geometry.ellipsoid_segment)
    for s in range(len(shapes.rows)):
        for v in range(shapes.rows[s, 0], shapes.rows[s, 1] + 1):
            if s >= n_ellipsoids:
                low, high = _cut_polygon(shapes.edges, geometry.start, s - n_ellipsoids, v, width)
                _add_span(low, high, 0.0, 0.0, s, v - top, row_stop, ends, curves)
                continue
            outline = shapes.outline[s]
            squared, middle, half = _curve_in_row(outline, v)
            if shapes.is_cut[s]:
                low, end, start, high = _cut_ellipsoid(outline, shapes.slab[s], v, middle, half, width)
                _add_span(low, end, middle, squared, s, v - top, row_stop, ends, curves)
                _add_span(start, high, middle, squared, s, v - top, row_stop, ends, curves)
            else:
                low, high = max(middle - half, 0.0), min(middle + half, width - 1.0)
                _add_span(low, high, middle, squared, s, v - top, row_stop, ends, curves)


@kernel(fastmath=True, is_inner=True)
def _add_span(low, high, middle, half_squared, s, row, row_stop, ends, curves):
    """List the pixels of a shape from `low` to `high`, where there are any."""
    if high < low:
        return
    first, last = math.ceil(low), math.floor(high)
    if last >= first:
        i = row_stop[row]
        ends[i, 0], ends[i, 1], ends[i, 2] = first, last, s
        curves[i, 0], curves[i, 1] = middle, half_squared
        row_stop[row] = i + 1


@kernel(fastmath=True, is_inner=True)
def sort_runs(shapes, geometry, v, width, firsts, lasts):
    """Fill in the first and last pixels of every shape's runs in row v, from the left; return how many there are.

    firsts, lasts: with room for two runs a shape.
    """
    n, n_ellipsoids = 0, len(geometry.ellipsoid_segment)
    for s in range(len(shapes.rows)):
        if v < shapes.rows[s, 0] or v > shapes.rows[s, 1]:
            continue
        if s >= n_ellipsoids:
            low, high = _cut_polygon(shapes.edges, geometry.start, s - n_ellipsoids, v, width)
            n = _insert_run(low, high, firsts, lasts, n)
            continue
        outline = shapes.outline[s]
        _, middle, half = _curve_in_row(outline, v)
        if shapes.is_cut[s]:
            low, end, start, high = _cut_ellipsoid(outline, shapes.slab[s], v, middle, half, width)
            n = _insert_run(low, end, firsts, lasts, n)
            n = _insert_run(start, high, firsts, lasts, n)
        else:
            n = _insert_run(max(middle - half, 0.0), min(middle + half, width - 1.0), firsts, lasts, n)
    return n


@kernel(fastmath=True, is_inner=True)
def _insert_run(low, high, firsts, lasts, n):
    """Insert the pixels from `low` to `high`, where there are any, among n runs: there are few."""
    if high < low:
        return n
    first, last = math.ceil(low), math.floor(high)
    if last < first:
        return n
    at = n
    while at > 0 and firsts[at - 1] > first:
        firsts[at], lasts[at] = firsts[at - 1], lasts[at - 1]
        at -= 1
    firsts[at], lasts[at] = first, last
    return n + 1


@kernel(fastmath=True, is_inner=True)
def _curve_in_row(outline, v):
    """Return half the width of an ellipsoid's outline in row v, squared, its middle, and half the width [px]."""
    squared = outline[HALF_1] + v * (outline[HALF_V] + v * outline[HALF_VV])
    return squared, outline[MID_V] * v + outline[MID_1], math.sqrt(max(squared, 0.0))


@kernel(fastmath=True, is_inner=True)
def _cut_ellipsoid(outline, slab, v, middle, half, width):
    """Return where row v shows an ellipsoid in a slab: from `low` to `end` and from `start` to `high` [px].

    A run that ends before it begins is none. There are at most two: in a row, each plane of the slab parts the near
    surface into one piece and the rest (`_beyond`), and the piece of the upper plane is above it only where that of
    the lower one is above it too. That leaves one piece, or one with a hole.
    """
    is_below_top, top_0, top_1 = _beyond(outline, slab[1], v, middle, half)
    is_below_foot, foot_0, foot_1 = _beyond(outline, slab[0], v, middle, half)
    low, high, hole_0, hole_1 = -half, half, half, -half
    if is_below_top:
        low, high = top_0, top_1
    else:
        hole_0, hole_1 = top_0, top_1
    if is_below_foot:
        hole_0, hole_1 = foot_0, foot_1
    else:
        low, high = max(low, foot_0), min(high, foot_1)
    low, high = max(middle + low, 0.0), min(middle + high, width - 1.0)
    if hole_1 < hole_0:
        return low, high, 1.0, 0.0
    return low, min(high, middle + hole_0), max(low, middle + hole_1), high


@kernel(fastmath=True, is_inner=True)
def _cut_polygon(edges, starts, p, v, width):
    """Return from where to where row v lies between the edges of polygon p [px]."""
    low, high = 0.0, width - 1.0
    for i in range(starts[p], starts[p + 1]):
        side, bound = edges[i, 0], edges[i, 1] * v + edges[i, 2]
        if side > 0:
            low = max(low, bound)
        elif side < 0:
            high = min(high, bound)
        elif bound < 0:
            high = -1.0
    return low, high


@kernel(fastmath=True, is_inner=True)
def _beyond(outline, height, v, middle, half):
    """Cut row v of an ellipsoid's near surface by the plane at a height: (is_below, low, high), u - middle [px].

    Between `low` and `high` the surface lies below the plane, or where not `is_below`, above it; high < low: nowhere.
    With d the plane's height over the camera, the surface is below it where L(x) < d S(x), L = m x + q being linear and
    S the root in the inverse depth. For d >= 0 that is where the convex L - d S is negative, between its two zeros,
    which are among those of L^2 - d^2 S^2; for d < 0 the same holds of -L and the side above.
    """
    d = height + outline[CENTRE_HEIGHT]
    m = outline[HEIGHT] - d * outline[B_U]
    q = outline[HEIGHT] * middle + outline[HEIGHT + 1] * v + outline[HEIGHT + 2]
    q -= d * (outline[B_U] * middle + outline[B_V] * v + outline[B_1])
    bend = d * d * outline[BEND]
    a, b, c = m * m + bend, m * q, q * q - bend * half * half
    discriminant = b * b - a * c
    sign = 1.0 if d >= 0 else -1.0
    is_in_first, is_in_last = sign * (q - m * half) < 0, sign * (q + m * half) < 0  # S is zero at the ends
    low, high = half, -half
    if is_in_first and is_in_last:
        low, high = -half, half
    elif is_in_first or is_in_last or (discriminant >= 0 and a > 1e-30):  # a = 0: a plane seen edge-on, along the row
        root = math.sqrt(max(discriminant, 0.0))
        low = -half if is_in_first else (-b - root) / a
        high = half if is_in_last else (-b + root) / a
    return d >= 0, low, high


@kernel(fastmath=True, is_inner=True)
def shown_rows(shapes, height):
    """Return the first and the last row that show a shape; the last is before the first where none does."""
    top, bottom = height, -1
    for s in range(len(shapes.rows)):
        if shapes.rows[s, 1] >= shapes.rows[s, 0]:
            top, bottom = min(top, shapes.rows[s, 0]), max(bottom, shapes.rows[s, 1])
    return top, bottom


@kernel(fastmath=True, is_inner=True)
def list_spans(shapes, geometry, view, width, height):
    """Outline the posed shapes in a view and list their spans."""
    outline_all(shapes, geometry, view, width, height)
    top, bottom = shown_rows(shapes, height)
    n_rows = max(bottom + 1 - top, 0)
    row_start, row_stop = np.empty(n_rows + 1, np.int64), np.empty(n_rows, np.int64)
    n_spans = _count_rows(shapes, top, row_start)
    ends, curves = np.empty((n_spans, 3), np.int64), np.empty((n_spans, 2))
    _find_spans(shapes, geometry, width, top, row_start, row_stop, ends, curves)
    return Spans(top, row_start, row_stop, ends, curves)
