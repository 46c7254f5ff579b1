"""Where a person's landmarks lie: what one hand or network calls a hip, another places centimetres away.

The points of a start mark them on the person once; from there on they keep their places in the segments, as markers do
that a model is fitted to (OpenSim's scaling moves its markers to those of a static pose).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from airborne.body import BodyModel, Landmark, Pose
from airborne.body.sides import other_side
from airborne.body_fitting.fit import JOINT_SD_M
from airborne.tracking.first_pose import LANDMARK_WEIGHTS
from airborne.types import Array

# of a given point and of the fitted pose there: on eight synthetic people 18 to 25 mm lose nothing where the joints are
# those of the body, and gain most where they lie 20 or 30 mm beside
_POINT_SD_M = 0.02
_FARTHEST = 3.8  # sds of a point farther off than another definition is: 3 in a thousand normal errors in space
_MIRROR = np.array([-1.0, 1.0, 1.0])  # x is the subject's left


def place_landmarks(model: BodyModel, pose: Pose, points: Mapping[str, Array]) -> BodyModel:
    """Return the body with its landmarks moved toward points (3,) [m] of their names at a pose, left and right alike.

    How far another definition may lie is the sd of a point that a fit gives a landmark's weight; each shift is the
    expected one for what is seen of it, and points that lie farther off are mistakes. The pelvis, without a point of
    its own, lies midway between the hips.
    """
    hips = [points[name] for name in ("hip_left", "hip_right") if name in points]
    given = {"pelvis": np.mean(hips, axis=0), **points} if len(hips) == 2 else points
    posed = model.with_pose(pose)
    shifts = {
        mark.name: posed.R[model.index_of(mark.segment)].T @ (given[mark.name] - at)
        for mark, at in zip(model.landmarks, posed.landmarks, strict=True)
        if mark.name in given and np.linalg.norm(given[mark.name] - at) < _FARTHEST * _sd_m(mark.name)
    }
    return replace(model, landmarks=tuple(_move(mark, shifts) for mark in model.landmarks))


def _move(mark: Landmark, shifts: Mapping[str, Array]) -> Landmark:
    """Return a landmark moved by what is expected, given what is seen of it and of its counterpart."""
    name = mark.name
    other = other_side(name)
    sides = [sign * shifts[each] for each, sign in ((name, 1.0), (other, _MIRROR)) if each in shifts]
    if not sides:
        return mark
    definition, n = _definition_variance(name), len({name, other} & set(shifts))
    shift = np.mean(sides, axis=0) * definition / (definition + _POINT_SD_M**2 / n)
    return replace(mark, position_m=mark.position_m + shift, is_joint=mark.at_joint)


def _definition_variance(name: str) -> float:
    return JOINT_SD_M**2 / LANDMARK_WEIGHTS.get(name, 1.0)


def _sd_m(name: str) -> float:
    """Return how far a point lies from a landmark along each axis, as a rule [m]."""
    return float(np.sqrt(_definition_variance(name) + _POINT_SD_M**2))
