"""Points that the cameras agree on: detections that belong to something else are left out, one by one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.cameras.camera import Rig
from airborne.types import Array

OUTLIER_SHARE = 0.01  # of a picture's longer side: a detection further off than this is of something else


@dataclass(frozen=True, slots=True, eq=False)
class Consensus:
    """Points as most cameras see them."""

    points: Array  # (..., 3) world [m]; NaN where fewer than two cameras agree
    distance_px: Array  # (..., cameras) from each detection to the point's projection [px]; NaN where not seen
    is_used: NDArray[np.bool_]  # (..., cameras)


def triangulate_consensus(rig: Rig, px: Array, weights: Array) -> Consensus:
    """Triangulate pixels (..., cameras, 2) [px], NaN where not seen, without the detections that do not fit.

    weights (..., cameras) as in `triangulate`. While a point's detections lie further from its projection than
    LIMIT_SHARE of the picture and over two cameras are left, the camera goes without which the others agree best.
    """
    shape = np.shape(px)[:-2]
    px, weights = np.reshape(px, (-1, len(rig), 2)).astype(float), np.reshape(weights, (-1, len(rig)))
    limit_px = OUTLIER_SHARE * np.array([max(camera.size) for camera in rig])
    used = np.isfinite(px).all(axis=-1) & (weights > 0)
    weights = np.where(used, weights, 1.0)
    points, distance = triangulate_views(rig, px, weights, used)
    for _ in range(len(rig) - 2):
        is_bad = ~np.all(~used | (distance <= limit_px), axis=1) & (used.sum(axis=1) > 2)
        if not is_bad.any():
            break
        rows = np.flatnonzero(is_bad)
        fewer = used[rows][:, None, :] & ~np.eye(len(rig), dtype=bool)  # (rows, the camera left out, cameras)
        _, left = triangulate_views(rig, px[rows][:, None], weights[rows][:, None], fewer)
        misfit = np.where(fewer, np.nan_to_num(left, nan=np.inf), 0.0).max(axis=-1)
        misfit = np.where(used[rows], misfit, np.inf)
        used[rows, np.argmin(misfit, axis=1)] = False
        points[rows], distance[rows] = triangulate_views(rig, px[rows], weights[rows], used[rows])
    is_agreed = np.all(~used | (distance <= limit_px), axis=1) & (used.sum(axis=1) >= 2)
    points = np.where(is_agreed[:, None], points, np.nan)
    distance = np.where(is_agreed[:, None], distance, np.nan)
    used &= is_agreed[:, None]
    return Consensus(points.reshape(*shape, 3), distance.reshape(*shape, len(rig)), used.reshape(*shape, len(rig)))


def triangulate_views(rig: Rig, px: Array, weights: Array, used: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return the points (..., 3) of the used views and every view's distance from them (..., cameras) [px]."""
    points = rig.points_from_px(np.where(used[..., None], px, np.nan), weights)
    projected = np.stack([camera.px_from_world(points) for camera in rig], axis=-2)
    return points, np.linalg.norm(px - projected, axis=-1)
