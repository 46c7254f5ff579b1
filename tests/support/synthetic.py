"""Small scenes, quick to draw."""

from dataclasses import fields, replace

import numpy as np
from scipy.interpolate import PPoly

from airborne.cameras import Rig
from airborne.geometry.rotations import angles_from_matrix, unwrap
from airborne.synthetic import PoseRanges, cross_scene


def small_scene(preset="half-twist", *, scale=4, **changes):
    """Return a preset's scene with images smaller by `scale`, four pictures long."""
    scene = cross_scene(preset, seed=3, clutter=6)
    small = Rig(
        tuple(
            camera.resample(
                scale=(scale, scale),
                offset=((scale - 1) / 2, (scale - 1) / 2),
                size=(camera.size[0] // scale, camera.size[1] // scale),
            )
            for camera in scene.rig
        )
    )
    return replace(scene, **{"rig": small, "n_pictures": 4, **changes})


def constant_joints(joint_angles):
    """Return the motion of joints with constant angles (joints, 3) [rad]."""
    return PPoly(np.asarray(joint_angles, float)[None, None], [0.0, 1.0])


def pose_ranges(flight):
    """Return the ranges of a flight's root over its samples: along z, y and x, and of its three angles."""
    lateral, forward, vertical = np.ptp(flight.position, axis=0)
    angles = np.ptp(unwrap(angles_from_matrix(flight.R), flight.time_s), axis=0)
    values = (vertical, forward, lateral, *angles)
    return PoseRanges(**{field.name: float(value) for field, value in zip(fields(PoseRanges), values, strict=True)})
