"""The part of each camera's picture round a player: all that is read of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from airborne.cameras import Camera
from airborne.video import Frames, View

Array = NDArray[np.floating]

MARGIN_M = 0.15  # round the hypotheses' points
LEARNING_MARGIN_M = 0.5  # round the first frame's: enough of what is not the player
REACH_M = 1.3  # no hypothesis further from their mean is looked at
DARK_GREY, DARK_SHARE = 16, 0.05  # a region with less than this share of pixels so bright shows nothing


@dataclass(frozen=True, slots=True, eq=False)
class Region:
    """The part of one camera's picture that is looked at."""

    rgb: NDArray[np.uint8]  # (h, w, 3)
    corner: Array  # (2,) x, y of its first pixel [px]
    projection: Array  # (3, 4) px from world, of the whole picture
    focal_px: float


def region_of(view: View | None, points: Array, margin_m: float = MARGIN_M) -> Region | None:
    """Cut out of a picture what surrounds points (n, 3) [m]; None without a picture, in the dark, or outside."""
    if view is None:
        return None
    projection = projection_of(view.camera)
    box = _box(projection, view.camera, points, margin_m)
    if box is None:
        return None
    rgb = np.ascontiguousarray(view.crop(box))
    if np.mean(rgb[::8, ::8].max(axis=-1) >= DARK_GREY) < DARK_SHARE:
        return None
    return Region(rgb, np.array(box[:2], float), projection, float(view.camera.K[0, 0]))


@lru_cache(maxsize=64)
def projection_of(camera: Camera) -> Array:
    """Return a camera's projection matrix (3, 4), worked out once for each camera."""
    return camera.P


@lru_cache(maxsize=64)
def centre_of(camera: Camera) -> Array:
    """Return a camera's place (3,) [m], worked out once for each camera."""
    return camera.centre


def regions_of(frames: Frames, points: Array, margin_m: float = MARGIN_M) -> list[Region | None]:
    """Cut the regions round the points (n, 3) out of all cameras' pictures."""
    return [region_of(view, points, margin_m) for view in frames.views]


def _box(projection: Array, camera: Camera, points: Array, margin_m: float) -> tuple[int, int, int, int] | None:
    px, depth_m = _seen(projection, points)
    if not len(px):
        return None
    middle, px_per_m = px.mean(axis=0), camera.K[0, 0] / depth_m.mean()
    low = np.maximum(px.min(axis=0) - margin_m * px_per_m, middle - REACH_M * px_per_m)
    high = np.minimum(px.max(axis=0) + margin_m * px_per_m, middle + REACH_M * px_per_m)
    x0, y0 = np.maximum(np.floor(low).astype(int), 0)
    x1, y1 = np.minimum(np.ceil(high).astype(int) + 1, camera.size)
    return (int(x0), int(y0), int(x1), int(y1)) if x0 < x1 and y0 < y1 else None


def _seen(projection: Array, points: Array) -> tuple[Array, Array]:
    """Return pixels (m, 2) and depths (m,) [m] of those points (n, 3) that lie before the camera."""
    uvw = points @ projection[:, :3].T + projection[:, 3]
    uvw = uvw[uvw[:, 2] > 0]
    return uvw[:, :2] / uvw[:, 2:], uvw[:, 2]


def in_picture(frames: Frames, points: Array) -> NDArray[np.bool_]:
    """Say which cameras have a picture with at least half of the points (n, 3) in it: (views,)."""
    return np.array([view is not None and _share_inside(view.camera, points) >= 0.5 for view in frames.views])


def _share_inside(camera: Camera, points: Array) -> float:
    px, _ = _seen(projection_of(camera), points)
    return float(np.count_nonzero(np.all((px >= 0) & (px <= np.array(camera.size) - 1), axis=-1)) / len(points))
