"""Whether silhouettes belong together: the visual hull (Laurentini 1994) of those of one body covers them all."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from airborne.cameras import Rig
from airborne.tracking.first_pose.places import NEAREST_M, MovingRegion
from airborne.types import Array

# chosen: voxels along each edge of the cube, whose half edge is so many times the largest silhouette's reach
_N_VOXELS, _MARGIN = 36, 1.1
_BESIDE = 1.5  # chosen: voxels that one of the hull covers, as its silhouette's edge lies between them


def uncovered_share(regions: Sequence[MovingRegion]) -> float:
    """Return the mean share of silhouettes, one a camera, two at least, that their visual hull does not cover.

    It is 0 where one body shows them, but for what is cut out of a silhouette; what lies beyond a camera's image may
    belong to the hull.
    """
    rig = Rig(tuple(region.camera for region in regions))
    middle = rig.points_from_px(np.array([region.centre for region in regions]))
    depth_m = np.array([camera.camera_from_world.apply(middle)[2] for camera in rig])
    if not (depth_m > NEAREST_M).all():  # NaN, too
        return 1.0
    m_per_px = depth_m / np.array([camera.K[0, 0] for camera in rig])
    reach_m = _MARGIN * max(m * np.hypot(*region.mask.shape) / 2 for m, region in zip(m_per_px, regions, strict=True))
    points, masks, places = middle + reach_m * _cube(), [np.pad(region.mask, 1) for region in regions], []
    is_hull = np.ones(len(points), bool)
    for region, mask in zip(regions, masks, strict=True):
        px = np.rint(region.camera.px_from_world(points)).astype(int)
        column, row = np.clip(px - region.corner + 1, 0, np.array(mask.shape[::-1]) - 1).T  # of the padded mask
        is_hull &= mask[row, column] | (px < 0).any(axis=1) | (px >= region.camera.size).any(axis=1)
        places.append((row, column))
    shares = []
    for mask, (row, column), m in zip(masks, places, m_per_px, strict=True):
        is_covered = np.zeros(mask.shape, np.uint8)
        is_covered[row[is_hull], column[is_hull]] = 1
        width = int(np.ceil(_BESIDE * 2 * reach_m / _N_VOXELS / m)) | 1
        is_covered = cv2.dilate(is_covered, np.ones((width, width), np.uint8))
        shares.append(np.mean(is_covered[mask] == 0))
    return float(np.mean(shares))


def _cube() -> Array:
    """Return the middles of the voxels of a cube of half edge 1: (voxels, 3)."""
    edge = (2 * np.arange(_N_VOXELS) + 1) / _N_VOXELS - 1
    return np.stack(np.meshgrid(edge, edge, edge, indexing="ij"), axis=-1).reshape(-1, 3)
