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
from airborne.geometry.rotations import matrix_from_angles
from airborne.rendering import EvidenceMaps, mask_evidence
from airborne.tracking.model_based.degrees_of_freedom import joints_of, limb_of_segment, limbs_of
from airborne.tracking.model_based.left_right_swap import counterparts
from airborne.tracking.model_based.render_model import RenderModel

_TURNS_RAD = np.radians([-60, -40, -20, 20, 40, 60])  # about the long axis; further, a leg would cross the other
# with which the legs are exchanged: every 30 degrees, half of which a fit makes up for
_TURNS_BACK_RAD = np.radians([-160, -130, -100, -70, 70, 100, 130, 160])
_AT_LIMIT_RAD = np.radians(1.0)  # a joint with less slack lies at its limit: its walls are soft by some degrees
_FEWEST_AT_LIMIT = 2  # joints of the trunk: a single one often is, in tucks of two recorded somersaults


def turn_pelvis(model: BodyModel, pose: Pose) -> list[Pose]:
    """Return poses with the root turned about its long axis; limbs on it aim where they did, nothing else moves."""
    return [_turn(model, pose, angle, np.arange(len(model.segments))) for angle in _TURNS_RAD]


def find_turned_pelvis(render_model: RenderModel, pose: Pose, maps: EvidenceMaps) -> list[Pose]:
    """Return the pose with its pelvis turned, if that has more evidence on reduced images or the pose is improbable."""
    poses = [pose, *turn_pelvis(render_model.model, pose)]
    bodies = [render_model.with_pose(each) for each in poses]
    R, t = np.stack([body.R for body in bodies]), np.stack([body.t for body in bodies])
    evidence = mask_evidence(render_model.geometry, maps, R, t).sum(axis=1)
    if is_improbable(render_model.model, pose):
        evidence[0] = -np.inf
    best = int(np.argmax(evidence))
    return [poses[best]] if best else []


def turn_pelvis_back(model: BodyModel, pose: Pose) -> list[Pose]:
    """Return poses with the root turned further; limbs on it aim where their counterparts did, turned like these."""
    return [_turn(model, pose, angle, counterparts(model)) for angle in _TURNS_BACK_RAD]


def turned_columns(model: BodyModel) -> NDArray[np.int64]:
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


def _turn(model: BodyModel, pose: Pose, angle: float, source: NDArray[np.int64]) -> Pose:
    """Turn the root; its limbs take the rotations and aims of those of the segments `source` (segments,)."""
    body, on_root = model.with_pose(pose), limbs_on_root(model)
    R, t = body.R.copy(), body.t.copy()
    for limb in on_root:
        R[limb], t[limb] = body.R[source[limb]], body.t[source[limb]]
    R[0] = R[0] @ Rotation.from_rotvec([0, 0, angle]).as_matrix()
    for first, second, *_ in on_root:
        joint = body.t[0] + R[0] @ np.asarray(model.segments[first].joint_m)
        before, after = R[first] @ np.asarray(model.segments[second].joint_m), t[second] - joint
        R[first] = Rotation.align_vectors(after, before)[0].as_matrix() @ R[first]
    root = RigidTransform.from_components(pose.world_from_root.translation, Rotation.from_matrix(R[0]))
    return replace(pose, world_from_root=root, joint_angles=joint_angles_of(model, R, near=pose.joint_angles))
