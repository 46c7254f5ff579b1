"""The score as a function of each variable's offset from its true value (paper B, figs 5 and 6)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import RigidTransform

from airborne.body import surface_arrays
from airborne.geometry.rotations import matrix_from_angles
from airborne.rendering import pack_targets, score
from airborne.reproduction.rigid.somersaults import Experiment, root_vector
from airborne.types import Array

_REACH = np.array([0.3] * 3 + [np.pi / 3] * 3)  # either way [m], [rad]
_STEPS = 30  # either way: 10 mm, 2 degrees
_COLUMNS = (2, 1, 0, 3, 4, 5)  # of x, y, z, somersault, tilt, twist, in the order of `VARIABLES`


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """The score over each variable's offset, of every pose."""

    variable: int  # of `VARIABLES`
    offset: Array  # (k,) [mm] or [deg], increasing, 0 in the middle
    scores: Array  # (poses, k) [grey levels]

    @property
    def half_widths(self) -> Array:
        """Half-width of each pose's basin of convergence: (poses,) [mm] or [deg]."""
        return np.array([half_width(self.offset, each) for each in self.scores])


def half_width(offset: Array, values: Array) -> float:
    """Return the distance from the lowest value to the nearer of the first falls on either side; to the end if none.

    A search that starts inside, in steps of the offsets' spacing (k,), cannot miss the minimum.
    """
    low = int(np.argmin(values))
    right = np.flatnonzero(np.diff(values[low:]) < 0)
    left = np.flatnonzero(np.diff(values[low::-1]) < 0)
    ends = [offset[low + right[0]] if len(right) else offset[-1], offset[low - left[0]] if len(left) else offset[0]]
    return float(min(ends[0] - offset[low], offset[low] - ends[1]))


def score_curves(experiment: Experiment, progress: Callable[[], None] = lambda: None) -> list[Curve]:
    """Score every pose with each variable at a time off its true value; progress is called after every pose."""
    flat, model = surface_arrays(experiment.model), experiment.model
    shares = np.linspace(-1, 1, 2 * _STEPS + 1)
    scores = np.empty((6, len(experiment.poses), len(shares)))
    for number, (frame, true) in enumerate(zip(experiment.frames, experiment.poses, strict=True)):
        target = pack_targets(frame.views, experiment.lights)
        upright = model.with_pose(replace(true, world_from_root=RigidTransform.identity()))
        for variable, column in enumerate(_COLUMNS):
            vectors = np.tile(root_vector(true), (len(shares), 1))
            vectors[:, column] += shares * _REACH[column]
            rotations = matrix_from_angles(vectors[:, 3:])[:, None]
            positions = (rotations @ upright.t[..., None])[..., 0] + vectors[:, None, :3]
            scores[variable, number] = score(flat, target, rotations @ upright.R, positions)
        progress()
    reach = np.concatenate([1e3 * _REACH[:3], np.degrees(_REACH[3:])])
    return [Curve(variable, shares * reach[column], scores[variable]) for variable, column in enumerate(_COLUMNS)]
