"""Search round the predicted poses when the body was missed: propose, score by evidence, keep, propose closer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.special import ndtri
from scipy.stats import qmc

from airborne.appearance.foreground import evidence
from airborne.appearance.model import Appearance, Region
from airborne.body import Pose
from airborne.rendering import EvidenceMaps, evidence_maps, mask_evidence
from airborne.tracking.image_regions import regions_round
from airborne.tracking.model_based.render_model import Synthesis, reduced_region
from airborne.video import Frames

Array = NDArray[np.floating]

_ROUNDS = ((1024, 32), (512, 16), (256, 8))  # proposals, kept; each round half as wide
_REDUCTION = 4  # of the pictures
_MOST_REGION_M = 1.0  # no region is widened by more than this


@dataclass(frozen=True, slots=True)
class Reach:
    """How far from the prediction the body may be: standard deviations of the first proposals."""

    position_sd_m: float
    rotation_sd_rad: float

    @classmethod
    def after(cls, gap_s: float) -> Reach:
        """Grow with the time since the body was last seen."""
        return cls(min(0.08 + 1.5 * gap_s, 0.5), min(0.25 + 5.0 * gap_s, 1.5))


def search_widely(
    synthesis: Synthesis, guesses: Sequence[Pose], frames: Frames, appearance: Appearance, reach: Reach
) -> list[Pose]:
    """Return the best poses found by moving the guesses' roots, best first; the guesses where no view sees them."""
    bodies = [synthesis.place(guess) for guess in guesses]
    margin_px = min(2.5 * reach.position_sd_m, _MOST_REGION_M) * _px_per_m(guesses[0], frames)
    regions = [r for r in regions_round(bodies, synthesis.geometry, frames, margin_px) if appearance.knows(r)]
    if not regions:
        return list(guesses)
    maps = evidence_of(regions, [appearance.posterior(region) for region in regions])
    # candidates: which guess each comes from, and how far its root has moved from there
    origin, motions = np.arange(len(guesses)), np.zeros((len(guesses), 6))
    R, t = np.stack([body.R for body in bodies]), np.stack([body.t for body in bodies])
    width = np.array([reach.position_sd_m] * 3 + [reach.rotation_sd_rad] * 3)
    for number, (n_proposals, n_kept) in enumerate(_ROUNDS):
        steps = ndtri(qmc.Sobol(6, rng=number).random(n_proposals)) * width / 2**number
        parents = np.arange(n_proposals) % len(origin)
        moved = np.concatenate(
            [motions[parents, :3] + steps[:, :3], _after(steps[:, 3:], motions[parents, 3:])], axis=1
        )
        origin, motions = np.concatenate([origin, origin[parents]]), np.concatenate([motions, moved])
        placed = _moved(R[origin], t[origin], motions)
        scores = mask_evidence(synthesis.geometry, maps, *placed).sum(axis=1)
        best = np.argsort(-scores, kind="stable")[:n_kept]
        origin, motions = origin[best], motions[best]
    return [guesses[int(i)].moved(motion[:3], motion[3:]) for i, motion in zip(origin, motions, strict=True)]


def _after(later: Array, earlier: Array) -> Array:
    """Return the rotation vectors (n, 3) of two turns in world axes, one after the other."""
    return (Rotation.from_rotvec(later) * Rotation.from_rotvec(earlier)).as_rotvec()


def _moved(R: Array, t: Array, motions: Array) -> tuple[Array, Array]:
    """Move bodies R (n, s, 3, 3), t (n, s, 3) by motions (n, 6) of their roots."""
    turns = Rotation.from_rotvec(motions[:, 3:]).as_matrix()[:, None]
    origin = t[:, :1]
    return turns @ R, (turns @ (t - origin)[..., None])[..., 0] + origin + motions[:, None, :3]


def _px_per_m(pose: Pose, frames: Frames) -> float:
    """Return the largest scale at which a view shows the body's root."""
    scales = [
        view.camera.K[0, 0] / max(view.camera.camera_from_world.apply(pose.world_from_root.translation)[2], 0.1)
        for view in frames.views
        if view is not None
    ]
    return float(max(scales, default=0.0))


def evidence_of(regions: Sequence[Region], posteriors: Sequence[Array]) -> EvidenceMaps:
    """Turn the posteriors (h, w) of the regions into reduced maps of evidence [nats]."""
    cameras, planes = [], []
    for region, posterior in zip(regions, posteriors, strict=True):
        camera, plane = reduced_region(region, posterior, _REDUCTION)
        cameras.append(camera)
        planes.append(np.empty_like(plane))
        evidence(plane, planes[-1])
    return evidence_maps(cameras, planes)
