"""Postures of a person that the search for one starts from: named ones, and limbs anywhere in their ranges."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel
from airborne.body.limits import JointLimits
from airborne.geometry.rotations import angles_from_matrix, matrix_from_angles
from airborne.geometry.sampling import sobol_points
from airborne.types import Array

# hip flexion, abduction and knee flexion of the left and the right leg, flexion of the trunk [deg]
_LEGS = {
    "straight": ((0, 4, 3), (0, 4, 3), 0),
    "soft": ((25, 6, 35), (25, 6, 35), 5),
    "squat": ((75, 10, 95), (75, 10, 95), 20),
    "tuck": ((115, 5, 125), (115, 5, 125), 30),
    "pike": ((100, 4, 4), (100, 4, 4), 30),
    "half pike": ((55, 4, 4), (55, 4, 4), 12),
    "straddle": ((15, 35, 4), (15, 35, 4), 0),
    "straddle pike": ((75, 38, 4), (75, 38, 4), 20),
    "arch": ((-18, 5, 15), (-18, 5, 15), -18),
    "heels up": ((5, 5, 90), (5, 5, 90), -5),
    "run, left": ((60, 5, 80), (-12, 5, 35), 5),
    "run, right": ((-12, 5, 35), (60, 5, 80), 5),
    "split, left": ((75, 5, 6), (-22, 5, 8), 5),
    "split, right": ((-22, 5, 8), (75, 5, 6), 5),
}
# shoulder flexion and abduction and elbow flexion of the left and the right arm [deg]
_ARMS = {
    "down": ((5, 10, 15), (5, 10, 15)),
    "up": ((170, 5, 10), (170, 5, 10)),
    "y": ((150, 35, 10), (150, 35, 10)),
    "sideways": ((0, 88, 8), (0, 88, 8)),
    "forward": ((90, 5, 10), (90, 5, 10)),
    "at the chest": ((45, 15, 120), (45, 15, 120)),
    "at the shins": ((55, 10, 35), (55, 10, 35)),
    "back": ((-40, 15, 15), (-40, 15, 15)),
    "at the face": ((95, 20, 110), (95, 20, 110)),
    "left up": ((165, 10, 10), (5, 10, 15)),
    "right up": ((5, 10, 15), (165, 10, 10)),
    "left sideways": ((60, 60, 20), (5, 10, 20)),
    "right sideways": ((5, 10, 20), (60, 60, 20)),
}
_TRUNK = {"torso": 0.6, "chest": 0.4, "head": 0.3}  # shares of the trunk's flexion
_POINTED_DEG = 20.0  # of the feet
_LARGE_RAD = np.radians(40)  # half of a range that is searched anywhere


def library(model: BodyModel) -> Array:
    """Return joint angles (postures, joints, 3) [rad] of a person: all legs with all arms."""
    names = [segment.name for segment in model.segments[1:]]
    out = np.zeros((len(_LEGS) * len(_ARMS), len(names), 3))
    for angles, (legs, arms) in zip(out, product(_LEGS.values(), _ARMS.values()), strict=True):
        rows = dict(zip(names, angles, strict=True))  # views of one posture's rows
        left, right, flexion = legs
        for leg, arm, side, sign in zip((left, right), arms, ("left", "right"), (-1, 1), strict=True):
            hip, abduction, knee = leg
            rows[f"thigh_{side}"][:] = -hip, sign * abduction, 0
            rows[f"shank_{side}"][0] = knee
            rows[f"foot_{side}"][0] = _POINTED_DEG
            shoulder, abduction, elbow = arm
            rows[f"upper_arm_{side}"][:] = -shoulder, sign * abduction, 0
            rows[f"forearm_{side}"][0] = -elbow
        for name, share in _TRUNK.items():
            rows[name][0] = share * flexion
    return angles_from_matrix(model.limits.clamp(matrix_from_angles(np.radians(out))))


def is_person(model: BodyModel) -> bool:
    """Whether a body has the segments that the postures speak of."""
    pairs = [
        f"{name}_{side}" for name in ("thigh", "shank", "foot", "upper_arm", "forearm") for side in ("left", "right")
    ]
    return {*pairs, *_TRUNK} <= {segment.name for segment in model.segments}


def limb_postures(model: BodyModel, limb: NDArray[np.int64], n: int, seed: int) -> Array:
    """Return angles (n, joints of the limb, 3) [rad] of one limb, its large joints anywhere in their ranges."""
    limits = JointLimits.stack(model.segments[segment].limits for segment in limb)
    is_large = limits.half_rad > _LARGE_RAD
    is_large[:, 2] &= limits.is_ball  # a hinge's twist moves no outline
    is_large[-1] = False
    points = np.zeros((n, *is_large.shape))
    points[:, is_large] = 2 * sobol_points(int(is_large.sum()), n, seed=seed) - 1
    middle = np.where(np.isfinite(limits.half_rad), limits.half_rad, np.pi)
    return angles_from_matrix(limits.rotation(limits.nearest(points * middle)))
