"""Search round the predicted poses when the body was missed: propose, score by evidence, keep, propose closer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri
from scipy.stats import qmc

from airborne.body import PosedBody
from airborne.rendering.maps import empty_maps, surface_maps
from airborne.rendering.packing import packed_view
from airborne.scoring.foreground import agreement
from airborne.tracking.appearance import Appearance, Region
from airborne.tracking.gauss_newton import Synthesis
from airborne.tracking.regions import regions_round
from airborne.video import Frames

Array = NDArray[np.floating]

_ROUNDS = ((512, 32), (256, 16), (128, 8))  # proposals, kept; each round half as wide
_REDUCTION = 4  # of the pictures


@dataclass(frozen=True, slots=True)
class Reach:
    """How far from the prediction the body may be: standard deviations of the first proposals."""

    position_sd_m: float
    rotation_sd_rad: float

    @classmethod
    def after(cls, gap_s: float) -> Reach:
        """Grow with the time since the body was last seen."""
        return cls(min(0.08 + 1.0 * gap_s, 0.5), min(0.2 + 2.0 * gap_s, 1.2))


def search_widely(
    synthesis: Synthesis, guesses: Sequence[PosedBody], frames: Frames, appearance: Appearance, reach: Reach
) -> list[PosedBody]:
    """Return the best bodies found round the guesses, best first; the guesses where no view sees them."""
    margin_px = 2.5 * reach.position_sd_m * _px_per_m(guesses[0], frames)
    regions = [r for r in regions_round(guesses, synthesis.geometry, frames, margin_px) if appearance.knows(r)]
    if not regions:
        return list(guesses)
    views = [_evidence_view(region, appearance.posterior(region)) for region in regions]
    kept = list(guesses)
    width = np.array([reach.position_sd_m] * 3 + [reach.rotation_sd_rad] * 3)
    for number, (n_proposals, n_kept) in enumerate(_ROUNDS):
        motions = ndtri(qmc.Sobol(6, rng=number).random(n_proposals)) * width / 2**number
        proposals = kept + [kept[i % len(kept)].moved(motion) for i, motion in enumerate(motions)]
        scores = np.array([_score(synthesis, posed, views) for posed in proposals])
        kept = [proposals[i] for i in np.argsort(-scores, kind="stable")[:n_kept]]
    return kept


def _px_per_m(posed: PosedBody, frames: Frames) -> float:
    """Return the largest scale at which a view shows the body's root."""
    scales = [
        view.camera.K[0, 0] / max(view.camera.camera_from_world.apply(posed.t[0])[2], 0.1)
        for view in frames.views
        if view is not None
    ]
    return float(max(scales, default=0.0))


def _evidence_view(region: Region, posterior: Array) -> tuple[Array, Array, tuple]:
    rows = max(1, round(_REDUCTION * region.aspect))
    height, width = posterior.shape
    size = (width // _REDUCTION, height // rows)
    plane = cv2.resize(posterior[: size[1] * rows, : size[0] * _REDUCTION], size, interpolation=cv2.INTER_AREA)
    camera = region.camera.resampled(scale=(_REDUCTION, rows), offset=((_REDUCTION - 1) / 2, (rows - 1) / 2), size=size)
    return packed_view(camera), plane, empty_maps(size)


def _score(synthesis: Synthesis, posed: PosedBody, views: Sequence[tuple]) -> float:
    total = 0.0
    for packed, plane, maps in views:
        surface_maps(synthesis.shapes, synthesis.geometry, posed.R, posed.t, packed, *maps)
        total += agreement(plane, maps[0], 0, 0)[3]
    return total
