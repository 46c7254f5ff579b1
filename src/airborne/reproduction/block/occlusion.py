"""How much of a player's legs other players occlude from each camera, by the capsules of their true bodies."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airborne.body.legs import SHANK_WIDTH_M, THIGH_WIDTH_M
from airborne.reproduction.block.plan import PAPER_PARTS
from airborne.synthetic import BlockScene, true_joints
from airborne.synthetic.block.margins import capsules_of
from airborne.types import Array

_RODS_AT = ((2,), (3,), (0, 4), (1, 5), (2,), (3,))  # of PARTS: the other ends of the rods that meet there
_ALONG_M = (0.0, 0.05, 0.10)  # from the joint, along each of its rods
_ACROSS = (-0.45, 0.0, 0.45)  # of a rod's width, along_ray from the camera
_WIDTH_M = (THIGH_WIDTH_M, THIGH_WIDTH_M, SHANK_WIDTH_M, SHANK_WIDTH_M, SHANK_WIDTH_M, SHANK_WIDTH_M)
FULLY_OCCLUDED = 0.999  # share from which on a part is hidden


def occlusion_shares(scene: BlockScene) -> Array:
    """Return the share of each part of each blocker that is occluded: (frames, blockers, views, parts).

    A part is what lies within 0.1 m of the joint on its rods, as wide as the rods. Only other players occlude.
    """
    capsules = [capsules_of(p.movement.person, p.poses(scene.times_s), p.stature_m) for p in scene.players]
    shares = np.empty((scene.n_frames, len(scene.blockers), len(scene.rig), len(PAPER_PARTS)))
    for i, player in enumerate(scene.blockers):
        joints = true_joints(player, scene.times_s)
        points = np.stack([joints[name] for name in PAPER_PARTS], axis=1)
        others = [each for k, each in enumerate(capsules) if k != i]
        start, end = (np.concatenate([each[k] for each in others], axis=1) for k in (0, 1))
        radius = np.concatenate([each.radius_m for each in others])
        for v, camera in enumerate(scene.rig):
            for k in range(len(PAPER_PARTS)):
                samples = _samples(points, k, camera.centre)
                shares[:, i, v, k] = is_occluded(samples, camera.centre, start=start, end=end, radius=radius).mean(
                    axis=1
                )
    return shares


def is_occluded(points: Array, centre: Array, *, start: Array, end: Array, radius: Array) -> NDArray[np.bool_]:
    """Return which points (n, k, 3) a camera at `centre` (3,) cannot see: (n, k).

    The occluders are capsules: start, end (n, c, 3), radius (c,) [m].
    """
    ray, axis = (points - centre)[:, :, None], (end - start)[:, None]
    to_start = (start - centre)[:, None]
    rr, ra, aa = (np.sum(a * b, axis=-1) for a, b in ((ray, ray), (ray, axis), (axis, axis)))
    rs, as_ = np.sum(ray * to_start, axis=-1), np.sum(axis * to_start, axis=-1)
    along = np.clip((ra * rs - rr * as_) / np.maximum(rr * aa - ra**2, 1e-12), 0, 1)  # of the capsule
    along_ray = np.clip((rs + along * ra) / rr, 0, 1)  # of the ray
    along = np.clip((along_ray * ra - as_) / aa, 0, 1)
    apart = np.linalg.norm(to_start + along[..., None] * axis - along_ray[..., None] * ray, axis=-1)
    return np.any(apart < radius, axis=-1)


def _samples(points: Array, k: int, centre: Array) -> Array:
    """Return points on the part around joint k of (n, 6, 3), over its width in the image: (n, samples, 3)."""
    joint, samples = points[:, k], []
    for other in _RODS_AT[k]:
        rod = points[:, other] - joint
        rod /= np.linalg.norm(rod, axis=-1, keepdims=True)
        across = np.cross(rod, joint - centre)
        across /= np.linalg.norm(across, axis=-1, keepdims=True)
        samples += [joint + a * rod + w * _WIDTH_M[k] * across for a in _ALONG_M for w in _ACROSS]
    return np.stack(samples, axis=1)
