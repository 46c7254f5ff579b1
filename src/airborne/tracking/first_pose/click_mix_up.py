"""Why the cameras' points of a start do not meet: two cameras' are exchanged, or are of images of another size."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from airborne.cameras import Rig
from airborne.cameras.consensus import OUTLIER_SHARE, triangulate_views
from airborne.types import Array

_FEWEST = 4  # chosen: points seen by two cameras or more, of which a few could meet by chance
_MISSING = 0.5  # chosen: of an outlier's limit, in the median; careful clicks in three cameras miss by 0.3
_BETTER, _CLEARER = 1 / 3, 1 / 2  # chosen: of what is missed now, and of what any other change leaves, that is left
_FACTORS = {2.0: "half as large", 0.5: "twice as large"}  # chosen: on pixels, and the images that were clicked


def explain_misses(rig: Rig, px: Array, weights: Array) -> str:
    """Say what would let points (points, cameras, 2) [px], NaN where not seen, meet; nothing where they do.

    weights: (points, cameras).
    """
    now = _miss(rig, px, weights)
    if not now > _MISSING:
        return ""
    changes = {}
    for i, j in combinations(range(len(rig)), 2):
        order = list(range(len(rig)))
        order[i], order[j] = j, i
        what = f"with the points of {rig.names[i]} and {rig.names[j]} exchanged"
        changes[what] = _miss(rig, px[:, order], weights[:, order])
    for factor, size in _FACTORS.items():
        what = f"as points of images {size} as the videos'"
        changes[what] = _miss(rig, (px + 0.5) * factor - 0.5, weights)
    best = min(changes, key=changes.__getitem__)
    others = [miss for what, miss in changes.items() if what != best]
    if changes[best] > min(_BETTER * now, 1.0) or changes[best] > _CLEARER * min(others, default=np.inf):
        return ""
    return (
        f"the cameras' points do not meet, but {best} they do: check in which camera's image, and of which size, each "
        "column was clicked"
    )


def _miss(rig: Rig, px: Array, weights: Array) -> float:
    """Return how far points lie from where their cameras meet, the median over the views, in limits of an outlier."""
    is_seen = np.isfinite(px).all(axis=-1) & (weights > 0)
    rows = np.flatnonzero(is_seen.sum(axis=1) >= 2)
    if len(rows) < _FEWEST:
        return np.nan
    _, distance_px = triangulate_views(rig, px[rows], np.where(is_seen, weights, 1.0)[rows], is_seen[rows])
    limit_px = OUTLIER_SHARE * np.array([max(camera.size) for camera in rig])
    return float(np.median(np.nan_to_num(distance_px / limit_px, nan=np.inf)[is_seen[rows]]))
