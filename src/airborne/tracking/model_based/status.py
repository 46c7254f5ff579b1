"""Whether the body was found: how well its mask and the pixels that look like it agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.appearance.foreground import agreement as view_agreement
from airborne.appearance.model import Region
from airborne.body import PosedBody
from airborne.tracking.estimate import Status
from airborne.tracking.model_based.render_model import Synthesis

_NEAR_PX = 12  # of a full frame: body-like pixels this close to the mask's box should be in the mask
_FEWEST_PX = 20  # a mask smaller than this does not count as seen
_UNCERTAIN_SD_M = 0.05
_NEWEST = 0.2  # share of the newest frame in what is usual
# shares of the usual agreement, inside and found, below which ...
_SEARCH, _UNCERTAIN, _LOST = (0.95, 0.92), (0.85, 0.8), (0.5, 0.4)
_UNCERTAIN_AT_FIRST = 0.85, 0.6  # the empty scene is not known yet: what is coloured like the body counts as found


@dataclass(frozen=True, slots=True)
class Usual:
    """The agreement of a body that is where it is said to be, in this recording."""

    inside: float = 0.9
    found: float = 0.9
    is_learned: bool = False  # from frames of this recording

    def learned(self, agreed: Agreement) -> Usual:
        """Follow the newest frame."""
        return Usual(
            (1 - _NEWEST) * self.inside + _NEWEST * agreed.inside,
            (1 - _NEWEST) * self.found + _NEWEST * agreed.found,
            True,
        )


@dataclass(frozen=True, slots=True)
class Agreement:
    """How well a pose explains which pixels look like the body, over all views."""

    inside: float  # share of the mask that looks like the body
    found: float  # share of the body-like pixels near the mask that it covers
    evidence: float  # sum over the mask [nats]
    n_views: int  # views in which the body is seen
    astray: tuple[int, ...] = ()  # segments of limbs that lie on pixels unlike the body

    def is_suspect(self, usual: Usual) -> bool:
        """Whether it is worth looking elsewhere."""
        return self.falls_short(usual, _SEARCH)

    def falls_short(self, usual: Usual, shares: tuple[float, float]) -> bool:
        """Whether less than these shares of the usual agreement, inside and found, are left."""
        return self.inside < shares[0] * usual.inside or self.found < shares[1] * usual.found


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
    return Agreement(float(inside / max(pixels, 1)), float(inside / max(near, 1e-9)), float(evidence), n_views)


def status_of(covariance: NDArray, agreed: Agreement, usual: Usual) -> Status:
    """Judge a fit by how far its agreement lies below the usual one, and by its covariance, position [m] first."""
    if agreed.n_views == 0 or agreed.falls_short(usual, _LOST):
        return Status.LOST
    position_sd = np.sqrt(np.diag(covariance)[:3])
    shares = _UNCERTAIN if usual.is_learned else _UNCERTAIN_AT_FIRST
    if agreed.falls_short(usual, shares) or np.any(position_sd > _UNCERTAIN_SD_M):
        return Status.UNCERTAIN
    return Status.TRACKED
