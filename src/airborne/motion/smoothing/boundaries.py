"""Events of one path over time, to a fraction of a frame: crossings of a level, the peak."""

from __future__ import annotations

import numpy as np

from airborne.types import Array


def crossings(time_s: Array, values: Array, level: float, *, rising: bool = True) -> Array:
    """Return when a path (n,) crosses a level upward or downward [s], by linear interpolation of known frames."""
    above = (values - level) if rising else (level - values)
    before = np.flatnonzero((above[:-1] < 0) & (above[1:] >= 0))
    share = above[before] / (above[before] - above[before + 1])
    return time_s[before] + share * (time_s[before + 1] - time_s[before])


def parabolic_peak(time_s: Array, values: Array) -> tuple[float, float]:
    """Return time [s] and height of the peak of a path (n,): the apex of the parabola through the three highest frames.

    The highest frame itself if it is the first or last, or a neighbour is unknown; NaN where nothing is known.
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
