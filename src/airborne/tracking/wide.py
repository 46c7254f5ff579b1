"""Search round the predicted poses when the body was missed: propose, score by evidence, keep, propose closer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.special import ndtri
from scipy.stats import qmc

from airborne.body import PosedBody
from airborne.rendering import EvidenceMaps, evidence_maps, mask_evidence
from airborne.scoring.foreground import evidence
from airborne.tracking.appearance import Appearance, Region
from airborne.tracking.gauss_newton import Synthesis, reduced_region
from airborne.tracking.regions import regions_round
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
    synthesis: Synthesis, guesses: Sequence[PosedBody], frames: Frames, appearance: Appearance, reach: Reach
) -> list[PosedBody]:
    """Return the best bodies found round the guesses, best first; the guesses where no view sees them."""
    margin_px = min(2.5 * reach.position_sd_m, _MOST_REGION_M) * _px_per_m(guesses[0], frames)
    regions = [r for r in regions_round(guesses, synthesis.geometry, frames, margin_px) if appearance.knows(r)]
    if not regions:
        return list(guesses)
    maps = _evidence(regions, appearance)
    R, t = np.stack([guess.R for guess in guesses]), np.stack([guess.t for guess in guesses])
    width = np.array([reach.position_sd_m] * 3 + [reach.rotation_sd_rad] * 3)
    for number, (n_proposals, n_kept) in enumerate(_ROUNDS):
        motions = ndtri(qmc.Sobol(6, rng=number).random(n_proposals)) * width / 2**number
        moved_R, moved_t = _moved(
            np.resize(R, (n_proposals, *R.shape[1:])), np.resize(t, (n_proposals, *t.shape[1:])), motions
        )
        R, t = np.concatenate([R, moved_R]), np.concatenate([t, moved_t])
        scores = mask_evidence(synthesis.geometry, maps, R, t).sum(axis=1)
        best = np.argsort(-scores, kind="stable")[:n_kept]
        R, t = R[best], t[best]
    return [PosedBody(synthesis.model, *place) for place in zip(R, t, strict=True)]


def _moved(R: Array, t: Array, motions: Array) -> tuple[Array, Array]:
    """Move bodies R (n, s, 3, 3), t (n, s, 3) by motions (n, 6), as `PosedBody.moved` does."""
    turns = Rotation.from_rotvec(motions[:, 3:]).as_matrix()[:, None]
    origin = t[:, :1]
    return turns @ R, (turns @ (t - origin)[..., None])[..., 0] + origin + motions[:, None, :3]


def _px_per_m(posed: PosedBody, frames: Frames) -> float:
    """Return the largest scale at which a view shows the body's root."""
    scales = [
        view.camera.K[0, 0] / max(view.camera.camera_from_world.apply(posed.t[0])[2], 0.1)
        for view in frames.views
        if view is not None
    ]
    return float(max(scales, default=0.0))


def _evidence(regions: Sequence[Region], appearance: Appearance) -> EvidenceMaps:
    cameras, planes = [], []
    for region in regions:
        camera, plane = reduced_region(region, appearance.posterior(region), _REDUCTION)
        cameras.append(camera)
        planes.append(np.empty_like(plane))
        evidence(plane, planes[-1])
    return evidence_maps(cameras, planes)
