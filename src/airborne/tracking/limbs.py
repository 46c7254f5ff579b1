"""Limbs that have gone astray: told by the pixels they are drawn on, looked for by themselves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri
from scipy.stats import qmc

from airborne.body import BodyModel, Pose
from airborne.body.chain import moved_pose
from airborne.rendering import EvidenceMaps, mask_evidence, place_segments
from airborne.tracking.appearance import Region
from airborne.tracking.freedom import limb_of_segment, within_limits
from airborne.tracking.synthesis import Synthesis

Array = NDArray[np.floating]

_ROUNDS = ((512, 16), (256, 3))  # proposals, kept; each round half as wide
_REACH_RAD = 0.6  # sd of the first proposals, for each joint and axis
_FEWEST_PX = 15  # a segment that shows fewer pixels is hidden, not astray
_ASTRAY = 0.55  # share of the body's own agreement, below which a segment is drawn on the wrong pixels


def astray(
    synthesis: Synthesis, pose: Pose, regions: Sequence[Region], posteriors: Sequence[Array]
) -> list[NDArray[np.int64]]:
    """Return the limbs, as the indices of their segments, of which a segment lies on pixels unlike the body."""
    n = len(synthesis.model.segments)
    posed, pixels, inside = synthesis.place(pose), np.zeros(n), np.zeros(n)
    for region, posterior in zip(regions, posteriors, strict=True):
        part = synthesis.parts(posed, region)
        shown = part >= 0
        owner = synthesis.segment_of_part[part[shown]]
        pixels += np.bincount(owner, minlength=n)
        inside += np.bincount(owner, posterior[shown], minlength=n)
    usual = inside.sum() / max(pixels.sum(), 1)
    is_astray = (pixels >= _FEWEST_PX) & (inside < _ASTRAY * usual * pixels)
    limb = limb_of_segment(synthesis.model)
    return [np.flatnonzero(limb == each) for each in np.unique(limb[is_astray & (limb >= 0)])]


def look_for(synthesis: Synthesis, poses: Sequence[Pose], limb: NDArray[np.int64], maps: EvidenceMaps) -> list[Pose]:
    """Return the poses that explain the evidence best when one limb moves from where the given poses have it."""
    candidates = list(poses)
    n_dof = 3 * len(limb)
    columns = (3 + 3 * limb[:, None] + np.arange(3)).ravel()  # of a motion; the root has the first six
    for number, (n_proposals, n_kept) in enumerate(_ROUNDS):
        steps = ndtri(qmc.Sobol(n_dof, rng=number).random(n_proposals)) * _REACH_RAD / 2**number
        moved = []
        for i, step in enumerate(steps):
            motion = np.zeros(6 + 3 * (len(synthesis.model.segments) - 1))
            motion[columns] = step
            moved.append(within_limits(synthesis.model, moved_pose(candidates[i % len(candidates)], motion)))
        candidates += moved
        scores = mask_evidence(synthesis.geometry, maps, *_placed(synthesis.model, candidates)).sum(axis=1)
        candidates = [candidates[i] for i in np.argsort(-scores, kind="stable")[:n_kept]]
    return candidates


def _placed(model: BodyModel, poses: Sequence[Pose]) -> tuple[Array, Array]:
    roots = [pose.world_from_root for pose in poses]
    R, t = np.stack([root.rotation.as_matrix() for root in roots]), np.stack([root.translation for root in roots])
    return place_segments(model, R, t, np.stack([pose.joint_angles for pose in poses]))
