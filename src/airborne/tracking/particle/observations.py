"""Image regions around a player, and how similar a hypothesis' parts are to their references there (equation 6)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.appearance.hue_saturation import look_up
from airborne.tracking.particle.image_regions import ImageRegion
from airborne.tracking.particle.references import References
from airborne.tracking.particle.rods import compare_rods
from airborne.tracking.particle.view_likelihood import (
    STIFFNESS,
    combine_views,
    detection,
    mix_with_background,
    recognition,
)
from airborne.types import Array, Array32, Floats


@dataclass(frozen=True, slots=True, eq=False)
class LegsObservation:
    """One player's image regions at one time, as codes, with the references to compare them to."""

    references: References
    regions: tuple[ImageRegion | None, ...]
    codes: tuple[NDArray[np.uint16] | None, ...]
    used: NDArray[np.bool_]  # (parts, views): which cameras count for a part
    stiffness: float = STIFFNESS
    is_robust: bool = False  # to occlusion

    @property
    def n_views(self) -> int:
        """Number of cameras that count for any part."""
        return int(self.used.any(axis=0).sum())

    def log_likelihood(self, ends: Array, parts: Sequence[int]) -> Floats:
        """Return equation 6 of every rod: ends (n, k, 2, 3) [m] of k parts -> (n, k) [nat]."""
        parts = list(parts)
        overlap, share = self.compare(ends, parts)
        detected, recognised = detection(overlap, self.stiffness), recognition(share)
        if self.is_robust:
            background = self.references.background_overlap[:, parts].T, self.references.background_share[:, parts].T
            detected = mix_with_background(detected, detection(background[0], self.stiffness))
            recognised = mix_with_background(recognised, recognition(background[1]))
        return combine_views(detected, recognised, self.used[parts])

    def compare(self, ends: Array, parts: Sequence[int]) -> tuple[Array32, Array32]:
        """Return overlap and share of every rod in every view: (n, k, views); zeros without an image."""
        n, k = ends.shape[:2]
        overlap, share = np.zeros((2, len(self.codes), n, k), np.float32)
        ends = np.ascontiguousarray(ends, float)
        for v, (codes, region) in enumerate(zip(self.codes, self.regions, strict=True)):
            if codes is not None and region is not None:
                compare_rods(
                    codes,
                    region.corner,
                    region.projection,
                    region.focal_px,
                    ends,
                    self.references.parts.widths_m[parts],
                    self.references.roots[v][parts],
                    self.references.parts.classes[parts],
                    overlap[v],
                    share[v],
                )
        return np.moveaxis(overlap, 0, -1), np.moveaxis(share, 0, -1)


def observe(
    references: References,
    regions: Sequence[ImageRegion | None],
    used: NDArray[np.bool_],
    *,
    tempered: bool = False,
    is_robust: bool = False,
) -> LegsObservation:
    """Encode the regions that any part uses; `used` (parts, views) is cleared where there is no region."""
    codes = tuple(
        look_up(region.rgb, references.tables[v]) if region is not None and used[:, v].any() else None
        for v, region in enumerate(regions)
    )
    used = used & np.array([code is not None for code in codes])
    stiffness = STIFFNESS / np.sqrt(max(used.any(axis=0).sum(), 1)) if tempered else STIFFNESS
    return LegsObservation(references, tuple(regions), codes, used, float(stiffness), is_robust)
