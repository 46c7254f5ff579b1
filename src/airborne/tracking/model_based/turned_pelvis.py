"""A pelvis that is turned alone: it is almost as deep as wide, so that little but the roots of the legs shows it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Pose
from airborne.body.chain import joint_angles_of
from airborne.tracking.model_based.degrees_of_freedom import limbs_of

_TURNS_RAD = np.radians([-60, -40, -20, 20, 40, 60])  # about the long axis; further, a leg would cross the other


def turn_pelvis(model: BodyModel, pose: Pose) -> list[Pose]:
    """Return poses with the root turned about its long axis; limbs on it aim where they did, nothing else moves."""
    return [_turn(model, pose, angle) for angle in _TURNS_RAD]


def _turn(model: BodyModel, pose: Pose, angle: float) -> Pose:
    body = model.with_pose(pose)
    R = body.R.copy()
    R[0] = R[0] @ Rotation.from_rotvec([0, 0, angle]).as_matrix()
    for first, second, *_ in limbs_of(model):
        if model.parents[first] == 0:
            joint = body.t[0] + R[0] @ np.asarray(model.segments[first].joint_m)
            before, after = body.t[second] - body.t[first], body.t[second] - joint
            R[first] = Rotation.align_vectors(after, before)[0].as_matrix() @ R[first]
    root = RigidTransform.from_components(pose.world_from_root.translation, Rotation.from_matrix(R[0]))
    return replace(pose, world_from_root=root, joint_angles=joint_angles_of(model, R, near=pose.joint_angles))
