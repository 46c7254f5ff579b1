"""Global search around the predicted poses: propose, score by evidence, select, propose closer to those."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.special import ndtri

from airborne.appearance.foreground import log_odds
from airborne.appearance.model import Appearance, Region
from airborne.body import Pose
from airborne.geometry.sampling import latin_hypercube
from airborne.rendering import EvidenceMaps, evidence_maps, mask_evidence
from airborne.tracking.image_regions import crop_regions
from airborne.tracking.model_based.render_model import RenderModel, reduce_region
from airborne.types import Array, Array32
from airborne.video import Frames

_ROUNDS = ((1024, 32), (512, 16), (256, 8))  # proposals, survivors; the sds are halved in each round
_REDUCTION = 4  # of the images
_MOST_REGION_M = 1.0  # no region's margin is larger than this


@dataclass(frozen=True, slots=True)
class SearchRange:
    """How far from the prediction the body may be: standard deviations of the first proposals."""

    position_sd_m: float
    rotation_sd_rad: float

    @classmethod
    def after(cls, gap_s: float) -> SearchRange:
        """Return the range for a time since the body was last found."""
        return cls(min(0.08 + 1.5 * gap_s, 0.5), min(0.25 + 5.0 * gap_s, 1.5))


def search_globally(
    render_model: RenderModel,
    guesses: Sequence[Pose],
    frames: Frames,
    appearance: Appearance,
    *,
    search_range: SearchRange,
    thrift: int = 1,
) -> list[Pose]:
    """Return the best poses with the guesses' joints and moved roots, best first; the guesses if no view shows any.

    thrift divides the numbers of proposals.
    """
    bodies = [render_model.with_pose(guess) for guess in guesses]
    margin_px = min(2.5 * search_range.position_sd_m, _MOST_REGION_M) * _px_per_m(guesses[0], frames)
    regions = crop_regions(bodies, render_model.geometry, frames, margin_px, appearance)
    regions = [region for region in regions if appearance.has_colours(region)]
    if not regions:
        return list(guesses)
    maps = region_evidence(regions, [appearance.posterior(region) for region in regions])
    # candidates: which guess each comes from, and its root's delta from there
    origin, deltas = np.arange(len(guesses)), np.zeros((len(guesses), 6))
    R, t = np.stack([body.R for body in bodies]), np.stack([body.t for body in bodies])
    width = np.array([search_range.position_sd_m] * 3 + [search_range.rotation_sd_rad] * 3)
    for number, (n_proposals, n_survivors) in enumerate(_ROUNDS):
        steps = ndtri(latin_hypercube(6, n_proposals // thrift, seed=number)) * width / 2**number
        parents = np.arange(n_proposals // thrift) % len(origin)
        moved = np.concatenate(
            [deltas[parents, :3] + steps[:, :3], _compose_rotations(steps[:, 3:], deltas[parents, 3:])], axis=1
        )
        origin, deltas = np.concatenate([origin, origin[parents]]), np.concatenate([deltas, moved])
        transforms = _move_bodies(R[origin], t[origin], deltas)
        scores = mask_evidence(render_model.geometry, maps, *transforms).sum(axis=1)
        best = np.argsort(-scores, kind="stable")[:n_survivors]
        origin, deltas = origin[best], deltas[best]
    return [guesses[int(i)].move(delta[:3], delta[3:]) for i, delta in zip(origin, deltas, strict=True)]


def _compose_rotations(later: Array, earlier: Array) -> Array:
    """Compose rotation vectors (n, 3) in world axes, the earlier first."""
    return (Rotation.from_rotvec(later) * Rotation.from_rotvec(earlier)).as_rotvec()


def _move_bodies(R: Array, t: Array, deltas: Array) -> tuple[Array, Array]:
    """Move bodies R (n, s, 3, 3), t (n, s, 3) by deltas (n, 6) of their roots."""
    rotations = Rotation.from_rotvec(deltas[:, 3:]).as_matrix()[:, None]
    origin = t[:, :1]
    return rotations @ R, (rotations @ (t - origin)[..., None])[..., 0] + origin + deltas[:, None, :3]


def _px_per_m(pose: Pose, frames: Frames) -> float:
    """Return the largest scale at which a view shows the body's root."""
    scales = [
        view.camera.K[0, 0] / max(view.camera.camera_from_world.apply(pose.world_from_root.translation)[2], 0.1)
        for view in frames.views
        if view is not None
    ]
    return float(max(scales, default=0.0))


def region_evidence(regions: Sequence[Region], posteriors: Sequence[Array32]) -> EvidenceMaps:
    """Turn the posteriors (h, w) of the regions into reduced maps of evidence [nats]."""
    cameras, planes = [], []
    for region, posterior in zip(regions, posteriors, strict=True):
        camera, plane = reduce_region(region, posterior, _REDUCTION)
        cameras.append(camera)
        planes.append(np.empty_like(plane))
        log_odds(plane, planes[-1])
    return evidence_maps(cameras, planes)
