"""Whether the body was found: precision and recall of its mask over the pixels that look like it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.appearance.foreground import posterior_sums as view_agreement
from airborne.appearance.model import Region
from airborne.body import PosedBody
from airborne.tracking.estimate import Doubt
from airborne.tracking.model_based.render_model import RenderModel

_NEAR_PX = 12  # of a full frame: body-like pixels this close to the mask's bounding box count in the recall
_FEWEST_PX = 20  # a smaller mask does not count as visible
UNCERTAIN_SD_M = 0.05  # of the root's position, above which an estimate is uncertain
_REFERENCE_RATE = 0.2  # weight of the newest frame in the running reference
# shares of the reference's precision and recall, below which ...
_SEARCH, _UNCERTAIN, _LOST = (0.95, 0.92), (0.85, 0.8), (0.5, 0.4)
_UNCERTAIN_AT_FIRST = 0.85, 0.6  # there is no background model yet: clutter of the body's colours lowers the recall


@dataclass(frozen=True, slots=True)
class Reference:
    """Running reference: precision and recall of a correctly estimated body in this recording."""

    precision: float = 0.9
    recall: float = 0.9
    is_learned: bool = False  # from frames of this recording

    def update(self, precision: float, recall: float) -> Reference:
        """Return the reference updated by the newest frame's."""
        return Reference(
            (1 - _REFERENCE_RATE) * self.precision + _REFERENCE_RATE * precision,
            (1 - _REFERENCE_RATE) * self.recall + _REFERENCE_RATE * recall,
            True,
        )

    def is_met(self, shares: tuple[float, float] | None, least: float) -> bool:
        """Whether precision and recall, if they are known, are at least a share of the reference's."""
        return shares is not None and shares[0] >= least * self.precision and shares[1] >= least * self.recall


@dataclass(frozen=True, slots=True)
class MaskAgreement:
    """How well a pose's mask agrees with the pixels that look like the body, over all views."""

    precision: float  # share of the mask that looks like the body
    recall: float  # share of the body-like pixels near the mask that it covers
    evidence: float  # sum over the mask [nats]
    n_views: int  # views in which the body is visible
    misplaced: tuple[int, ...] = ()  # segments of misplaced limbs
    n_views_of: NDArray[np.int64] | None = None  # (segments,) views that show each; None where no joint moves

    @property
    def shares(self) -> tuple[float, float]:
        """Precision and recall."""
        return self.precision, self.recall

    def is_suspect(self, reference: Reference) -> bool:
        """Whether a global search is worth while."""
        return self.falls_short(reference, _SEARCH)

    def is_poor(self, reference: Reference) -> bool:
        """Whether the fit is uncertain, and most likely wrong."""
        return self.falls_short(reference, _UNCERTAIN)

    def falls_short(self, reference: Reference, shares: tuple[float, float]) -> bool:
        """Whether precision or recall are below these shares of the reference's."""
        return self.precision < shares[0] * reference.precision or self.recall < shares[1] * reference.recall


def mask_agreement(
    render_model: RenderModel, posed: PosedBody, regions: Sequence[Region], posteriors: Sequence[NDArray]
) -> MaskAgreement:
    """Compare a body with the posteriors (h, w) of the regions."""
    pixels = inside = near = evidence = 0.0
    n_views = 0
    for region, posterior in zip(regions, posteriors, strict=True):
        part = render_model.draw_parts(posed, region)
        margin_v = max(1, round(_NEAR_PX * region.aspect))
        px, sum_inside, sum_near, nats = view_agreement(posterior, part, _NEAR_PX, margin_v)
        pixels, inside, near, evidence = pixels + px, inside + sum_inside, near + sum_near, evidence + nats
        n_views += px >= _FEWEST_PX
    return MaskAgreement(float(inside / max(pixels, 1)), float(inside / max(near, 1e-9)), float(evidence), n_views)


def is_lost(agreement: MaskAgreement, reference: Reference) -> bool:
    """Tell whether a fit agrees so little with the images, compared with the reference, that the body is lost."""
    return agreement.n_views == 0 or agreement.falls_short(reference, _LOST)


def doubts_of(covariance: NDArray, agreement: MaskAgreement, reference: Reference) -> Iterator[Doubt]:
    """Yield why a fit is uncertain, by the reference's agreement, and by its covariance, position [m] first."""
    if agreement.falls_short(reference, _UNCERTAIN if reference.is_learned else _UNCERTAIN_AT_FIRST):
        yield Doubt.IMAGES
    if np.any(np.sqrt(np.diag(covariance)[:3]) > UNCERTAIN_SD_M):
        yield Doubt.POSITION
    if agreement.misplaced and not reference.is_learned:
        yield Doubt.LIMBS
