"""Events of one path over time, to a fraction of a frame: when it passes a level, where it is highest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]


def crossings(time_s: Array, values: Array, level: float, *, rising: bool = True) -> Array:
    """Return when a path (n,) passes a level upward, or downward [s]: on the line between two known frames."""
    above = (values - level) if rising else (level - values)
    before = np.flatnonzero((above[:-1] < 0) & (above[1:] >= 0))
    share = above[before] / (above[before] - above[before + 1])
    return time_s[before] + share * (time_s[before + 1] - time_s[before])


def highest(time_s: Array, values: Array) -> tuple[float, float]:
    """Return when a path (n,) is highest [s], and how high: the top of the parabola through the three frames there.

    The frame itself where it is the first or last known one, or its neighbours are unknown; NaN where nothing is known.
    """
    if not np.isfinite(values).any():
        return np.nan, np.nan
    k = int(np.nanargmax(values))
    if not 0 < k < len(values) - 1 or not np.isfinite(values[[k - 1, k + 1]]).all():
        return float(time_s[k]), float(values[k])
    u = time_s[k - 1 : k + 2] - time_s[k]
    a, b, c = np.linalg.solve(np.vander(u, 3), values[k - 1 : k + 2])
    top = float(np.clip(-b / (2 * a), u[0], u[2])) if a < 0 else 0.0
    return float(time_s[k]) + top, float(a * top**2 + b * top + c)
