"""Gauss-Newton kernels: residuals between blurred observed and rendered images, and their derivatives by the pose.

Each adds one view's equations to `sums` and `blocks`; see `add_rows` for them and for what is returned, and
`kernel_arguments` for what goes in. Planes are float32. A blurred mask is zero beyond the blur's radius, so only the
box around the body is drawn, blurred and compared; the rest of the image costs what it would without a body.
"""

from __future__ import annotations

import numpy as np

from airborne.appearance.lighting import LIGHT_TERMS, fit_light, flatten_shading, shade_body
from airborne.kernels import kernel
from airborne.rendering.maps import surface_maps
from airborne.rendering.rows import LANES
from airborne.tracking.model_based.blur import RADIUS_PX, blur_planes
from airborne.tracking.model_based.kernel_arguments import Comparison, Observation, Paint
from airborne.tracking.model_based.owners import find_owners, mask_box
from airborne.tracking.model_based.row_equations import add_rows
from airborne.types import Array

# of one kernel with the images, so that what they share is compiled once
MASK = (
    Paint(np.zeros((0, 3), np.float32), np.zeros(0, np.bool_), np.zeros(0, np.int16)),
    np.zeros((3, LIGHT_TERMS), np.float32),
    0,
)


def prepare_rows(observed: Array, background: Array, certainty: Array, comparison: Comparison) -> Observation:
    """Prepare a view's image for a comparison: (c, H, W) each, certainty (H, W).

    Each of its `rows` holds the channels' differences from the background, blurred, the channels of the background,
    the certainty, and the robust squared residual where no body is, with room for LANES pixels after the last.
    """
    c, h, w = observed.shape
    rows = np.empty((h, 2 * c + 2, w + LANES), np.float32)
    taps, inverse_clip2 = (comparison.taps_u, comparison.taps_v), np.float32(1 / comparison.clip**2)
    _fill_rows(observed, background, certainty, *taps, inverse_clip2, rows)
    return Observation(observed, background, certainty, rows)


@kernel(fastmath=True)
def _fill_rows(observed, background, certainty, taps_u, taps_v, inverse_clip2, rows):
    c, h, w = observed.shape
    sharp, blurred = np.empty(observed.shape, np.float32), np.empty(observed.shape, np.float32)
    for k in range(c):
        for y in range(h):
            for x in range(w):
                sharp[k, y, x] = observed[k, y, x] - background[k, y, x]
    blur_planes(sharp, taps_u, taps_v, blurred)
    for y in range(h):
        cost = rows[y, 2 * c + 1]
        for x in range(w):
            cost[x] = 0
        for k in range(2 * c + 2):
            for x in range(w, w + LANES):
                rows[y, k, x] = 0
        for k in range(c):
            for x in range(w):
                rows[y, k, x] = blurred[k, y, x]
                rows[y, c + k, x] = background[k, y, x]
                cost[x] += blurred[k, y, x] * blurred[k, y, x]
        for x in range(w):
            rows[y, 2 * c, x] = certainty[y, x]
            cost[x] *= certainty[y, x] / (np.float32(1) + cost[x] * inverse_clip2)


@kernel(fastmath=True)
def photometric_equations(body, projection, observation, comparison, maps, paint, light, iterations, sums, blocks):
    """Add one view's equations of `blurred observed - blurred composite`, in linear light.

    light (3, LIGHT_TERMS): the view's fitted light, refitted in place by `iterations` of reweighting. With `MASK` in
    the place of paint, light and iterations, the equations of `blurred posterior - blurred mask`: the observed plane is
    the posterior (1, H, W), each pixel's probability to be body; the background is black.
    """
    R, t, view = projection.R, projection.t, projection.packed_view
    surface_maps(body.shapes, body.geometry, R, t, view, maps.part, maps.inverse_depth, maps.normals)
    box, lit = mask_box(maps.part), np.empty((0, 1, 1), np.float32)
    if len(paint.albedo):
        x0, y0, x1, y1 = box
        of_body = maps.part, maps.normals, paint.albedo, paint.cloth
        fit_light(observation.observed, *of_body, light, iterations, x0, y0, x1, y1)
        lit = np.empty(maps.normals.shape, np.float32)
        shade_body(maps.part, maps.normals, paint.albedo, light, x0, y0, lit[:, y0:y1, x0:x1])
    owner, nearness = _owners(body, len(sums.A), maps, box)
    flat = _flatten(lit, maps.part, paint, box)
    return add_rows(lit, flat, maps, owner, nearness, projection, observation, comparison, sums, blocks)


@kernel(fastmath=True)
def equations_of_known_light(body, projection, observation, comparison, maps, paint, lamps, ambient, sums, blocks):
    """Add one view's equations under known lights, in shares of full sRGB; lamps (l, 8), ambient as in `draw_maps`."""
    lit, box = light_by_lamps(body, projection, maps, lamps, ambient), mask_box(maps.part)
    owner, nearness = _owners(body, len(sums.A), maps, box)
    flat = _flatten(lit, maps.part, paint, box)
    return add_rows(lit, flat, maps, owner, nearness, projection, observation, comparison, sums, blocks)


@kernel(fastmath=True)
def light_fitted(body, projection, maps, paint, light):
    """Draw a view in a fitted light (3, LIGHT_TERMS), filling its maps; return the body's colours (3, h, w)."""
    R, t, view = projection.R, projection.t, projection.packed_view
    surface_maps(body.shapes, body.geometry, R, t, view, maps.part, maps.inverse_depth, maps.normals)
    lit = np.empty(maps.normals.shape, np.float32)
    shade_body(maps.part, maps.normals, paint.albedo, light, 0, 0, lit)
    return lit


@kernel(fastmath=True)
def light_by_lamps(body, projection, maps, lamps, ambient):
    """Draw a view under known lights, filling its maps; return the body's colours (3, h, w), full being 1."""
    R, t, view, (h, w) = projection.R, projection.t, projection.packed_view, maps.part.shape
    lit = np.empty((3, h, w), np.float32)
    surface_maps(body.shapes, body.geometry, R, t, view, maps.part, maps.inverse_depth, lit, lamps, np.float32(ambient))
    for k in range(3):
        for y in range(h):
            for x in range(w):
                lit[k, y, x] = min(lit[k, y, x] * np.float32(1 / 255), np.float32(1))
    return lit


@kernel(fastmath=True, is_inner=True)
def _owners(body, n_segments, maps, box):
    """Return the segment that owns each pixel that the body may move, and its inverse depth, (0, 0) of one segment."""
    h, w = maps.part.shape if n_segments > 1 else (0, 0)
    owner, nearness = np.empty((h, w), np.int16), np.empty((h, w), np.float32)
    if h > 0 and box.x1 > 0:
        x0, y0 = max(box.x0 - RADIUS_PX, 0), max(box.y0 - RADIUS_PX, 0)
        x1, y1 = min(box.x1 + RADIUS_PX, w), min(box.y1 + RADIUS_PX, h)
        part, inverse_depth = maps.part[y0:y1, x0:x1], maps.inverse_depth[y0:y1, x0:x1]
        find_owners(part, inverse_depth, body.segment_of_part, owner[y0:y1, x0:x1], nearness[y0:y1, x0:x1])
    return owner, nearness


@kernel(fastmath=True, is_inner=True)
def _flatten(lit, part, paint, box):
    """Return the lit body's colours (c, H, W) as they move with it."""
    flat = lit
    if not paint.is_faceted.all():
        x0, y0, x1, y1 = box
        flat = np.empty_like(lit)
        for k in range(len(lit)):
            for y in range(y0, y1):
                for x in range(x0, x1):
                    flat[k, y, x] = lit[k, y, x]
        flatten_shading(part[y0:y1, x0:x1], paint.albedo, paint.is_faceted, paint.cloth, flat[:, y0:y1, x0:x1])
    return flat
