"""The 3D scene: cameras, the floor, points and paths."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np
from nicegui import ui
from nicegui.elements.scene.scene import Scene

from airborne.cameras import Camera, Rig
from airborne.types import Array

_CAMERA_COLOUR, _PATH_COLOUR, _POINT_COLOUR = "#1f2429", "#0072b2", "#d55e00"
_FRUSTUM_SHARE = 0.12  # of the distance between camera and middle


def draw_cameras(
    rig: Rig, points: Array | None = None, path: Array | None = None, middle: Array | None = None
) -> Scene:
    """Show cameras from above and behind, with points (n, 3) and a path (n, 3) [m]; NaN leaves gaps."""
    centres = np.stack([camera.centre for camera in rig])
    middle = _middle(rig) if middle is None else middle
    reach = float(np.median(np.linalg.norm(centres - middle, axis=1)))
    with ui.scene(grid=(60, 60), background_color="#f6f7f8").style("width: 100%; flex: 1; min-height: 180px") as scene:
        for camera in rig:
            _frustum(scene, camera, _FRUSTUM_SHARE * reach)
        for point in [] if points is None else points:
            scene.sphere(0.012 * reach / 4).material(_POINT_COLOUR).move(*map(float, point))
        if path is not None:
            draw_path(scene, path)
    away = middle + reach * np.array([0.7, -0.9, 0.55])
    place = dict(zip(("x", "y", "z"), map(float, away), strict=True))
    scene.move_camera(**place, look_at_x=middle[0], look_at_y=middle[1], look_at_z=middle[2], duration=0)
    return scene


def draw_path(scene: Scene, path: Array, colour: str = _PATH_COLOUR) -> None:
    """Draw the lines between points that follow each other."""
    _lines(scene, [(a, b) for a, b in pairwise(path) if np.isfinite([a, b]).all()], colour)


def _frustum(scene: Scene, camera: Camera, depth: float) -> None:
    width, height = camera.size
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height]], float)
    xy = (corners - camera.K[:2, 2]) @ np.linalg.inv(camera.K[:2, :2]).T
    ends = camera.camera_from_world.inv().apply(np.append(xy, np.ones((4, 1)), axis=1) * depth)
    _lines(scene, [(camera.centre, end) for end in ends], _CAMERA_COLOUR)
    _lines(scene, list(zip(ends, np.roll(ends, -1, axis=0), strict=True)), _CAMERA_COLOUR)
    x, y, z = map(float, camera.centre)
    scene.text(camera.name, "font-size: 13px; color: #1f2429; padding-left: 8px").move(x, y, z)


def _lines(scene: Scene, pairs: Iterable[tuple[Sequence[float], Sequence[float]]], colour: str) -> None:
    for start, end in pairs:
        scene.line([float(value) for value in start], [float(value) for value in end]).material(colour)


def _middle(rig: Rig) -> Array:
    """Return the point nearest to all optical axes: (3,) [m]."""
    A, b = np.zeros((3, 3)), np.zeros(3)
    for camera in rig:
        axis = camera.camera_from_world.rotation.inv().apply([0.0, 0.0, 1.0])
        across = np.eye(3) - np.outer(axis, axis)
        A, b = A + across, b + across @ camera.centre
    return np.linalg.lstsq(A, b, rcond=None)[0]
