"""Views resampled for another camera at the same position: reduced, cropped, and fields at full height."""

from __future__ import annotations

from functools import lru_cache
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from airborne.body import BodyModel, Pose, PosedBody, surface_arrays
from airborne.body.chain import subtree
from airborne.cameras import Camera
from airborne.types import Image
from airborne.video import View

CELL_PX = 160  # side of a view in the report
CROP_MARGIN = 1.1  # a crop's side over the body's diameter

cached_surface_arrays = lru_cache(maxsize=2)(surface_arrays)  # converted once per body, not once per image


def resample_view(view: View, camera: Camera) -> Image:
    """Show a view in the pixels of `camera`, which differs from the view's own in K and size only: (h, w, 3).

    Pixels are interpolated, those outside repeat the edge. As K holds the position of a field's rows, a static
    scene does not move from field to field.
    """
    view_px_from_px = view.camera.K @ np.linalg.inv(camera.K)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    resampled = cv2.warpAffine(view.rgb, view_px_from_px[:2], camera.size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
    return resampled.astype(np.uint8, copy=False)


def crop_camera(camera: Camera, posed: PosedBody) -> Camera | None:
    """Return the camera of a square crop around a body, at one scale for every pose; None behind the camera."""
    points = _points(posed)
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    depth_m = camera.camera_from_world.apply(centre)[2]
    if depth_m <= 0:
        return None
    side_m = CROP_MARGIN * _diameter_m(posed.model)
    step = side_m / depth_m / CELL_PX * camera.K.diagonal()[:2]  # pixels of the camera to one of the crop
    corner = camera.px_from_world(centre) - step * (CELL_PX - 1) / 2
    return camera.resample(
        scale=(float(step[0]), float(step[1])), offset=(float(corner[0]), float(corner[1])), size=(CELL_PX, CELL_PX)
    )


@lru_cache(maxsize=2)
def _diameter_m(model: BodyModel) -> float:
    """Return how long a body may be: joints straight, or two limbs, as arm and leg, stretched apart."""
    posed = model.with_pose(Pose(world_from_root=RigidTransform.identity()))
    points, parents = _points(posed), model.parents
    straight = 2 * float(np.linalg.norm(points - (points.min(axis=0) + points.max(axis=0)) / 2, axis=1).max())
    owner = _segments_of_points(posed)
    limbs = {s: subtree(model, s) for s in range(1, len(parents)) if np.count_nonzero(parents == parents[s]) > 1}
    reach = {
        s: np.linalg.norm(posed.t[s] - posed.t[0])
        + np.linalg.norm(points[np.isin(owner, limb)] - posed.t[s], axis=1).max(initial=0.0)
        for s, limb in limbs.items()
    }
    apart = [
        reach[a] + reach[b]
        for a, b in combinations(limbs, 2)
        if parents[a] != parents[b] and a not in limbs[b] and b not in limbs[a]
    ]
    return float(max([straight, *apart]))


def _segments_of_points(posed: PosedBody) -> NDArray[np.int64]:
    """Return which segment each of `_points` lies on: (p,)."""
    shapes = cached_surface_arrays(posed.model)
    corner_segment = np.repeat(shapes.polygon_segment, np.diff(shapes.start))
    return np.concatenate([np.repeat(shapes.ellipsoid_segment, 6), corner_segment])


def _points(posed: PosedBody) -> NDArray[np.floating]:
    """Return corners, and ends of the ellipsoids' axes, in the world: (p, 3) [m]."""
    shapes = cached_surface_arrays(posed.model)
    half = np.swapaxes(shapes.ellipsoid_axes * shapes.ellipsoid_semi_axes[:, None], 1, 2)  # rows: half axes
    ends = np.concatenate([shapes.ellipsoid_centre[:, None] + half, shapes.ellipsoid_centre[:, None] - half], axis=1)
    points = np.concatenate([ends.reshape(-1, 3), shapes.corners])
    segment = _segments_of_points(posed)
    return np.einsum("pij,pj->pi", posed.R[segment], points) + posed.t[segment]
