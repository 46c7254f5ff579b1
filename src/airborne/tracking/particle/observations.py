"""Pictures read near a player, and how like their references the parts of a hypothesis look there (equation 6)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.appearance.hue_saturation import look_up
from airborne.tracking.particle.image_regions import Region
from airborne.tracking.particle.references import References
from airborne.tracking.particle.rods import read_rods
from airborne.tracking.particle.view_likelihood import STIFFNESS, detection, over_views, recognition, unless_hidden

Array = NDArray[np.floating]


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """One player's regions at one time, as codes, with the references to compare them with."""

    references: References
    regions: tuple[Region | None, ...]
    codes: tuple[NDArray[np.uint16] | None, ...]
    used: NDArray[np.bool_]  # (parts, views): which cameras count for a part
    stiffness: float = STIFFNESS
    may_be_hidden: bool = False  # the robust form

    @property
    def n_views(self) -> int:
        """How many cameras count for any part."""
        return int(self.used.any(axis=0).sum())

    def log_likelihood(self, ends: Array, parts: Sequence[int]) -> Array:
        """Return equation 6 of every rod, ends (n, k, 2, 3) [m] of the k given parts: (n, k) [nat]."""
        parts = list(parts)
        overlap, share = self.read(ends, parts)
        detected, recognised = detection(overlap, self.stiffness), recognition(share)
        if self.may_be_hidden:
            background = self.references.background_overlap[:, parts].T, self.references.background_share[:, parts].T
            detected = unless_hidden(detected, detection(background[0], self.stiffness))
            recognised = unless_hidden(recognised, recognition(background[1]))
        return over_views(detected, recognised, self.used[parts])

    def read(self, ends: Array, parts: Sequence[int]) -> tuple[Array, Array]:
        """Return overlap and share of every rod in every view: (n, k, views); zeros where nothing was seen."""
        n, k = ends.shape[:2]
        overlap, share = np.zeros((2, len(self.codes), n, k), np.float32)
        ends = np.ascontiguousarray(ends, float)
        for v, (codes, region) in enumerate(zip(self.codes, self.regions, strict=True)):
            if codes is not None and region is not None:
                read_rods(
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


def look_at(
    references: References,
    regions: Sequence[Region | None],
    used: NDArray[np.bool_],
    *,
    tempered: bool = False,
    may_be_hidden: bool = False,
) -> Look:
    """Turn the regions into codes, where any part uses them; `used` (parts, views) counts only where a region is."""
    codes = tuple(
        look_up(region.rgb, references.tables[v]) if region is not None and used[:, v].any() else None
        for v, region in enumerate(regions)
    )
    used = used & np.array([code is not None for code in codes])
    stiffness = STIFFNESS / np.sqrt(max(used.any(axis=0).sum(), 1)) if tempered else STIFFNESS
    return Look(references, tuple(regions), codes, used, float(stiffness), may_be_hidden)
