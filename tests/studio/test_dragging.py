"""A body taken by hand: the point that is held goes to its pixel, what carries it follows, all else stays."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import SAMPLED, Pose, human18
from airborne.cameras import Rig, camera_looking_at
from airborne.studio.dragging import Pin, drag_pose, grip_at, grip_landmark, landmarks_of_grip, landmarks_px, turn_with
from tests.support.bodies import is_within_limits

SIZE = (640, 480)
MODEL = human18(1.75, 70.0, outfit=SAMPLED)
NAMES = [landmark.name for landmark in MODEL.landmarks]
HERE_PX = 0.2  # the pose in which the body was taken pulls a little


@pytest.fixture(scope="module")
def rig():
    places = {"a": [3.0, -4.0, 1.5], "b": [-4.0, -3.0, 1.2]}
    return Rig(tuple(camera_looking_at(n, p, [0, 0, 1.1], focal_px=600, size=SIZE) for n, p in places.items()))


@pytest.fixture(scope="module")
def taken():
    root = RigidTransform.from_components([0.1, 0.0, 1.0], Rotation.from_rotvec([0, 0, 0.4]))
    angles = np.zeros((MODEL.n_joints, 3))
    angles[MODEL.index_of("forearm_left") - 1, 0] = np.radians(-60)  # bent, so that it can follow everywhere near
    return Pose(world_from_root=root, joint_angles=angles)


def landmark_px(pose, camera, name):
    return camera.px_from_world(MODEL.with_pose(pose).landmarks[NAMES.index(name)])


def test_a_wrist_goes_where_it_is_dragged_and_the_other_limbs_stay(rig, taken):
    camera, grip = rig["a"], grip_landmark(MODEL, "wrist_left")
    target = np.add(landmark_px(taken, camera, "wrist_left"), [14.0, -11.0])
    pose = drag_pose(MODEL, taken, taken, [Pin(grip, camera, target)])
    np.testing.assert_allclose(landmark_px(pose, camera, "wrist_left"), target, atol=HERE_PX)
    still = [NAMES.index(name) for name in NAMES if name not in landmarks_of_grip(MODEL, grip)]
    before, after = (MODEL.with_pose(each).landmarks[still] for each in (taken, pose))
    np.testing.assert_array_equal(before, after)
    assert is_within_limits(MODEL, pose)


def test_a_body_taken_by_its_trunk_moves_across_the_line_of_sight_and_not_along_it(rig, taken):
    camera = rig["a"]
    grip = grip_at(MODEL.with_pose(taken), camera, landmark_px(taken, camera, "torso"))
    posed = MODEL.with_pose(taken)
    start = camera.px_from_world(posed.R[grip.segment] @ grip.point_m + posed.t[grip.segment])
    pose = drag_pose(MODEL, taken, taken, [Pin(grip, camera, np.add(start, [40.0, 10.0]))])
    moved = pose.world_from_root.translation - taken.world_from_root.translation
    along = camera.camera_from_world.rotation.apply(moved)[2]
    assert np.linalg.norm(moved) > 0.2
    assert abs(along) < 0.15 * np.linalg.norm(moved)  # off the optical axis, the line of sight is another
    assert np.array_equal(pose.joint_angles, taken.joint_angles)


def test_drags_in_two_views_set_how_far_away_the_body_is(rig, taken):
    there = Pose(world_from_root=RigidTransform.from_components([0.5, 0.35, 1.2], taken.world_from_root.rotation))
    grip = grip_landmark(MODEL, "pelvis")
    first = Pin(grip, rig["a"], landmark_px(there, rig["a"], "pelvis"))
    pose = drag_pose(MODEL, taken, taken, [first])
    assert np.linalg.norm(pose.world_from_root.translation - there.world_from_root.translation) > 0.05
    pose = drag_pose(MODEL, pose, pose, [first, Pin(grip, rig["b"], landmark_px(there, rig["b"], "pelvis"))])
    np.testing.assert_allclose(pose.world_from_root.translation, there.world_from_root.translation, atol=0.003)


def test_with_shift_the_body_turns_about_its_root(rig, taken):
    camera, grip = rig["a"], turn_with(grip_landmark(MODEL, "head"))
    target = np.add(landmark_px(taken, camera, "head"), [15.0, 4.0])
    pose = drag_pose(MODEL, taken, taken, [Pin(grip, camera, target)])
    np.testing.assert_allclose(landmark_px(pose, camera, "head"), target, atol=HERE_PX)
    np.testing.assert_allclose(pose.world_from_root.translation, taken.world_from_root.translation)


def test_what_cannot_be_reached_is_approached_within_the_limits(rig, taken):
    camera, grip = rig["b"], grip_landmark(MODEL, "wrist_left")
    start = landmark_px(taken, camera, "wrist_left")
    target = np.add(start, [250.0, 0.0])
    pose = drag_pose(MODEL, taken, taken, [Pin(grip, camera, target)])
    assert abs(landmark_px(pose, camera, "wrist_left") - target).max() < abs(start - target).max()
    assert is_within_limits(MODEL, pose)


def test_beside_the_body_there_is_nothing_to_take(rig, taken):
    assert grip_at(MODEL.with_pose(taken), rig["a"], np.array([5.0, 5.0])) is None


def test_landmarks_outside_the_picture_are_no_clicks(rig, taken):
    away = Pose(world_from_root=RigidTransform.from_translation([0.0, 0.0, 2.6]), joint_angles=taken.joint_angles)
    px = landmarks_px(MODEL, away, rig["a"], NAMES)
    assert 0 < len(px) < len(NAMES)
    assert all(0 <= u < SIZE[0] and -0.5 < v < SIZE[1] for u, v in px.values())
