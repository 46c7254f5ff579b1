"""Consensus triangulation: outlier views are dropped one by one until the others agree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.cameras.camera import Rig
from airborne.types import Array

OUTLIER_SHARE = 0.01  # of an image's longer side: a detection further off than this is an outlier


@dataclass(frozen=True, slots=True, eq=False)
class Consensus:
    """Points triangulated from the views that agree."""

    points: Array  # (..., 3) world [m]; NaN where fewer than two cameras agree
    distance_px: Array  # (..., cameras) from each detection to the point's projection [px]; NaN where not seen
    is_used: NDArray[np.bool_]  # (..., cameras)


def triangulate_consensus(rig: Rig, px: Array, weights: Array) -> Consensus:
    """Triangulate pixels (..., cameras, 2) [px], NaN where not seen, without outlier views.

    weights (..., cameras) as in `triangulate`. While a point's detections lie further from its projection than
    OUTLIER_SHARE of the image and over two views are left, the view is dropped without which the others agree best.
    """
    shape = np.shape(px)[:-2]
    px, weights = np.reshape(px, (-1, len(rig), 2)).astype(float), np.reshape(weights, (-1, len(rig)))
    limit_px = OUTLIER_SHARE * np.array([max(camera.size) for camera in rig])
    is_used = np.isfinite(px).all(axis=-1) & (weights > 0)
    weights = np.where(is_used, weights, 1.0)
    points, distance = triangulate_views(rig, px, weights, is_used)
    for _ in range(len(rig) - 2):
        is_bad = ~np.all(~is_used | (distance <= limit_px), axis=1) & (is_used.sum(axis=1) > 2)
        if not is_bad.any():
            break
        rows = np.flatnonzero(is_bad)
        fewer = is_used[rows][:, None, :] & ~np.eye(len(rig), dtype=bool)  # (rows, the camera left out, cameras)
        _, distance_left = triangulate_views(rig, px[rows][:, None], weights[rows][:, None], fewer)
        misfit = np.where(fewer, np.nan_to_num(distance_left, nan=np.inf), 0.0).max(axis=-1)
        misfit = np.where(is_used[rows], misfit, np.inf)
        is_used[rows, np.argmin(misfit, axis=1)] = False
        points[rows], distance[rows] = triangulate_views(rig, px[rows], weights[rows], is_used[rows])
    is_agreed = np.all(~is_used | (distance <= limit_px), axis=1) & (is_used.sum(axis=1) >= 2)
    points = np.where(is_agreed[:, None], points, np.nan)
    distance = np.where(is_agreed[:, None], distance, np.nan)
    is_used &= is_agreed[:, None]
    return Consensus(points.reshape(*shape, 3), distance.reshape(*shape, len(rig)), is_used.reshape(*shape, len(rig)))


def triangulate_views(rig: Rig, px: Array, weights: Array, is_used: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return the points (..., 3) of the used views and every view's distance from them (..., cameras) [px]."""
    points = rig.points_from_px(np.where(is_used[..., None], px, np.nan), weights)
    projected = np.stack([camera.px_from_world(points) for camera in rig], axis=-2)
    return points, np.linalg.norm(px - projected, axis=-1)
