"""Single poses of a thing that lie beside the path of those around them, and look less like the pictures than they do.

So does one whose picture is of another moment: repeated, or of a camera that was late for a while. A thing that bounces
leaves the path of its neighbours too, but looks like its pictures.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airborne.geometry.sampling import chi2_quantile
from airborne.tracking.self_check.path import TrackedPath
from airborne.types import Array

_AROUND = 4  # poses: a cubic has as many numbers
_WIDEST = 6  # chosen: frames that they may span, as no cubic follows a thing for longer
_FEWEST = 8  # chosen: poses of a run whose scatter is known
_QUIET = 0.25  # chosen: quantile of distances that tells the scatter, as each stray makes eight others large
# chosen: on ten throws with one to seventeen pictures repeated, lost or late the worst poses have 25 to 147 and 1.2 to
# 1.4, on 26 right ones the farthest has 11 and 1.12; distance in sds of one axis, score over that of the poses around
_FAR_SDS, _LEAST_UNLIKE = 14.0, 1.15


def find_strays(path: TrackedPath, scores: Array) -> NDArray[np.bool_]:
    """Tell which poses are strays, by scores (n,) of the frames: (n,)."""
    n = len(path.index)
    if n < _FEWEST:
        return np.zeros(n, bool)
    around = _rows_around(n)
    spans = np.ptp(np.column_stack([path.index[around], path.index]), axis=1)
    period = np.median(np.diff(path.index))
    weights = _cubic_weights(path.time_s[around] - path.time_s[:, None])
    rotations = Rotation.from_matrix(path.rotations)
    own = np.repeat(np.arange(n), _AROUND)
    vectors = (rotations[own].inv() * rotations[around.ravel()]).as_rotvec().reshape(n, _AROUND, 3)
    is_far = np.zeros(n, bool)
    for offsets in (path.positions[around] - path.positions[:, None], vectors):
        distances = np.linalg.norm(np.einsum("nk,nkd->nd", weights, offsets), axis=1)
        distances /= np.sqrt(1 + np.sum(weights**2, axis=1))  # of an sd that is each pose's
        scatter = np.quantile(distances, _QUIET) / np.sqrt(chi2_quantile(_QUIET, 3))
        is_far |= distances > _FAR_SDS * scatter
    is_unlike = scores > _LEAST_UNLIKE * scores[around].mean(axis=1)
    return is_far & is_unlike & (spans <= _WIDEST * period)


def _rows_around(n: int) -> NDArray[np.intp]:
    """Return, for each of n rows, those around it without its own: (n, 4)."""
    rows = np.arange(n)
    windows = np.clip(rows - _AROUND // 2, 0, n - _AROUND - 1)[:, None] + np.arange(_AROUND + 1)
    return windows[windows != rows[:, None]].reshape(n, _AROUND)


def _cubic_weights(times_s: Array) -> Array:
    """Return what values at times (n, 4) count for in the cubic's at time 0: (n, 4)."""
    factors = times_s[:, None, :] / (times_s[:, None, :] - times_s[:, :, None] + np.eye(_AROUND))
    return np.prod(np.where(np.eye(_AROUND, dtype=bool), 1.0, factors), axis=2)
