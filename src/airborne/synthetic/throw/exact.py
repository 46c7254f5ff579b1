"""Images in the tracker's own light, one colour for each pixel's centre (paper B, "Method": identical light)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from airborne.body import Pose, surface_arrays
from airborne.cameras import Camera
from airborne.rendering import Lights, render
from airborne.rendering.shapes import new_shapes
from airborne.synthetic.throw.scene import Scene
from airborne.types import Array32
from airborne.video import Frames, View


def exact_frames(scene: Scene, lights: Lights) -> Iterator[Frames]:
    """Render the scene frame by frame: no antialiasing, blur, exposure or shadows; white noise.

    The surroundings are rendered in the same light; where there are none, images are black.
    """
    surface = surface_arrays(scene.body)
    shapes = new_shapes(surface)
    cameras = [[camera.field(p) for p in (0, 1)] if scene.is_interlaced else [camera] for camera in scene.rig]
    backdrops = [[_backdrop(scene, camera, lights) for camera in own] for own in cameras]
    flight = scene.flight(np.array([float(scene.time_s(i)) for i in range(scene.n_recorded)]))
    for index in range(scene.n_recorded):
        posed = scene.body.with_pose(flight.pose(index))
        parity = scene.parity(index) if scene.is_interlaced else 0
        views = []
        for number, (camera, backdrop) in enumerate(zip(cameras, backdrops, strict=True)):
            rendering = render(surface, posed, camera[parity], lights, shapes=shapes)
            light = np.where(rendering.mask[..., None], rendering.colour, backdrop[parity])
            rng = np.random.default_rng([scene.seed, 2, number, index])
            noise = scene.noise_sd * rng.standard_normal(light.shape, np.float32) if scene.noise_sd > 0 else 0.0
            views.append(View(camera[parity], _quantise(light + noise)))
        yield Frames(index, scene.time_s(index), tuple(views))


def _backdrop(scene: Scene, camera: Camera, lights: Lights) -> Array32:
    """Return what a camera sees of the surroundings: (h, w, 3) sRGB, black where there is nothing."""
    width, height = camera.size
    if scene.surroundings is None:
        return np.zeros((height, width, 3), np.float32)
    posed = scene.surroundings.with_pose(Pose(world_from_root=RigidTransform.identity()))
    return np.asarray(render(surface_arrays(scene.surroundings), posed, camera, lights).colour, np.float32)


def _quantise(light: NDArray) -> NDArray[np.uint8]:
    return np.clip(np.rint(light), 0, 255).astype(np.uint8)
