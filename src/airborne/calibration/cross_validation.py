"""What was left out of a fit, and how far it lies from where the fit expects it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from airborne.calibration.bundle import ALL_FIXED, Adjustment, Source, adjust
from airborne.errors import CalibrationError
from airborne.types import Array, Ints

_N_FOLDS = 3
_BLOCK_MOMENTS = 8  # moments that go together where they say of each other how the board moves


def cross_validate(adjustment: Adjustment, progress: Callable[[int, int], None]) -> dict[str, Array]:
    """Return by source the distances [px] of observations from cameras fitted without them.

    Left out together: a board's moment with all its views, a point with all its views, points tied by a length. Their
    own places are found from them, the cameras stay; a known point is simply projected. NaN where nothing can be told.
    """
    sources = adjustment.with_estimated_noise()
    units = [observation_groups(source) for source in sources]
    missed = {source.name: np.full(len(source.px), np.nan) for source in sources}
    for fold in range(_N_FOLDS):
        left = [_fold(s, unit) == fold for s, unit in zip(sources, units, strict=True)]
        kept = [s.select(~out) for s, out in zip(sources, left, strict=True)]
        try:
            cameras = adjust(adjustment.rig, kept, adjustment.free, prior=adjustment.prior).rig
            for source, out in zip(sources, left, strict=True):
                if out.any():
                    found = adjust(cameras, [source.select(out)], ALL_FIXED)
                    missed[source.name][out] = np.linalg.norm(found.residual_px[0], axis=1)
        except CalibrationError:
            continue  # too little is left: these distances stay unknown
        progress(fold + 1, _N_FOLDS)
    return missed


def _fold(source: Source, unit: Ints) -> Ints:
    return unit // (1 if source.lags is None else _BLOCK_MOMENTS) % _N_FOLDS


def observation_groups(source: Source) -> Ints:
    """Return to which unit each observation belongs (n,), numbered from 0: what is left out together."""
    p, m = len(source.points), source.n_moments
    nodes = np.where(source.moments >= 0, p + source.moments, source.point)
    first = np.zeros(0, int) if source.lengths is None else source.lengths.first
    second = np.zeros(0, int) if source.lengths is None else source.lengths.second
    ties = coo_array((np.ones(len(first)), (first, second)), shape=(p + m, p + m))
    _, label = connected_components(ties, directed=False)
    return np.unique(label[nodes], return_inverse=True)[1]
