"""Left taken for right: poses whose limbs have changed sides, and whether one is what was to be expected."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Pose
from airborne.body.chain import joint_angles_of
from airborne.tracking.model_based.degrees_of_freedom import within_limits

Array = NDArray[np.floating]

_LEFT, _RIGHT = "_left", "_right"
_LIKELIER_M = 0.05  # mean distance of the limbs' joints by which a swapped pose must be nearer


def swapped(model: BodyModel, pose: Pose) -> list[Pose]:
    """Return the pose with each pair of limbs swapped: every segment turned as its twin of the other side is.

    A pair is what hangs on the trunk by segments named `<name>_left` and `<name>_right`.
    """
    R = model.with_pose(pose).R
    poses = []
    for limb in _limbs(model):
        turned = R.copy()
        turned[[i for i, _ in limb]], turned[[j for _, j in limb]] = R[[j for _, j in limb]], R[[i for i, _ in limb]]
        angles = joint_angles_of(model, turned, near=_mirrored(pose.joint_angles, limb))
        poses.append(within_limits(model, replace(pose, joint_angles=angles)))
    return poses


def is_nearer(model: BodyModel, pose: Pose, other: Pose, expected: Pose) -> bool:
    """Say whether a pose's joints lie nearer to where they are expected than another's, by 50 mm in the mean."""
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
        twin = name.removesuffix(_LEFT) + _RIGHT
        if not name.endswith(_LEFT) or twin not in names:
            continue
        root_of[left] = root_of.get(int(model.parents[left]), left)
        limbs.setdefault(root_of[left], []).append((left, names.index(twin)))
    return list(limbs.values())


def _mirrored(angles: Array, limb: list[tuple[int, int]]) -> Array:
    """Return joint angles (joints, 3) with those of the limbs swapped, y and z mirrored."""
    mirrored = angles.copy()
    for left, right in limb:
        mirrored[left - 1], mirrored[right - 1] = angles[right - 1] * [1, -1, -1], angles[left - 1] * [1, -1, -1]
    return mirrored
