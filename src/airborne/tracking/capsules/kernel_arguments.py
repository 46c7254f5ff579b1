"""What the capsule kernels take: arrays with names."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np


class Capsules(NamedTuple):
    """Capsules in the world, such as those of other players."""

    ends: Any  # (m, 2, 3) [m]
    radii: Any  # (m, 2) [m]


NOBODY = Capsules(np.empty((0, 2, 3)), np.empty((0, 2)))


class Workspace(NamedTuple):
    """Outlines of n capsules in h rows; see `outline`."""

    x: Any  # (n, 2, h)
    pieces: Any  # (n, 2, h)
    tangents: Any  # (n, 2, 7)

    @classmethod
    def of(cls, n: int, h: int) -> Workspace:
        """Allocate it."""
        return cls(np.empty((n, 2, h)), np.empty((n, 2, h), np.int64), np.empty((n, 2, 7)))


class SummedMaps(NamedTuple):
    """Evidence maps of v views, as `capsule_evidence` takes those of each."""

    sums: Any  # (v, k + 1, h, w + 1) float32; the last map is empty
    contrast: Any  # (v, k + 1)


class Images(NamedTuple):
    """What all views show around a jumper."""

    cameras: Any  # (v, 4, 4) of the regions of the maps
    maps: SummedMaps
    others: Capsules  # of other players, who occlude what lies behind them
    classes: Any  # (10 + m, 2) surface classes of the jumper's capsules and of the others', see `classes_with`
    work: Workspace  # of all 10 + m capsules


class Equations(NamedTuple):
    """The points of a state and its normal equations, for its first n numbers."""

    points: Any  # (9, 3) [m]
    jacobian: Any  # (27, n) of the points
    gradient: Any  # (n,)
    curvature: Any  # (n, n)
    score_covariance: Any  # (n, n)

    @classmethod
    def of(cls, n_points: int, n: int) -> Equations:
        """Allocate them; n = 0: for the points alone."""
        points, jacobian = np.empty((n_points, 3)), np.empty((3 * n_points, n))
        return cls(points, jacobian, np.empty(n), np.empty((n, n)), np.empty((n, n)))
