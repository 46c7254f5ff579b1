"""How the score rises when one variable leaves its true value (paper B, figs 5 and 6)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from airborne.body import geometry
from airborne.geometry.rotations import matrix_from_angles
from airborne.rendering import score, targets
from airborne.reproduction.rigid.somersaults import Experiment, vector

Array = NDArray[np.floating]

REACH = np.array([0.3] * 3 + [np.pi / 3] * 3)  # either way [m], [rad]
STEPS = 30  # either way: 10 mm, 2 degrees
_COLUMNS = (2, 1, 0, 3, 4, 5)  # of x, y, z, somersault, tilt, twist, in the order of `VARIABLES`


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """The score over one variable's offset, of every pose."""

    variable: int  # of `VARIABLES`
    offset: Array  # (k,) [mm] or [deg], increasing, 0 in the middle
    scores: Array  # (poses, k) [grey levels]

    @property
    def half_widths(self) -> Array:
        """How far from its lowest point each pose's curve rises on both sides: (poses,) [mm] or [deg]."""
        return np.array([half_width(self.offset, one) for one in self.scores])


def half_width(offset: Array, values: Array) -> float:
    """Return how far the nearer of the two first falls on the way out from the lowest value lies; the end if none does.

    A search from within, in steps of the offsets' spacing (k,), cannot miss the minimum.
    """
    low = int(np.argmin(values))
    right = np.flatnonzero(np.diff(values[low:]) < 0)
    left = np.flatnonzero(np.diff(values[low::-1]) < 0)
    ends = [offset[low + right[0]] if len(right) else offset[-1], offset[low - left[0]] if len(left) else offset[0]]
    return float(min(ends[0] - offset[low], offset[low] - ends[1]))


def convergence(what: Experiment, progress: Callable[[], None] = lambda: None) -> list[Curve]:
    """Score every pose with one variable at a time off its true value; progress is called after every pose."""
    flat, model = geometry(what.model), what.model
    shares = np.linspace(-1, 1, 2 * STEPS + 1)
    scores = np.empty((6, len(what.poses), len(shares)))
    for number, (frame, true) in enumerate(zip(what.frames, what.poses, strict=True)):
        seen = targets(frame.views, what.lights)
        upright = model.with_pose(replace(true, world_from_root=RigidTransform.identity()))
        for variable, column in enumerate(_COLUMNS):
            vectors = np.tile(vector(true), (len(shares), 1))
            vectors[:, column] += shares * REACH[column]
            turns = matrix_from_angles(vectors[:, 3:])[:, None]
            places = (turns @ upright.t[..., None])[..., 0] + vectors[:, None, :3]
            scores[variable, number] = score(flat, seen, turns @ upright.R, places)
        progress()
    reach = np.concatenate([1e3 * REACH[:3], np.degrees(REACH[3:])])
    return [Curve(variable, shares * reach[column], scores[variable]) for variable, column in enumerate(_COLUMNS)]
