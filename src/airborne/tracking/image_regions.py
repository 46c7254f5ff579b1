"""Regions of interest: the part of each view that holds the body."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.appearance.model import Region
from airborne.body import PosedBody, SurfaceArrays
from airborne.rendering.packing import pack_view, shift_view
from airborne.video import Frames, View

_ROUND_TO_PX = 8  # regions are whole multiples of the coarsest reduction


def crop_regions(
    bodies: Sequence[PosedBody], geometry: SurfaceArrays, frames: Frames, margin_px: float
) -> list[Region]:
    """Cut out the part of every view that holds the posed bodies and a margin; views that show none are left out."""
    points = np.concatenate([bounding_points(body, geometry) for body in bodies])
    regions = [_region(view, points, margin_px) for view in frames.views if view is not None]
    return [region for region in regions if region is not None]


def reduce_frames(frames: Frames, body: PosedBody, most_px_per_m: float) -> Frames:
    """Average the images over squares of pixels until none shows the body at more than `most_px_per_m`.

    `body` gives its rough position; it must be the same for all frames of a recording.
    """
    return Frames(frames.index, frames.time_s, tuple(_reduce_view(view, body, most_px_per_m) for view in frames.views))


def _reduce_view(view: View | None, body: PosedBody, most_px_per_m: float) -> View | None:
    if view is None:
        return None
    depth_m = max(float(view.camera.camera_from_world.apply(body.t[0])[2]), 0.1)
    n = round(view.camera.K[0, 0] / depth_m / most_px_per_m)
    if n < 2:
        return view
    width, height = view.camera.size[0] // n, view.camera.size[1] // n
    rgb = cv2.resize(view.rgb[: n * height, : n * width], (width, height), interpolation=cv2.INTER_AREA)
    middle = (n - 1) / 2
    camera = view.camera.resample(scale=(n, n), offset=(middle, middle), size=(width, height))
    return View(camera, np.asarray(rgb, np.uint8), view.delay_s)


def share_in_view(body: PosedBody, geometry: SurfaceArrays, frames: Frames) -> float:
    """Return the largest share of the body, by its outermost points, that lies inside one view's image."""
    points = bounding_points(body, geometry)
    shares = [0.0]
    for view in frames.views:
        if view is not None:
            px = view.camera.px_from_world(points)
            with np.errstate(invalid="ignore"):
                shares.append(float(np.mean(np.all((px >= 0) & (px < view.camera.size), axis=1))))
    return max(shares)


def bounding_points(body: PosedBody, geometry: SurfaceArrays) -> NDArray:
    """Return world points (n, 3) [m] whose hull holds the body: corners, and the boxes around the ellipsoids."""
    segments = geometry.polygon_segment.repeat(np.diff(geometry.start))
    corners = np.einsum("nij,nj->ni", body.R[segments], geometry.corners) + body.t[segments]
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8)
    boxes = (geometry.ellipsoid_axes * geometry.ellipsoid_semi_axes[:, None]) @ signs
    local = geometry.ellipsoid_centre[:, None] + boxes.transpose(0, 2, 1)
    owner = geometry.ellipsoid_segment
    box_corners = np.einsum("nij,nkj->nki", body.R[owner], local) + body.t[owner][:, None]
    return np.concatenate([corners, box_corners.reshape(-1, 3)])


def _region(view: View, points: NDArray, margin_px: float) -> Region | None:
    camera, packed = view.camera, pack_view(view.camera)
    xyz = points @ packed[:9].reshape(3, 3).T + packed[9:12]
    xyz = xyz[xyz[:, 2] > 0]
    if not len(xyz):
        return None
    px = (xyz[:, :2] / xyz[:, 2:]) @ camera.K[:2, :2].T + camera.K[:2, 2]
    margin = margin_px * np.array([1, camera.K[1, 1] / camera.K[0, 0]])
    size = np.array(camera.size)
    low = np.clip(np.floor(px.min(axis=0) - margin), 0, size).astype(int)
    high = np.clip(np.ceil(px.max(axis=0) + margin) + 1, 0, size).astype(int)
    width, height = (high - low) // _ROUND_TO_PX * _ROUND_TO_PX
    if min(width, height) < 2 * _ROUND_TO_PX:
        return None
    x0, y0 = int(low[0]), int(low[1])
    own = camera.resample(scale=(1, 1), offset=(x0, y0), size=(int(width), int(height)))
    return Region(
        camera=own,
        corner=(x0, y0),
        rgb=np.ascontiguousarray(view.rgb[y0 : y0 + height, x0 : x0 + width]),
        view_rgb=view.rgb,
        source=(camera.name, camera.K.tobytes()),
        packed_view=shift_view(packed, x0, y0),
    )
