"""The 3D scene: cameras, the floor, points and paths."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable, Iterable
from itertools import pairwise

import numpy as np
from nicegui import ui
from nicegui.elements.scene.objects.group import Group
from nicegui.elements.scene.scene import Scene
from nicegui.elements.scene.scene_object3d import Object3D
from nicegui.events import GenericEventArguments
from scipy.spatial.transform import RigidTransform, Rotation
from trimesh.exchange.stl import export_stl

from airborne.body import BodyModel, Pose
from airborne.cameras import Camera, Rig
from airborne.errors import ResultError
from airborne.export.palette import BLUE
from airborne.export.part_meshes import part_colour, segment_mesh
from airborne.export.views import cached_surface_arrays
from airborne.tracking.image_regions import bounding_points
from airborne.types import Array

_CAMERA_COLOUR, _PATH_COLOUR = "#1f2429", BLUE
FROM = np.array([0.7, -0.9, 0.55])  # the side and height from which the scene is seen first
_ALL_IN_VIEW = 1.4  # times a sphere's radius: from so far, along `FROM`, three.js's 75 degrees hold it with a margin
_FLOOR = 2.0  # times `away_m`: how far the floor's squares of a metre reach; further away they would be one stripe
_MOST_LINES = 500  # of a path: each is an object of the scene
_MOVE_EVERY_S = 0.05  # while handles are dragged: the outlines of three views take half of it
_POINT_M = 0.03  # radius of a point in a scene
_SHAFT_M, _HEAD_M = 0.012, 0.12  # an arrow's thickness, and the length of its head
_FRUSTUM_SHARE = 0.12  # of the distance between camera and middle


def draw_cameras(rig: Rig, path: Array | None = None, *, seen_from: tuple[Array, float] | None = None) -> Scene:
    """Show cameras and a path (n, 3) [m], NaN leaves gaps; `seen_from` is an overview.

    Without one it shows all cameras and what they look at.
    """
    centres, looked_at = np.stack([camera.centre for camera in rig]), middle_of_view(rig)
    reach = float(np.median(np.linalg.norm(centres - looked_at, axis=1)))
    with _scene(*(seen_from or overview(np.vstack([centres, looked_at])))) as scene:
        for camera in rig:
            _frustum(scene, camera, _FRUSTUM_SHARE * reach)
        if path is not None:
            pairs = [(a, b) for a, b in pairwise(path[:: len(path) // _MOST_LINES + 1]) if np.isfinite([a, b]).all()]
            _lines(scene, pairs, _PATH_COLOUR)
    return scene


def draw_rays(scene: Scene, camera: Camera, points: Array, colour: str) -> None:
    """Add points (n, 3) [m] to a scene, and the rays by which a camera sees them."""
    _lines(scene, [(camera.centre, point) for point in points], colour)
    with scene:
        for x, y, z in points.tolist():
            scene.sphere(_POINT_M).move(x, y, z).material(_CAMERA_COLOUR)


def draw_body(model: BodyModel, address: str) -> None:
    """Show a body in its zero pose, without a floor; `address` gives the mesh of each part, with {part} in it."""
    pose, corners = _zero_pose(model)
    lift = np.array([0.0, 0.0, -corners[:, 2].min()])
    pose, (middle, away_m) = pose.move(lift, np.zeros(3)), overview(corners + lift)
    BodyOnStage(_scene(middle, away_m, has_floor=False), model, address).show(pose)


def reach_of(model: BodyModel) -> float:
    """Return how far a body reaches from its root in its zero pose [m]."""
    return float(np.linalg.norm(_zero_pose(model)[1], axis=1).max())


def _zero_pose(model: BodyModel) -> tuple[Pose, Array]:
    """Return a body's zero pose, and points (n, 3) [m] that hold all of it."""
    pose = Pose(world_from_root=RigidTransform.identity(), joint_angles=np.zeros((model.n_joints, 3)))
    return pose, bounding_points(model.with_pose(pose), cached_surface_arrays(model))


def _scene(middle: Array, away_m: float, *, has_floor: bool = True) -> Scene:
    """Build an empty scene that is seen from `away_m` beside its middle (3,) [m]."""
    floor_m = 2 * math.ceil(np.linalg.norm(middle[:2]) + _FLOOR * away_m)  # about the origin
    scene = ui.scene(grid=(floor_m, floor_m) if has_floor else False, background_color="#f6f7f8").style(
        "width: 100%; flex: 1; min-height: 110px"
    )
    with scene:
        Redraw(scene.id)
        if has_floor:
            for name, end in zip("xyz", np.eye(3), strict=True):
                _lines(scene, [(np.zeros(3), end)], _CAMERA_COLOUR)
                scene.text(f"{name} 1 m", "font-size: 11px; color: #5d666f").move(*map(float, end))
    (x, y, z), (u, v, w) = (map(float, each) for each in (middle + away_m * FROM, middle))
    scene.move_camera(x, y, z, look_at_x=u, look_at_y=v, look_at_z=w, duration=0)
    return scene


def overview(points: Array) -> tuple[Array, float]:
    """Return the middle of points (n, 3) [m] and how many times `FROM` beside it all of them are in view."""
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    return middle, _ALL_IN_VIEW * float(np.linalg.norm(points - middle, axis=1).max())


class BodyOnStage:
    """A run's body in the scene, which takes any pose."""

    def __init__(self, scene: Scene, model: BodyModel, address: str) -> None:
        """Draw the body's parts; `address` gives the mesh of each, with {part} in it."""
        self._scene, self._model, number = scene, model, 0
        self._groups: list[Group] = []
        with scene:
            for segment in model.segments:
                with scene.group().visible(False) as group:
                    for part in segment.parts:
                        red, green, blue = (round(float(level)) for level in part_colour(part))
                        scene.stl(address.format(part=number)).material(f"#{red:02x}{green:02x}{blue:02x}")
                        number += 1
                self._groups.append(group)

    def show(self, pose: Pose | None) -> None:
        """Show the body in a pose; None hides it."""
        posed = None if pose is None else self._model.with_pose(pose)
        for k, group in enumerate(self._groups):
            group.visible(posed is not None)
            if posed is not None:
                x, y, z = map(float, posed.t[k])
                group.move(x, y, z).rotate_R(posed.R[k].tolist())


class Arrow:
    """An arrow in a scene, from any place along any vector."""

    def __init__(self, scene: Scene, colour: str) -> None:
        """Draw it, hidden."""
        with scene, scene.group().visible(False) as self._group:  # along y, a metre long
            scene.cylinder(_SHAFT_M, _SHAFT_M, 1 - _HEAD_M).move(y=(1 - _HEAD_M) / 2).material(colour)
            scene.cylinder(0, 3 * _SHAFT_M, _HEAD_M).move(y=1 - _HEAD_M / 2).material(colour)

    def show(self, start_m: Array, along_m: Array) -> None:
        """Show it from a place (3,) [m] along a vector (3,) [m]; a vector without a direction hides it."""
        _lay_along(self._group, start_m, along_m)


class Sticks:
    """Sticks in a scene, between any points."""

    def __init__(self, scene: Scene, colours: Iterable[str]) -> None:
        """Draw one of each colour, hidden."""
        self._groups: list[Group] = []
        with scene:
            for colour in colours:
                with scene.group().visible(False) as group:  # along y, a metre long
                    scene.cylinder(_POINT_M, _POINT_M, 1).move(y=0.5).material(colour)
                self._groups.append(group)

    def show(self, ends_m: Array) -> None:
        """Show them between their ends (sticks, 2, 3) [m]; NaN hides a stick."""
        for group, (a, b) in zip(self._groups, np.nan_to_num(ends_m), strict=True):
            _lay_along(group, a, b - a)


def _lay_along(group: Group, start_m: Array, along_m: Array) -> None:
    """Bring what is a metre long along y to a place (3,) [m], along a vector (3,) [m]; hide it without a direction."""
    length = float(np.linalg.norm(along_m))
    group.visible(bool(length > _SHAFT_M))
    if length > _SHAFT_M:
        turn = Rotation.align_vectors(along_m[None], [[0.0, 1.0, 0.0]])[0]
        x, y, z = map(float, start_m)
        group.move(x, y, z).rotate_R(turn.as_matrix().tolist()).scale(1, length, 1)


class Redraw(Object3D, component="redraw.js"):
    """Lets the scene around it be drawn only when something in it has changed; see `redraw.js`."""


class Gizmo(Object3D, component="gizmo.js"):
    """Handles about a point of a scene: arrows along the world's axes, rings about the body's own; see `gizmo.js`."""

    def __init__(self, scene: Scene, size_m: float, on_move: Callable[[RigidTransform, bool], Awaitable[None]]) -> None:
        """Draw the handles; `on_move` gets where they were brought, `world_from_root`, and whether they were let go."""
        with scene:
            super().__init__(scene.id, size_m)

        async def handle(event: GenericEventArguments) -> None:
            turn = Rotation.from_quat(event.args["quaternion"])
            root = RigidTransform.from_components(event.args["position"], turn)
            await on_move(root, bool(event.args["ended"]))

        scene.on("gizmo", handle, throttle=_MOVE_EVERY_S)

    def place(self, world_from_root: RigidTransform) -> None:
        """Bring the handles to a body's root."""
        x, y, z = map(float, world_from_root.translation)
        self.move(x, y, z).rotate_R(world_from_root.rotation.as_matrix().tolist())


def part_stl(model: BodyModel, number: int) -> bytes:
    """Return a part of a body in its segment's frame, as a binary STL; parts are counted over all segments."""
    parts = [part for segment in model.segments for part in segment.parts]
    if not 0 <= number < len(parts):
        raise ResultError(f"the body has {len(parts)} parts, no part {number}")
    return export_stl(segment_mesh(parts[number]))


def _frustum(scene: Scene, camera: Camera, depth: float) -> None:
    width, height = camera.size
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height]], float)
    xy = (corners - camera.K[:2, 2]) @ np.linalg.inv(camera.K[:2, :2]).T
    ends = camera.camera_from_world.inv().apply(np.append(xy, np.ones((4, 1)), axis=1) * depth)
    _lines(scene, [(camera.centre, end) for end in ends], _CAMERA_COLOUR)
    _lines(scene, list(zip(ends, np.roll(ends, -1, axis=0), strict=True)), _CAMERA_COLOUR)
    x, y, z = map(float, camera.centre)
    scene.text(camera.name, "font-size: 13px; color: #1f2429; padding-left: 8px").move(x, y, z)


def _lines(scene: Scene, pairs: Iterable[tuple[Array, Array]], colour: str) -> None:
    for start, end in pairs:
        scene.line([float(value) for value in start], [float(value) for value in end]).material(colour)


def middle_of_view(rig: Rig) -> Array:
    """Return the point nearest to all optical axes: (3,) [m]."""
    A, b = np.zeros((3, 3)), np.zeros(3)
    for camera in rig:
        axis = camera.camera_from_world.rotation.inv().apply([0.0, 0.0, 1.0])
        across = np.eye(3) - np.outer(axis, axis)
        A, b = A + across, b + across @ camera.centre
    return np.asarray(np.linalg.lstsq(A, b, rcond=None)[0], float)
