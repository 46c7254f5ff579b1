"""Paths of a thrown body as tracked, with errors that are known."""

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose
from airborne.tracking.self_check.path import TrackedPath

POSITION_SD_M, ROTATION_SD_RAD = 0.002, 0.004
N, RATE_HZ = 60, 50.0


def thrown_path(position=1.0, rotation=1.0, *, seed=0, every=1, is_known=True):
    """A thrown body that turns twice a second, with errors of these factors on the stated ones."""
    rng, index = np.random.default_rng(seed), np.arange(0, N * every, every)
    t = index / RATE_HZ / every
    places = np.stack([2 * t, 0.3 * t, 1 + 4 * t - 9.81 / 2 * t**2], axis=1)
    places += position * POSITION_SD_M * rng.standard_normal((N, 3))
    turned = Rotation.from_rotvec(np.outer(4 * np.pi * t, [0.6, 0.0, 0.8]))
    turned = Rotation.from_rotvec(rotation * ROTATION_SD_RAD * rng.standard_normal((N, 3))) * turned
    poses = [Pose(world_from_root=RigidTransform.from_components(p, r)) for p, r in zip(places, turned, strict=True)]
    variance = np.repeat([POSITION_SD_M, ROTATION_SD_RAD], 3) ** 2
    covariance = np.tile(np.diag(variance if is_known else np.full(6, np.inf)), (N, 1, 1))
    return TrackedPath(index, t, poses, covariance)
