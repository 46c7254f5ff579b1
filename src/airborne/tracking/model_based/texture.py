"""A person's texture: the skin cut into patches, each in the colour that the frames of a run show there.

A segment of one colour shows its rotation by its outline alone, and a skin's outline is not the person's. Borders of
clothes, hair, a face, a number on a shirt turn with the segment. They are learned from the poses that are known so far,
and the poses are fitted again with them, in turns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.appearance.lighting import shade_body
from airborne.body.shaping import length_axis
from airborne.geometry.robust import known_median
from airborne.rendering.shapes import new_shapes
from airborne.tracking.model_based.image_views import ImageView
from airborne.tracking.model_based.render_model import RenderModel
from airborne.types import Array, Array32

# chosen, of a patch: with 30 and 90 mm two synthetic people, whose clothes end within segments, are tracked alike
_SIZE_M = 0.05
_FEWEST_PX = 5  # chosen: of a patch in an image
_FEWEST_IMAGES = 3  # chosen, as a median needs: that show a patch; with fewer it keeps its cloth's colour
_DARKEST = 0.15  # chosen: light of a pixel that shows a colour; full light is 1


def cut_patches(render_model: RenderModel) -> RenderModel:
    """Return a body of meshes cut into patches, each in the colour of the part that it is of."""
    parts, patch_of = list[int](), np.empty(len(render_model.geometry.polygon_part), np.int64)
    flat = render_model.geometry
    middle = np.add.reduceat(flat.corners, flat.start[:-1]) / np.diff(flat.start)[:, None]
    for segment in np.unique(flat.polygon_segment):
        own = flat.polygon_segment == segment
        along = length_axis(render_model.model, render_model.model.segments[segment].name)
        cells = np.stack([flat.polygon_part[own], *_cells(middle[own], along)], axis=1)
        of_patch, number = np.unique(cells, axis=0, return_inverse=True)
        patch_of[own] = len(parts) + number.ravel()
        parts += of_patch[:, 0].tolist()
    geometry = flat._replace(polygon_part=patch_of, colours=flat.colours[parts])
    return replace(
        render_model,
        geometry=geometry,
        shapes=new_shapes(geometry),
        segment_of_part=render_model.segment_of_part[parts],
        albedo=render_model.albedo[parts],
        is_faceted=render_model.is_faceted[parts],
        cloth=np.array(parts, np.int16),
    )


def _cells(points_m: Array, along: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return which cell around a segment and along it each of its points (n, 3) lies in."""
    low_m, high_m = points_m.min(axis=0), points_m.max(axis=0)
    across = [axis for axis in range(3) if axis != along]
    u, v = ((points_m - (low_m + high_m) / 2) / (high_m - low_m))[:, across].T
    n_around = max(round(float(np.pi * (high_m - low_m)[across].mean()) / _SIZE_M), 4)
    n_along = max(round(float((high_m - low_m)[along]) / _SIZE_M), 1)
    around = np.floor((np.arctan2(v, u) / (2 * np.pi) + 0.5) * n_around).astype(int) % n_around
    share = (points_m[:, along] - low_m[along]) / (high_m - low_m)[along]
    return around, np.minimum((share * n_along).astype(int), n_along - 1)


def patch_colours(render_model: RenderModel, image: ImageView, shown: NDArray[np.bool_]) -> Array32:
    """Return the patches' albedo (patches, 3) in an image whose light was fitted; NaN where it does not show them.

    shown (segments,): those that surely lie where the pose has them. Pixels beside another segment or the scene are
    mixed, and do not count.
    """
    maps, observed, n = image.buffers.maps, image.buffers.observation.observed, len(render_model.albedo)
    owner = (np.where(maps.part >= 0, render_model.segment_of_part[maps.part], -1) + 1).astype(np.uint16)
    square, light = np.ones((3, 3), np.uint8), np.zeros_like(observed)
    shade_body(maps.part, maps.normals, np.ones_like(render_model.albedo), image.buffers.light, 0, 0, light)
    is_inner = (cv2.erode(owner, square) == cv2.dilate(owner, square)) & np.append(False, shown)[owner]
    is_inner &= light.min(axis=0) > _DARKEST
    patch = maps.part[is_inner]
    seen, own = (np.stack([np.bincount(patch, each[is_inner], n) for each in of], axis=1) for of in (observed, light))
    has_pixels = (np.bincount(patch, minlength=n) >= _FEWEST_PX)[:, None]
    return np.asarray(np.where(has_pixels, seen / np.where(has_pixels, own, 1), np.nan), np.float32)


def with_texture(render_model: RenderModel, colours: Sequence[Array32]) -> RenderModel:
    """Return the body with each patch in the median of its colours, (patches, 3) an image; few leave it as it is."""
    albedo = render_model.albedo.copy()
    stack = np.array(colours, np.float32).reshape(-1, *albedo.shape)
    is_seen = np.isfinite(stack[..., 0]).sum(axis=0) >= _FEWEST_IMAGES
    albedo[is_seen] = np.clip(known_median(stack[:, is_seen]), 1e-4, 1.5)
    return replace(render_model, albedo=albedo)
