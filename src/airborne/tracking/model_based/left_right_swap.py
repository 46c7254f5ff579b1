"""Left-right swaps: poses with the limbs of one side exchanged for the other's, and whether one was to be expected."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Pose
from airborne.body.chain import clamp_to_limits, joint_angles_of
from airborne.types import Array

_LEFT, _RIGHT = "_left", "_right"
_LIKELIER_M = 0.05  # mean distance of the limbs' joints by which a swapped pose must be nearer


def swap_limbs(model: BodyModel, pose: Pose) -> list[Pose]:
    """Return the pose with each pair of limbs swapped: every segment takes its counterpart's orientation.

    A pair is what hangs on the trunk by segments named `<name>_left` and `<name>_right`.
    """
    R = model.with_pose(pose).R
    poses = []
    for limb in _limbs(model):
        R_swapped = R.copy()
        left, right = [i for i, _ in limb], [j for _, j in limb]
        R_swapped[left], R_swapped[right] = R[right], R[left]
        angles = joint_angles_of(model, R_swapped, near=_mirror_angles(pose.joint_angles, limb))
        poses.append(clamp_to_limits(model, replace(pose, joint_angles=angles)))
    return poses


def counterparts(model: BodyModel) -> NDArray[np.int64]:
    """Return for every segment its counterpart on the other side, or itself: (segments,)."""
    other = np.arange(len(model.segments))
    for limb in _limbs(model):
        for left, right in limb:
            other[left], other[right] = right, left
    return other


def is_nearer(model: BodyModel, pose: Pose, other: Pose, expected: Pose) -> bool:
    """Return whether a pose's joints are nearer than another's to the expected ones, by 50 mm in the mean."""
    here, there, middle = (model.with_pose(each).t for each in (pose, other, expected))
    moved = np.linalg.norm(here - there, axis=1) > 1e-3
    if not moved.any():
        return False
    away, other_away = (np.linalg.norm((each - middle)[moved], axis=1).mean() for each in (here, there))
    return bool(away < other_away - _LIKELIER_M)


def _limbs(model: BodyModel) -> list[list[tuple[int, int]]]:
    """Return for every pair of limbs the indices of its segments, left and right."""
    names = [segment.name for segment in model.segments]
    limbs: dict[int, list[tuple[int, int]]] = {}
    root_of: dict[int, int] = {}
    for left, name in enumerate(names):
        counterpart = name.removesuffix(_LEFT) + _RIGHT
        if not name.endswith(_LEFT) or counterpart not in names:
            continue
        root_of[left] = root_of.get(int(model.parents[left]), left)
        limbs.setdefault(root_of[left], []).append((left, names.index(counterpart)))
    return list(limbs.values())


def _mirror_angles(angles: Array, limb: list[tuple[int, int]]) -> Array:
    """Return joint angles (joints, 3) with those of the limbs swapped, y and z mirrored."""
    mirrored = angles.copy()
    for left, right in limb:
        mirrored[left - 1], mirrored[right - 1] = angles[right - 1] * [1, -1, -1], angles[left - 1] * [1, -1, -1]
    return mirrored
