"""A pelvis that is turned alone: it is almost as deep as wide, so that little but the roots of the legs shows it.

Where it is turned so far that the trunk is twisted to its limits, or the legs are crossed, these have often been taken
for each other, too.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Pose
from airborne.body.chain import joint_angles_of
from airborne.body.sides import are_crossed
from airborne.geometry.rotations import matrix_from_angles, shortest_rotations
from airborne.rendering import EvidenceMaps, mask_evidence
from airborne.tracking.model_based.degrees_of_freedom import joints_of, limb_of_segment, limbs_of
from airborne.tracking.model_based.left_right_swap import counterparts
from airborne.tracking.model_based.render_model import RenderModel
from airborne.types import Array

_TURNS_RAD = np.radians([-60, -40, -20, 20, 40, 60])  # about the long axis; further, a leg would cross the other
# with which the legs are exchanged: every 30 degrees, half of which a fit makes up for
_TURNS_BACK_RAD = np.radians([-160, -130, -100, -70, 70, 100, 130, 160])
_AT_LIMIT_RAD = np.radians(1.0)  # a joint with less slack lies at its limit: its walls are soft by some degrees
_FEWEST_AT_LIMIT = 2  # joints of the trunk: a single one often is, in tucks of two recorded somersaults


def find_turned_pelvis(render_model: RenderModel, pose: Pose, maps: EvidenceMaps) -> list[Pose]:
    """Return the pose with its pelvis turned, if that has more evidence on reduced images or the pose is improbable."""
    model, root = render_model.model, pose.world_from_root
    R, angles = _turn(model, pose, np.append(0.0, _TURNS_RAD), np.arange(len(render_model.model.segments)))
    posed = model.pose_segments(R, root.translation, angles)
    evidence = mask_evidence(render_model.geometry, maps, *posed).sum(axis=1)
    if is_improbable(model, pose):
        evidence[0] = -np.inf
    best = int(np.argmax(evidence))
    return _poses(pose, R[best, None], angles[best, None]) if best else []


def turn_pelvis_back(model: BodyModel, pose: Pose) -> list[Pose]:
    """Return poses with the root turned further; limbs on it aim where their counterparts did, turned like these."""
    return _poses(pose, *_turn(model, pose, _TURNS_BACK_RAD, counterparts(model)))


def pelvis_columns(model: BodyModel) -> NDArray[np.int64]:
    """Return the degrees of freedom that turning the pelvis changes: the root's rotation, trunk and limbs on it."""
    segments = np.flatnonzero(limb_of_segment(model) < 0)[1:]
    freed = joints_of(model, np.concatenate([segments, *limbs_on_root(model)]))
    return np.concatenate([np.arange(3, 6), freed.columns])


def is_improbable(model: BodyModel, pose: Pose) -> bool:
    """Whether people hardly ever are in a pose: the trunk twisted to its limits, or the legs crossed."""
    return is_twisted(model, pose) or bool(are_crossed(model, model.with_pose(pose).t))


def limbs_on_root(model: BodyModel) -> list[NDArray[np.int64]]:
    """Return the segments of each limb that hangs on the root."""
    return [limb for limb in limbs_of(model) if model.parents[limb[0]] == 0]


def is_twisted(model: BodyModel, pose: Pose) -> bool:
    """Whether two joints of the trunk or more lie at their limits."""
    slack = model.limits.slack(matrix_from_angles(pose.joint_angles))
    return int(np.sum((slack < _AT_LIMIT_RAD) & (limb_of_segment(model)[1:] < 0))) >= _FEWEST_AT_LIMIT


def _turn(model: BodyModel, pose: Pose, turns_rad: Array, source: NDArray[np.int64]) -> tuple[Array, Array]:
    """Turn the root, whose limbs take the rotations and aims of those of the segments `source` (segments,).

    Return the root's rotations (n, 3, 3) and the joint angles (n, joints, 3), for each of the turns (n,).
    """
    body, on_root, joints_m = model.with_pose(pose), limbs_on_root(model), model.joints_m
    R, t = np.repeat(body.R[None], len(turns_rad), axis=0), body.t.copy()
    for limb in on_root:
        R[:, limb], t[limb] = body.R[source[limb]], body.t[source[limb]]
    R[:, 0] = R[:, 0] @ matrix_from_angles(turns_rad[:, None] * [0.0, 0.0, 1.0])
    for first, second, *_ in on_root:
        joints = body.t[0] + R[:, 0] @ joints_m[first]
        R[:, first] = shortest_rotations(R[:, first] @ joints_m[second], t[second] - joints) @ R[:, first]
    return R[:, 0], joint_angles_of(model, R, near=pose.joint_angles)


def _poses(pose: Pose, root_R: Array, joint_angles: Array) -> list[Pose]:
    """Return a pose with the root's rotations (n, 3, 3) and joint angles (n, joints, 3)."""
    place = pose.world_from_root.translation
    return [
        replace(pose, world_from_root=RigidTransform.from_components(place, Rotation.from_matrix(R)), joint_angles=each)
        for R, each in zip(root_R, joint_angles, strict=True)
    ]
