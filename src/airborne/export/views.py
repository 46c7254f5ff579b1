"""Views as another camera at the same place shows them: reduced, cropped, and fields at full height."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from airborne.body import BodyModel, Pose, PosedBody, geometry
from airborne.cameras import Camera
from airborne.video import View

Picture = NDArray[np.uint8]

CELL_PX = 160
ROOM = 1.1  # a crop's side in the body's diameters

shapes_of = lru_cache(maxsize=2)(geometry)  # flattened once per body, not once per picture


def seen_by(view: View, camera: Camera) -> Picture:
    """Show a view in the pixels of `camera`, which differs from the view's own in K and size only: (h, w, 3).

    Pixels between are interpolated, pixels outside repeat the edge. As K says where the rows of a field lie, a still
    scene does not move from field to field.
    """
    view_px_from_px = view.camera.K @ np.linalg.inv(camera.K)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    seen = cv2.warpAffine(view.rgb, view_px_from_px[:2], camera.size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
    return seen.astype(np.uint8, copy=False)


def close_up(camera: Camera, posed: PosedBody) -> Camera | None:
    """Return the camera of a square crop round a body, at one scale for every pose; None behind the camera."""
    points = _points(posed)
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    depth_m = camera.camera_from_world.apply(centre)[2]
    if depth_m <= 0:
        return None
    side_m = ROOM * _diameter_m(posed.model)
    step = side_m / depth_m / CELL_PX * camera.K.diagonal()[:2]  # pixels of the camera to one of the crop
    corner = camera.px_from_world(centre) - step * (CELL_PX - 1) / 2
    return camera.resampled(
        scale=(float(step[0]), float(step[1])), offset=(float(corner[0]), float(corner[1])), size=(CELL_PX, CELL_PX)
    )


@lru_cache(maxsize=2)
def _diameter_m(model: BodyModel) -> float:
    """Measure twice the body's largest distance from its middle, joints straight."""
    points = _points(model.with_pose(Pose(world_from_root=RigidTransform.identity())))
    return 2 * float(np.linalg.norm(points - (points.min(axis=0) + points.max(axis=0)) / 2, axis=1).max())


def _points(posed: PosedBody) -> NDArray[np.floating]:
    """Return corners, and ends of the ellipsoids' axes, in the world: (p, 3) [m]."""
    shapes = shapes_of(posed.model)
    half = np.swapaxes(shapes.ellipsoid_axes * shapes.ellipsoid_semi_axes[:, None], 1, 2)  # rows: half axes
    ends = np.concatenate([shapes.ellipsoid_centre[:, None] + half, shapes.ellipsoid_centre[:, None] - half], axis=1)
    points = np.concatenate([ends.reshape(-1, 3), shapes.corners])
    corner_segment = np.repeat(shapes.polygon_segment, np.diff(shapes.start))
    segment = np.concatenate([np.repeat(shapes.ellipsoid_segment, 6), corner_segment])
    return np.einsum("pij,pj->pi", posed.R[segment], points) + posed.t[segment]
