"""Cross-validation: how far observations lie from the predictions of cameras fitted without them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from airborne.calibration.bundle import ALL_FIXED, Adjustment, Source, adjust
from airborne.errors import CalibrationError
from airborne.types import Array, Ints

_N_FOLDS = 3  # parts of the recording, each left out once
_BLOCK_MOMENTS = 8  # successive moments in one fold, where lags relate them by the board's motion


def cross_validate(adjustment: Adjustment, progress: Callable[[int, int], None]) -> dict[str, Array]:
    """Return by source the distances [px] of observations from their predictions by cameras fitted without them.

    Held out together: all views of a board's moment, all views of a point, points connected by a length. Their own
    poses and positions are fitted to them with fixed cameras; a known point is simply projected. NaN where impossible.
    """
    sources = adjustment.with_estimated_noise()
    groups = [observation_groups(source) for source in sources]
    distances = {source.name: np.full(len(source.px), np.nan) for source in sources}
    for fold in range(_N_FOLDS):
        is_held_out = [_fold(s, group) == fold for s, group in zip(sources, groups, strict=True)]
        training = [s.select(~is_out) for s, is_out in zip(sources, is_held_out, strict=True)]
        try:
            cameras = adjust(adjustment.rig, training, adjustment.free, prior=adjustment.prior).rig
            for source, is_out in zip(sources, is_held_out, strict=True):
                if is_out.any():
                    validation = adjust(cameras, [source.select(is_out)], ALL_FIXED)
                    distances[source.name][is_out] = np.linalg.norm(validation.residual_px[0], axis=1)
        except CalibrationError:
            continue  # too little is left: these distances stay NaN
        progress(fold + 1, _N_FOLDS)
    return distances


def _fold(source: Source, group: Ints) -> Ints:
    return group // (1 if source.lags is None else _BLOCK_MOMENTS) % _N_FOLDS


def observation_groups(source: Source) -> Ints:
    """Return each observation's group (n,), numbered from 0: observations that are held out together."""
    p, m = len(source.points), source.n_moments
    nodes = np.where(source.moments >= 0, p + source.moments, source.point)
    first = np.zeros(0, int) if source.lengths is None else source.lengths.first
    second = np.zeros(0, int) if source.lengths is None else source.lengths.second
    ties = coo_array((np.ones(len(first)), (first, second)), shape=(p + m, p + m))
    _, label = connected_components(ties, directed=False)
    return np.unique(label[nodes], return_inverse=True)[1]
