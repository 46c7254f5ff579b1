"""Kernels: by how much each segment's absence would raise what an image costs."""

from __future__ import annotations

import numpy as np

from airborne.appearance.lighting import shade_body
from airborne.kernels import kernel
from airborne.rendering.layers import draw_layers
from airborne.rendering.rows import f4
from airborne.tracking.model_based.blur import RADIUS_PX, blur_planes
from airborne.tracking.model_based.owners import mask_box


@kernel(fastmath=True)
def absence_costs_in_fitted_light(body, projection, observation, comparison, paint, light, is_asked, rises):
    """Add to rises (s,) by how much the robust squared residuals grow without each segment that is asked for (s,).

    The residuals are those of `photometric_equations` in a light that was fitted (3, LIGHT_TERMS).
    """
    h, w = observation.certainty.shape
    part, segment = np.empty((2, h, w), np.int16), np.empty((2, h, w), np.int16)
    normals, lit = np.empty((2, 3, h, w), np.float32), np.empty((2, 3, h, w), np.float32)
    R, t, view = projection.R, projection.t, projection.packed_view
    draw_layers(body.shapes, body.geometry, R, t, view, None, f4(0), part, segment, normals)
    box = mask_box(part[0])
    x0, y0, x1, y1 = box
    for layer in range(2):
        shade_body(part[layer], normals[layer], paint.albedo, light, x0, y0, lit[layer, :, y0:y1, x0:x1])
    _add_rises(segment, lit, box, observation, comparison, is_asked, rises)


@kernel(fastmath=True)
def absence_costs_in_known_light(body, projection, observation, comparison, lamps, ambient, is_asked, rises):
    """Add to rises (s,) as `absence_costs_in_fitted_light`; residuals are those of `equations_of_known_light`."""
    h, w = observation.certainty.shape
    part, segment = np.empty((2, h, w), np.int16), np.empty((2, h, w), np.int16)
    lit = np.empty((2, 3, h, w), np.float32)
    R, t, view = projection.R, projection.t, projection.packed_view
    draw_layers(body.shapes, body.geometry, R, t, view, lamps, ambient, part, segment, lit)
    box = mask_box(part[0])
    for layer in range(2):
        for k in range(3):
            for y in range(box.y0, box.y1):
                for x in range(box.x0, box.x1):
                    lit[layer, k, y, x] = min(lit[layer, k, y, x] * f4(1 / 255), f4(1))
    _add_rises(segment, lit, box, observation, comparison, is_asked, rises)


@kernel(fastmath=True, is_inner=True)
def _add_rises(segment, lit, box, observation, comparison, is_asked, rises):
    """Add the rises by the layers' segments (2, h, w) and colours (2, 3, h, w), defined on them, in the body's box.

    Without a segment only its own pixels change, to what is behind them; the blur carries that RADIUS_PX further.
    """
    background, certainty, given = observation.background, observation.certainty, observation.rows
    c, h, w = background.shape
    left, top = max(box.x0 - RADIUS_PX, 0), max(box.y0 - RADIUS_PX, 0)
    height, width = min(box.y1 + RADIUS_PX, h) - top, min(box.x1 + RADIUS_PX, w) - left
    change, blurred = np.empty((c, height, width), np.float32), np.empty((c, height, width), np.float32)
    for k in range(c):
        for y in range(height):
            ours, behind, owner = lit[0, k, top + y], background[k, top + y], segment[0, top + y]
            for x in range(width):
                here = ours[left + x] - behind[left + x]
                change[k, y, x] = here if owner[left + x] >= 0 else f4(0)
    blur_planes(change, comparison.taps_u, comparison.taps_v, blurred)
    boxes = np.zeros((len(rises), 4), np.int64)
    _box_segments(segment[0], boxes)
    inverse_clip2, squares = f4(1 / comparison.clip**2), np.empty((2, w), np.float32)
    for e in range(len(rises)):
        if boxes[e, 2] == 0 or not is_asked[e]:
            continue
        x0, y0 = max(boxes[e, 0] - RADIUS_PX, 0), max(boxes[e, 1] - RADIUS_PX, 0)
        x1, y1 = min(boxes[e, 2] + RADIUS_PX, w), min(boxes[e, 3] + RADIUS_PX, h)
        away, spread = np.empty((c, y1 - y0, x1 - x0), np.float32), np.empty((c, y1 - y0, x1 - x0), np.float32)
        for k in range(c):
            for y in range(y0, y1):
                for x in range(x0, x1):
                    there = lit[1, k, y, x] if segment[1, y, x] >= 0 else background[k, y, x]
                    away[k, y - y0, x - x0] = there - lit[0, k, y, x] if segment[0, y, x] == e else f4(0)
        blur_planes(away, comparison.taps_u, comparison.taps_v, spread)
        total = 0.0
        for y in range(y0, y1):
            row, rise = given[y], f4(0)
            squares[:] = 0
            for k in range(c):
                for x in range(x1 - x0):
                    r = row[k, x0 + x] - blurred[k, y - top, x0 - left + x]
                    s = r - spread[k, y - y0, x]
                    squares[0, x] += r * r
                    squares[1, x] += s * s
            for x in range(x1 - x0):
                before, after = squares[0, x], squares[1, x]
                after /= f4(1) + after * inverse_clip2
                before /= f4(1) + before * inverse_clip2
                rise += certainty[y, x0 + x] * (after - before)
            total += rise
        rises[e] += total


@kernel(is_inner=True)
def _box_segments(segment, boxes):
    """Fill boxes (s, 4), zero before, with x0, y0, x1, y1 around each segment's pixels of a map (h, w)."""
    for y in range(segment.shape[0]):
        for x in range(segment.shape[1]):
            if segment[y, x] >= 0:
                box = boxes[segment[y, x]]
                if box[2] == 0:
                    box[0], box[1] = x, y
                box[0], box[2], box[3] = min(box[0], x), max(box[2], x + 1), y + 1
