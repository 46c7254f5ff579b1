"""A walking set of points and its detections, for the tests of detections and mending."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.cameras import Rig
from airborne.cameras.detections import Detections
from airborne.cameras.skeletons import SKELETONS
from tests.support.cameras import LENS, camera_at

CENTRES = {"left": (-4, -5, 1.5), "right": (4, -5, 2), "side": (6, 3, 2.5), "back": (-5, 4, 2.0)}
HALPE = SKELETONS["HALPE_26"].points


def four_cameras() -> Rig:
    return Rig(tuple(camera_at(centre, name=name, distortion=LENS) for name, centre in CENTRES.items()))


def walking(frames: int = 40, seed: int = 0) -> np.ndarray:
    """Points (frames, 26, 3) [m] of something as large as a person that moves by half a metre."""
    rng = np.random.default_rng(seed)
    shape = rng.uniform([-0.3, -0.2, 0.6], [0.3, 0.2, 2.2], (26, 3))
    wobble = np.cumsum(rng.normal(0, 0.02, (frames, 26, 3)), axis=0)
    return shape + wobble + np.linspace(0, 0.5, frames)[:, None, None] * [1, 0.3, 0]


def seen(rig: Rig, points: np.ndarray, sd_px: float = 1.0, seed: int = 1) -> Detections:
    """What a network that errs by sd_px finds: a steady error a point and camera, and as much again anew each frame."""
    rng = np.random.default_rng(seed)
    px = np.stack([camera.px_from_world(points) for camera in rig], axis=2)
    px = px + rng.normal(0, sd_px, px.shape[1:]) + rng.normal(0, sd_px, px.shape)
    return Detections(cameras=rig.names, points=HALPE, px=px, visibility=np.full(px.shape[:-1], 0.9))


def knocked(rig: Rig, name: str, shift_m=(0.06, -0.05, 0.03), turn_deg=(0.8, -1.0, 0.5)) -> Rig:
    """The rig with one camera's place wrong."""
    camera = rig[name]
    rotation = Rotation.from_euler("xyz", turn_deg, degrees=True) * camera.camera_from_world.rotation
    place = RigidTransform.from_components(-rotation.apply(camera.centre + shift_m), rotation)
    return Rig(tuple(replace(c, camera_from_world=place) if c.name == name else c for c in rig))
