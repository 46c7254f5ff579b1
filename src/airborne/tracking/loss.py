"""Whether the body was found: how well its mask and the pixels that look like it agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.body import PosedBody
from airborne.scoring.foreground import agreement as view_agreement
from airborne.tracking.appearance import Region
from airborne.tracking.estimate import Status
from airborne.tracking.gauss_newton import Fit, Synthesis

_NEAR_PX = 12  # of a full frame: body-like pixels this close to the mask's box should be in the mask
_FEWEST_PX = 20  # a mask smaller than this does not count as seen
GOOD_INSIDE, GOOD_FOUND = 0.8, 0.7
_LOST_INSIDE, _LOST_FOUND = 0.5, 0.35
_UNCERTAIN_SD_M = 0.05


@dataclass(frozen=True, slots=True)
class Agreement:
    """How well a pose explains which pixels look like the body, over all views."""

    inside: float  # share of the mask that looks like the body
    found: float  # share of the body-like pixels near the mask that it covers
    evidence: float  # sum over the mask [nats]
    n_views: int  # views in which the body is seen

    @property
    def is_good(self) -> bool:
        """Whether there is no reason to look elsewhere."""
        return self.inside >= GOOD_INSIDE and self.found >= GOOD_FOUND


def agreement(
    synthesis: Synthesis, posed: PosedBody, regions: Sequence[Region], posteriors: Sequence[NDArray]
) -> Agreement:
    """Compare a body with the posteriors (h, w) of the regions."""
    pixels = inside = near = evidence = 0.0
    n_views = 0
    for region, posterior in zip(regions, posteriors, strict=True):
        part = synthesis.parts(posed, region)
        margin_v = max(1, round(_NEAR_PX * region.aspect))
        px, sum_inside, sum_near, nats = view_agreement(posterior, part, _NEAR_PX, margin_v)
        pixels, inside, near, evidence = pixels + px, inside + sum_inside, near + sum_near, evidence + nats
        n_views += px >= _FEWEST_PX
    return Agreement(inside / max(pixels, 1), inside / max(near, 1e-9), evidence, n_views)


def status_of(fit: Fit, agreed: Agreement) -> Status:
    """Judge a fit: lost, where less than half of the mask looks like the body or most of what does lies outside it."""
    if agreed.n_views == 0 or agreed.inside < _LOST_INSIDE or agreed.found < _LOST_FOUND:
        return Status.LOST
    position_sd = np.sqrt(np.diag(fit.covariance)[:3])
    if not agreed.is_good or np.any(position_sd > _UNCERTAIN_SD_M):
        return Status.UNCERTAIN
    return Status.TRACKED
