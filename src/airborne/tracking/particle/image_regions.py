"""The region of each camera's image around a player: the only pixels that are read."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from airborne.cameras import Camera
from airborne.types import Array
from airborne.video import Frames, View

_MARGIN_M = 0.15  # around the hypotheses' points
LEARNING_MARGIN_M = 0.5  # around the first frame's points: enough background to learn from
_REACH_M = 1.3  # hypotheses further from their mean are ignored
_DARK_GREY, _DARK_SHARE = 16, 0.05  # a region with a smaller share of pixels this bright counts as dark


@dataclass(frozen=True, slots=True, eq=False)
class ImageRegion:
    """A crop of one camera's image."""

    rgb: NDArray[np.uint8]  # (h, w, 3)
    corner: Array  # (2,) x, y of its first pixel [px]
    projection: Array  # (3, 4) px from world, of the whole image
    focal_px: float


def region_of(view: View | None, points: Array, margin_m: float = _MARGIN_M) -> ImageRegion | None:
    """Crop the image around points (n, 3) [m]; None without an image, in the dark, or outside it."""
    if view is None:
        return None
    projection = projection_of(view.camera)
    box = _box(projection, view.camera, points, margin_m)
    if box is None:
        return None
    rgb = np.ascontiguousarray(view.crop(box))
    if np.mean(rgb[::8, ::8].max(axis=-1) >= _DARK_GREY) < _DARK_SHARE:
        return None
    return ImageRegion(rgb, np.array(box[:2], float), projection, float(view.camera.K[0, 0]))


@lru_cache(maxsize=64)
def projection_of(camera: Camera) -> Array:
    """Return a camera's projection matrix (3, 4), computed once per camera."""
    return camera.P


@lru_cache(maxsize=64)
def centre_of(camera: Camera) -> Array:
    """Return a camera's centre (3,) [m], computed once per camera."""
    return camera.centre


def regions_of(frames: Frames, points: Array, margin_m: float = _MARGIN_M) -> list[ImageRegion | None]:
    """Crop every camera's image around the points (n, 3)."""
    return [region_of(view, points, margin_m) for view in frames.views]


def _box(projection: Array, camera: Camera, points: Array, margin_m: float) -> tuple[int, int, int, int] | None:
    px, depth_m = _project_in_front(projection, points)
    if not len(px):
        return None
    middle, px_per_m = px.mean(axis=0), camera.K[0, 0] / depth_m.mean()
    low = np.maximum(px.min(axis=0) - margin_m * px_per_m, middle - _REACH_M * px_per_m)
    high = np.minimum(px.max(axis=0) + margin_m * px_per_m, middle + _REACH_M * px_per_m)
    x0, y0 = np.maximum(np.floor(low).astype(int), 0)
    x1, y1 = np.minimum(np.ceil(high).astype(int) + 1, camera.size)
    return (int(x0), int(y0), int(x1), int(y1)) if x0 < x1 and y0 < y1 else None


def _project_in_front(projection: Array, points: Array) -> tuple[Array, Array]:
    """Project those of points (n, 3) that lie in front of the camera: pixels (m, 2) and depths (m,) [m]."""
    uvw = points @ projection[:, :3].T + projection[:, 3]
    uvw = uvw[uvw[:, 2] > 0]
    return uvw[:, :2] / uvw[:, 2:], uvw[:, 2]


def is_in_image(frames: Frames, points: Array) -> NDArray[np.bool_]:
    """Return which cameras have an image with at least half of the points (n, 3) in it: (views,)."""
    return np.array([view is not None and _share_inside(view.camera, points) >= 0.5 for view in frames.views])


def _share_inside(camera: Camera, points: Array) -> float:
    px, _ = _project_in_front(projection_of(camera), points)
    return float(np.count_nonzero(np.all((px >= 0) & (px <= np.array(camera.size) - 1), axis=-1)) / len(points))
