"""Limbs that have gone astray: told by the pixels they are drawn on, looked for by themselves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri
from scipy.stats import qmc

from airborne.appearance.model import Region
from airborne.body import Pose
from airborne.geometry.joint_rotations import turned
from airborne.rendering import EvidenceMaps, mask_evidence, place_segments
from airborne.tracking.model_based.degrees_of_freedom import limb_of_segment
from airborne.tracking.model_based.render_model import Synthesis

Array = NDArray[np.floating]

_ROUNDS = ((512, 16), (256, 3))  # proposals, kept; each round half as wide
_REACH_RAD = 0.7  # sd of the first proposals, for each joint and axis
_FEWEST_PX = 25  # a segment that shows fewer pixels in a view is hidden there, not astray
_ASTRAY = 0.5  # share of the body's own agreement, below which a segment is drawn on the wrong pixels


def astray(
    synthesis: Synthesis, pose: Pose, regions: Sequence[Region], posteriors: Sequence[Array]
) -> list[NDArray[np.int64]]:
    """Return the limbs, by their segments' indices, with a segment that lies on pixels unlike the body in a view."""
    n = len(synthesis.model.segments)
    posed, pixels, inside = synthesis.place(pose), np.zeros((len(regions), n)), np.zeros((len(regions), n))
    for row, (region, posterior) in enumerate(zip(regions, posteriors, strict=True)):
        part = synthesis.parts(posed, region)
        shown = part >= 0
        owner = synthesis.segment_of_part[part[shown]]
        pixels[row] = np.bincount(owner, minlength=n)
        inside[row] = np.bincount(owner, posterior[shown], minlength=n)
    usual = inside.sum() / max(pixels.sum(), 1)
    is_astray = np.any((pixels >= _FEWEST_PX) & (inside < _ASTRAY * usual * pixels), axis=0)
    limb = limb_of_segment(synthesis.model)
    return [np.flatnonzero(limb == each) for each in np.unique(limb[is_astray & (limb >= 0)])]


def look_for(synthesis: Synthesis, poses: Sequence[Pose], limb: NDArray[np.int64], maps: EvidenceMaps) -> list[Pose]:
    """Return the poses that explain the evidence best when one limb moves from where the given poses have it.

    The poses differ in that limb only.
    """
    model, joints = synthesis.model, limb - 1
    root = poses[0].world_from_root
    angles = np.stack([pose.joint_angles for pose in poses])  # (candidates, joints, 3)
    half = np.diff(model.limits_rad[joints], axis=-1).ravel() / 2  # a hinge is looked for along its one turn
    reach = np.minimum(half / 2, _REACH_RAD)
    for number, (n_proposals, n_kept) in enumerate(_ROUNDS):
        steps = ndtri(qmc.Sobol(3 * len(limb), rng=number).random(n_proposals)) * reach / 2**number
        proposed = angles[np.arange(n_proposals) % len(angles)]
        bent = np.ascontiguousarray(proposed[:, joints]).reshape(-1, 3)
        proposed[:, joints] = turned(bent, steps.reshape(-1, 3)).reshape(n_proposals, len(limb), 3)
        angles = np.concatenate([angles, np.clip(proposed, *np.moveaxis(model.limits_rad, -1, 0))])
        R = np.broadcast_to(root.rotation.as_matrix(), (len(angles), 3, 3))
        t = np.broadcast_to(root.translation, (len(angles), 3))
        scores = mask_evidence(synthesis.geometry, maps, *place_segments(model, R, t, angles)).sum(axis=1)
        angles = angles[np.argsort(-scores, kind="stable")[:n_kept]]
    return [replace(poses[0], joint_angles=each) for each in angles]
