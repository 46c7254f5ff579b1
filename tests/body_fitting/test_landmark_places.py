"""Landmarks move to where the points of a start mark them, and keep these places in the segments."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose, human18
from airborne.body.files import read_body, write_body
from airborne.body_fitting.landmark_places import place_landmarks
from tests.support.tolerances import ROUNDTRIP

MODEL = human18(1.7, 65.0)
NAMES = [mark.name for mark in MODEL.landmarks]
RNG = np.random.default_rng(11)
POSE, LATER = (
    Pose(
        world_from_root=RigidTransform.from_components(RNG.normal(size=3), Rotation.random(rng=RNG)),
        joint_angles=RNG.uniform(-0.4, 0.4, (MODEL.n_joints, 3)),
    )
    for _ in range(2)
)
HIGH_HIPS = {"hip_left": np.array([0.01, 0.02, 0.04]), "hip_right": np.array([-0.01, 0.02, 0.04])}


def points_beside(shifts, pose=POSE):
    """The landmarks (3,) world [m], shifted in their segments."""
    posed = MODEL.with_pose(pose)
    return {
        mark.name: at + posed.R[MODEL.index_of(mark.segment)] @ shifts.get(mark.name, np.zeros(3))
        for mark, at in zip(MODEL.landmarks, posed.landmarks, strict=True)
        if mark.name != "pelvis"
    }


def errors_mm(model, shifts):
    """How far the landmarks lie from the points in a later pose."""
    points = points_beside(shifts, LATER)
    landmarks = dict(zip(NAMES, model.with_pose(LATER).landmarks, strict=True))
    return {name: 1e3 * np.linalg.norm(landmarks[name] - point) for name, point in points.items()}


def test_most_of_another_definition_is_taken_over_in_all_poses():
    moved = place_landmarks(MODEL, POSE, points_beside(HIGH_HIPS))
    before, after = errors_mm(MODEL, HIGH_HIPS), errors_mm(moved, HIGH_HIPS)
    for name in HIGH_HIPS:
        assert after[name] < 0.3 * before[name]
    assert max(after[name] for name in after if name not in HIGH_HIPS) < 1e-6
    pelvis = NAMES.index("pelvis")
    assert np.linalg.norm(moved.landmarks[pelvis].position_m - MODEL.landmarks[pelvis].position_m) > 0.02


def test_left_and_right_share_what_is_seen_of_either():
    lone = {"hip_left": HIGH_HIPS["hip_left"]}
    places = {mark.name: mark.position_m for mark in place_landmarks(MODEL, POSE, points_beside(lone)).landmarks}
    np.testing.assert_allclose(places["hip_left"], places["hip_right"] * [-1, 1, 1], atol=ROUNDTRIP)
    assert 0 < places["hip_left"][2] < 0.5 * lone["hip_left"][2]


def test_point_far_off_is_a_mistake_and_moves_nothing():
    far = {"knee_left": np.array([0.0, 0.2, 0.0])}
    moved = place_landmarks(MODEL, POSE, points_beside(far))
    for mark, before in zip(moved.landmarks, MODEL.landmarks, strict=True):
        np.testing.assert_allclose(mark.position_m, before.position_m, atol=ROUNDTRIP)


def test_moved_joint_still_stands_for_its_joint(tmp_path):
    moved = place_landmarks(MODEL, POSE, points_beside(HIGH_HIPS))
    write_body(tmp_path / "body.toml", moved)
    again = read_body(tmp_path / "body.toml")
    for mark, own, first in zip(again.landmarks, moved.landmarks, MODEL.landmarks, strict=True):
        assert mark.at_joint == own.at_joint == first.at_joint
        np.testing.assert_array_equal(mark.position_m, own.position_m)


def test_body_without_points_stays():
    assert place_landmarks(MODEL, POSE, {}).landmarks == replace(MODEL).landmarks
