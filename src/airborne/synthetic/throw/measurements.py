"""Simulated measurements in a scene: control points, clicked points, the first pose, the lamps."""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.spatial.transform import RigidTransform

from airborne.body import Box, Pose
from airborne.body.chain import clamp_to_limits, move_pose
from airborne.calibration.sources.control_points import ControlPoints
from airborne.cameras import Rig
from airborne.synthetic.flight.rigid import SampledFlight
from airborne.synthetic.throw.scene import Scene
from airborne.types import Array

_FRAME_M = ((-1.0, 0.0, 1.0), (-0.7, 0.7), (0.6, 1.35, 2.05, 2.8))  # positions of the control points along x, y, z
_POINT_SD_M = 0.015  # of the points about the frame's nodes
_SPOT_SD_M, _POWER_SD = 0.05, 0.15  # errors of the lamps' measured positions and nominal powers
_WATT = 50.0  # nominal power of a lamp that gives the light 1 at 1 m


def control_points(scene: Scene) -> ControlPoints:
    """Return 24 points on a frame of 2 x 1.4 x 2.2 m, surveyed without error, clicked with the scene's `click_sd_px`.

    NaN where a point lies outside a camera's image.
    """
    rng = np.random.default_rng([scene.seed, 3])
    nodes = np.array(list(product(*_FRAME_M)))
    world = np.round(nodes + rng.normal(0, _POINT_SD_M, nodes.shape), 4)  # written with 4 decimals
    px = _click(scene.rig, world, scene.click_sd_px, rng)
    names = tuple(f"P{i:02d}" for i in range(1, len(world) + 1))
    return ControlPoints(names=names, world=world, cameras=scene.rig.names, px=px)


def digitise(scene: Scene, flight: SampledFlight) -> dict[str, Array]:
    """Return the ends of every box's longest axis, clicked with the scene's `digitising_sd_px`, occluded or not.

    Named by the stem before the first "_" of the part's name, `<stem>_minus` and `<stem>_plus`: (n, cameras, 2)
    [px] each, NaN where an end lies outside a camera's image.
    """
    rng = np.random.default_rng([scene.seed, 4])
    posed = scene.body.with_pose(Pose(world_from_root=RigidTransform.identity()))
    points = {}
    for segment, R, t in zip(scene.body.segments, posed.R, posed.t, strict=True):
        for part in segment.parts:
            if isinstance(part.shape, Box):
                half = np.where(np.arange(3) == np.argmax(part.shape.size_m), part.shape.size_m / 2, 0.0)
                for name, end in (("minus", -half), ("plus", half)):
                    on_body = R @ part.segment_from_part.apply(end) + t
                    world = flight.R @ on_body + flight.position
                    points[f"{part.name.split('_')[0]}_{name}"] = _click(scene.rig, world, scene.digitising_sd_px, rng)
    return points


def start_pose(scene: Scene) -> Pose:
    """Return the first pose as set by hand: root and joints off by the scene's start errors, in random directions.

    Joint angles stay within the joints' limits.
    """
    rng = np.random.default_rng([scene.seed, 5])
    offset, axis = (direction / np.linalg.norm(direction) for direction in rng.normal(size=(2, 3)))
    true = scene.flight(np.zeros(1)).pose(0)
    rotations = rng.normal(size=true.joint_angles.shape)
    rotations = scene.start_joint_error_rad * rotations / np.linalg.norm(rotations, axis=1, keepdims=True)
    delta = np.concatenate([scene.start_error_m * offset, scene.start_error_rad * axis, rotations.ravel()])
    return clamp_to_limits(scene.model, move_pose(true, delta))


def lights_table(scene: Scene) -> dict:
    """Return the lamps as measured, for a JSON file: positions off by 50 mm sd, powers by 15 %."""
    rng = np.random.default_rng([scene.seed, 6])
    spots = [
        {
            "position": np.round(spot.position + rng.normal(0, _SPOT_SD_M, 3), 2).tolist(),
            "watt": round(_WATT * float(np.mean(spot.light_at_1m)) * (1 + rng.normal(0, _POWER_SD))),
        }
        for spot in scene.spots
    ]
    return {"spotlights": spots, "note": "measured positions; powers are nominal"}


def _click(rig: Rig, points: Array, sd_px: float, rng: np.random.Generator) -> Array:
    """Project points (n, 3) and click them: (n, cameras, 2) [px], NaN outside the image."""
    px = np.stack([camera.px_from_world(points) for camera in rig], axis=1)
    px = px + rng.normal(0, sd_px, px.shape)
    size = np.array([camera.size for camera in rig])
    is_inside = np.all((px >= -0.5) & (px <= size - 0.5), axis=-1, keepdims=True)
    return np.where(is_inside, px, np.nan)
