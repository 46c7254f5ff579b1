"""Gauss-Newton kernels: residuals between blurred observed and rendered images, and their derivatives by the pose.

Each adds one view's equations to `sums` and `blocks`; see `accumulate` for them and for what is returned, and
`kernel_arguments` for what goes in. Planes are float32; (h, w) is the size of the window that is compared.
"""

from __future__ import annotations

import numpy as np

from airborne.appearance.lighting import fit_light, flatten_shading, shade_body
from airborne.kernels import kernel
from airborne.rendering.drawing import draw_maps
from airborne.rendering.maps import surface_maps
from airborne.tracking.model_based.blur import blur_planes
from airborne.tracking.model_based.owners import find_owners
from airborne.tracking.model_based.twist_equations import accumulate


@kernel(fastmath=True)
def silhouette_equations(body, projection, observation, comparison, maps, sums, blocks):
    """Add one view's equations of `blurred posterior - blurred mask`.

    The observed plane is the posterior (1, H, W), each pixel's probability to be body; the background is black.
    """
    x0, y0, x1, y1 = comparison.window
    owner, nearness = _draw(body, projection, maps, comparison.window)
    residual = np.empty((1, y1 - y0, x1 - x0), np.float32)
    blur_planes(observation.observed[:, y0:y1, x0:x1], comparison.taps_u, comparison.taps_v, residual)
    _, coverage = _mask_coverage(maps.part, comparison)
    shape = np.empty_like(residual)
    for y in range(y1 - y0):
        for x in range(x1 - x0):
            shape[0, y, x] = np.float32(0.5) * (residual[0, y, x] + coverage[0, y, x])
            residual[0, y, x] -= coverage[0, y, x]
    return accumulate(residual, shape, coverage[0], owner, nearness, projection, observation, comparison, sums, blocks)


@kernel(fastmath=True)
def photometric_equations(body, projection, observation, comparison, maps, paint, light, iterations, sums, blocks):
    """Add one view's equations of `blurred observed - blurred composite`, in linear light.

    light (3, LIGHT_TERMS): the view's fitted light, refitted in place by `iterations` of reweighting.
    """
    x0, y0, x1, y1 = comparison.window
    owner, nearness = _draw(body, projection, maps, comparison.window)
    fit_light(observation.observed, maps.part, maps.normals, paint.albedo, light, iterations, x0, y0, x1, y1)
    lit = np.zeros((3, y1 - y0, x1 - x0), np.float32)
    shade_body(maps.part, maps.normals, paint.albedo, light, x0, y0, lit)
    return _composite_equations(
        lit, paint.is_faceted, maps.part, owner, nearness, projection, observation, comparison, sums, blocks
    )


@kernel(fastmath=True)
def equations_of_known_light(body, projection, observation, comparison, maps, is_faceted, lamps, ambient, sums, blocks):
    """Add one view's equations under known lights, in shares of full sRGB; lamps (l, 8), ambient as in `draw_maps`."""
    x0, y0, x1, y1 = comparison.window
    owner, nearness = _draw(body, projection, maps, comparison.window)
    shape = maps.part.shape
    part, segment = np.empty(shape, np.int16), np.empty(shape, np.int16)
    inverse_depth, colour = np.empty(shape, np.float32), np.zeros((shape[0], shape[1], 3), np.float32)
    R, t, view = projection.R, projection.t, projection.packed_view
    draw_maps(body.shapes, body.geometry, R, t, view, lamps, ambient, part, segment, inverse_depth, colour)
    lit = np.empty((3, y1 - y0, x1 - x0), np.float32)
    for k in range(3):
        for y in range(y1 - y0):
            for x in range(x1 - x0):
                lit[k, y, x] = min(colour[y + y0, x + x0, k] * np.float32(1 / 255), np.float32(1))
    return _composite_equations(
        lit, is_faceted, maps.part, owner, nearness, projection, observation, comparison, sums, blocks
    )


@kernel(fastmath=True)
def _draw(body, projection, maps, window):
    """Draw the maps of a view; return the segment that owns each pixel of the window, and its inverse depth."""
    R, t, view = projection.R, projection.t, projection.packed_view
    surface_maps(body.shapes, body.geometry, R, t, view, maps.part, maps.inverse_depth, maps.normals)
    x0, y0, x1, y1 = window
    owner, nearness = np.empty((y1 - y0, x1 - x0), np.int16), np.empty((y1 - y0, x1 - x0), np.float32)
    find_owners(maps.part, maps.inverse_depth, body.segment_of_part, x0, y0, owner, nearness)
    return owner, nearness


@kernel(fastmath=True)
def _mask_coverage(part, comparison):
    """Return the mask in the window, 0 or 1, and the same blurred: (1, h, w) each."""
    x0, y0, x1, y1 = comparison.window
    mask, coverage = np.empty((1, y1 - y0, x1 - x0), np.float32), np.empty((1, y1 - y0, x1 - x0), np.float32)
    for y in range(y1 - y0):
        for x in range(x1 - x0):
            mask[0, y, x] = 1.0 if part[y + y0, x + x0] >= 0 else 0.0
    blur_planes(mask, comparison.taps_u, comparison.taps_v, coverage)
    return mask, coverage


@kernel(fastmath=True)
def _composite_equations(lit, is_faceted, part, owner, nearness, projection, observation, comparison, sums, blocks):
    """Compare the image with the lit body (3, h, w) in front of the background."""
    observed, background = observation.observed, observation.background
    taps_u, taps_v = comparison.taps_u, comparison.taps_v
    x0, y0 = comparison.window.x0, comparison.window.y0
    mask, coverage = _mask_coverage(part, comparison)
    sharp, residual = np.empty_like(lit), np.empty_like(lit)
    for k in range(3):
        for y in range(lit.shape[1]):
            for x in range(lit.shape[2]):  # by the mask's 0 or 1, without a branch: several pixels at a time
                behind = background[k, y + y0, x + x0]
                sharp[k, y, x] = observed[k, y + y0, x + x0] - behind - mask[0, y, x] * (lit[k, y, x] - behind)
    blur_planes(sharp, taps_u, taps_v, residual)
    if not is_faceted.all():
        flatten_shading(part, is_faceted, x0, y0, lit)
    shape = sharp
    blur_planes(lit, taps_u, taps_v, shape)
    return accumulate(residual, shape, coverage[0], owner, nearness, projection, observation, comparison, sums, blocks)
