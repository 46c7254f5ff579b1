"""Cameras and point sets for the tests."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration.sources.control_points import ControlPoints
from airborne.cameras import Camera, Rig

LENS = np.array([-0.2, 0.08, 0.001, -0.002, -0.01])


def camera_at(centre, *, target=(0.0, 0.0, 1.5), name="cam", focal=1000.0, distortion=None) -> Camera:
    """Return a camera at centre that looks at target, head up."""
    centre, target = np.asarray(centre, float), np.asarray(target, float)
    forward = (target - centre) / np.linalg.norm(target - centre)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    R = np.stack([right, np.cross(forward, right), forward])
    return Camera(
        name=name,
        K=np.array([[focal, 0, 383.5], [0, focal, 287.5], [0, 0, 1]]),
        size=(768, 576),
        camera_from_world=RigidTransform.from_components(-R @ centre, Rotation.from_matrix(R)),
        distortion=np.zeros(5) if distortion is None else distortion,
    )


def three_cameras(distortion=None) -> Rig:
    """Return a rig of three cameras around the origin."""
    centres = {"left": (-4, -5, 1.5), "right": (4, -5, 2), "side": (6, 3, 2.5)}
    return Rig(tuple(camera_at(centre, name=name, distortion=distortion) for name, centre in centres.items()))


def scattered(n: int, seed: int = 0) -> np.ndarray:
    """Return n points (n, 3) [m] in the middle of the rig's view."""
    return np.random.default_rng(seed).uniform([-1, -1, 0.5], [1, 1, 2.5], (n, 3))


def clicked(points: ControlPoints, camera: str, change) -> ControlPoints:
    """Return the points with one camera's pixels (n, 2) replaced by change(pixels)."""
    px = points.px.copy()
    i = points.cameras.index(camera)
    px[:, i] = change(px[:, i].copy())
    return replace(points, px=px)


def restrict_to_cameras(points: ControlPoints, *cameras: str) -> ControlPoints:
    """Return the points with these cameras' columns only."""
    return replace(points, cameras=cameras, px=points.px[:, [points.cameras.index(camera) for camera in cameras]])
