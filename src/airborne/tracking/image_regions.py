"""Regions of interest: the part of each view that holds the body."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.appearance.model import Appearance, Region
from airborne.body import PosedBody, SurfaceArrays
from airborne.cameras import Camera
from airborne.kernels import kernel
from airborne.rendering.packing import pack_view, shift_view
from airborne.video import Frames, View

_ROUND_TO_PX = 8  # regions are whole multiples of the coarsest reduction


def crop_regions(
    bodies: Sequence[PosedBody],
    geometry: SurfaceArrays,
    frames: Frames,
    margin_px: float,
    appearance: Appearance | None = None,
) -> list[Region]:
    """Cut out the part of every view that holds the posed bodies and a margin; views that show none are left out.

    With an appearance, the regions are as bright as their backgrounds were when they were learned.
    """
    points = np.concatenate([bounding_points(body, geometry) for body in bodies])
    regions = [_region(view, points, margin_px) for view in frames.views if view is not None]
    known = [region for region in regions if region is not None]
    return known if appearance is None else [appearance.balance(region) for region in known]


def narrow_regions(
    regions: Sequence[Region], bodies: Sequence[PosedBody], geometry: SurfaceArrays, margin_px: float
) -> list[Region]:
    """Cut regions down to what holds the posed bodies and a margin; one that shows none stays as it is."""
    points = np.concatenate([bounding_points(body, geometry) for body in bodies])
    return [_narrow(region, points, margin_px) for region in regions]


@lru_cache(maxsize=2)  # frames are searched and then learned from
def reduce_frames(frames: Frames, body: PosedBody, most_px_per_m: float) -> Frames:
    """Average the images over squares of pixels until none shows the body at more than `most_px_per_m`.

    `body` gives its rough position; it must be the same for all frames of a recording.
    """
    return Frames(frames.index, frames.time_s, tuple(_reduce_view(view, body, most_px_per_m) for view in frames.views))


def _reduce_view(view: View | None, body: PosedBody, most_px_per_m: float) -> View | None:
    if view is None:
        return None
    x, y, z, offset = view.camera.camera_from_world.as_matrix()[2]
    depth_m = max(float(np.dot([x, y, z], body.t[0]) + offset), 0.1)
    n = round(view.camera.K[0, 0] / depth_m / most_px_per_m)
    if n < 2:
        return view
    width, height = view.camera.size[0] // n, view.camera.size[1] // n
    rgb = cv2.resize(view.rgb[: n * height, : n * width], (width, height), interpolation=cv2.INTER_AREA)
    middle = (n - 1) / 2
    camera = view.camera.resample(scale=(n, n), offset=(middle, middle), size=(width, height))
    return replace(view, camera=camera, image=np.asarray(rgb, np.uint8))


def share_in_view(body: PosedBody, geometry: SurfaceArrays, frames: Frames) -> float:
    """Return the largest share of the body, by its outermost points, that lies inside one view's image."""
    points = bounding_points(body, geometry)
    shares = [0.0]
    for view in frames.views:
        if view is not None:
            shares.append(_project(points, pack_view(view.camera), view.camera.K, *view.camera.size)[4])
    return max(shares)


def bounding_points(body: PosedBody, geometry: SurfaceArrays) -> NDArray:
    """Return world points (n, 3) [m] whose hull holds the body: corners, and the boxes around the ellipsoids."""
    return _bounding_points(geometry, np.ascontiguousarray(body.R, float), np.ascontiguousarray(body.t, float))


@kernel
def _bounding_points(geometry, R, t):
    n_corners, n_ellipsoids = len(geometry.corners), len(geometry.ellipsoid_segment)
    points, local = np.empty((n_corners + 8 * n_ellipsoids, 3)), np.empty(3)
    for p in range(len(geometry.polygon_segment)):
        for n in range(geometry.start[p], geometry.start[p + 1]):
            _place(R, t, geometry.polygon_segment[p], geometry.corners[n], points[n])
    for n in range(8 * n_ellipsoids):
        e, signs = n // 8, n % 8
        for i in range(3):
            local[i] = geometry.ellipsoid_centre[e, i]
        for axis in range(3):
            half = (
                geometry.ellipsoid_semi_axes[e, axis] if (signs >> axis) & 1 else -geometry.ellipsoid_semi_axes[e, axis]
            )
            for i in range(3):
                local[i] += geometry.ellipsoid_axes[e, i, axis] * half
        _place(R, t, geometry.ellipsoid_segment[e], local, points[n_corners + n])
    return points


@kernel(is_inner=True)
def _place(R, t, segment, local, point):
    for i in range(3):
        a, b, c = R[segment, i, 0], R[segment, i, 1], R[segment, i, 2]
        point[i] = t[segment, i] + a * local[0] + b * local[1] + c * local[2]


@kernel
def _project(points, view, K, width, height):
    """Return the box x0, y0, x1, y1 of world points (n, 3) in a packed view, and the share that lies in its image.

    Points behind the camera are left out; where all are, the box is empty.
    """
    x0, y0, x1, y1, n_inside = np.inf, np.inf, -np.inf, -np.inf, 0
    for n in range(len(points)):
        p, q, r = points[n, 0], points[n, 1], points[n, 2]
        x = view[0] * p + view[1] * q + view[2] * r + view[9]
        y = view[3] * p + view[4] * q + view[5] * r + view[10]
        z = view[6] * p + view[7] * q + view[8] * r + view[11]
        if z > 0:
            u, v = (K[0, 0] * x + K[0, 1] * y) / z + K[0, 2], (K[1, 0] * x + K[1, 1] * y) / z + K[1, 2]
            x0, y0, x1, y1 = min(x0, u), min(y0, v), max(x1, u), max(y1, v)
            n_inside += 0 <= u < width and 0 <= v < height
    return x0, y0, x1, y1, n_inside / len(points)


def _region(view: View, points: NDArray, margin_px: float) -> Region | None:
    camera, packed = view.camera, pack_view(view.camera)
    box = _box(points, packed, camera, margin_px)
    if box is None:
        return None
    x0, y0, x1, y1 = box
    width, height = ((end - begin) // _ROUND_TO_PX * _ROUND_TO_PX for begin, end in ((x0, x1), (y0, y1)))
    if min(width, height) < 2 * _ROUND_TO_PX:
        return None
    return Region(
        camera=camera.resample(scale=(1, 1), offset=(x0, y0), size=(width, height)),
        corner=(x0, y0),
        rgb=np.ascontiguousarray(view.crop((x0, y0, x0 + width, y0 + height))),
        view=view,
        source=(camera.name, camera.K.tobytes()),
        packed_view=shift_view(packed, x0, y0),
    )


def _narrow(region: Region, points: NDArray, margin_px: float) -> Region:
    box = _box(points, region.packed_view, region.camera, margin_px)
    if box is None or min(box[2] - box[0], box[3] - box[1]) < 2 * _ROUND_TO_PX:
        return region
    x0, y0, x1, y1 = box
    return replace(
        region,
        camera=region.camera.resample(scale=(1, 1), offset=(x0, y0), size=(x1 - x0, y1 - y0)),
        corner=(region.corner[0] + x0, region.corner[1] + y0),
        rgb=np.ascontiguousarray(region.rgb[y0:y1, x0:x1]),
        packed_view=shift_view(region.packed_view, x0, y0),
    )


def _box(
    points: NDArray, packed: NDArray[np.float64], camera: Camera, margin_px: float
) -> tuple[int, int, int, int] | None:
    """Return the part x0 <= x < x1, y0 <= y < y1 of an image that holds points and a margin; None if all are behind."""
    left, top, right, bottom, _ = _project(points, packed, camera.K, *camera.size)
    if left > right:
        return None
    margin_v = margin_px * camera.K[1, 1] / camera.K[0, 0]
    x0, x1 = _span(left - margin_px, right + margin_px, camera.size[0])
    y0, y1 = _span(top - margin_v, bottom + margin_v, camera.size[1])
    return x0, y0, x1, y1


def _span(low: float, high: float, size: int) -> tuple[int, int]:
    """Return the whole pixels from low up to high that an image of this size has: the first, and one past the last."""
    return math.floor(min(max(low, 0), size)), math.ceil(min(max(high + 1, 0), size))
