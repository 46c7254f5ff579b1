"""Left-right swaps: poses with the limbs of one side exchanged for the other's, and whether one was to be expected."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Pose
from airborne.body.chain import clamp_to_limits, joint_angles_of
from airborne.body.sides import limb_pairs
from airborne.types import Array

_LIKELIER_M = 0.05  # mean distance of the limbs' joints by which a swapped pose must be nearer


def swap_limbs(model: BodyModel, pose: Pose) -> list[Pose]:
    """Return the pose with each pair of limbs swapped: every segment takes its counterpart's orientation."""
    R = model.with_pose(pose).R
    poses = []
    for limb in limb_pairs(model):
        R_swapped = R.copy()
        left, right = [i for i, _ in limb], [j for _, j in limb]
        R_swapped[left], R_swapped[right] = R[right], R[left]
        angles = joint_angles_of(model, R_swapped, near=_mirror_angles(pose.joint_angles, limb))
        poses.append(clamp_to_limits(model, replace(pose, joint_angles=angles)))
    return poses


def counterparts(model: BodyModel) -> NDArray[np.int64]:
    """Return for every segment its counterpart on the other side, or itself: (segments,)."""
    other = np.arange(len(model.segments))
    for limb in limb_pairs(model):
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


def _mirror_angles(angles: Array, limb: list[tuple[int, int]]) -> Array:
    """Return joint angles (joints, 3) with those of the limbs swapped, y and z mirrored."""
    mirrored = angles.copy()
    for left, right in limb:
        mirrored[left - 1], mirrored[right - 1] = angles[right - 1] * [1, -1, -1], angles[left - 1] * [1, -1, -1]
    return mirrored
