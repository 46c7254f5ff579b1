"""A body's points and segments move with its joints as the Jacobians say."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Ellipsoid, Landmark, Part, Pose, Segment
from airborne.body.chain import (
    delta_between,
    joint_angles_of,
    move_pose,
    nearest_angles,
    point_jacobian,
    segment_jacobians,
    separation_rows,
)
from airborne.geometry.rotations import matrix_from_angles
from tests.support.tolerances import EXACT, ROUNDTRIP

STEP = 1e-6
SECOND_ORDER = 1e-8  # what central differences of that step leave of lengths of a metre
PARENTS = {"pelvis": None, "chest": "pelvis", "head": "chest", "upper_arm": "chest", "forearm": "upper_arm"}
PARENTS |= {"thigh": "pelvis", "shank": "thigh", "foot": "shank"}


def body():
    rng = np.random.default_rng(3)
    part = (Part("part", Ellipsoid(np.ones(3)), RigidTransform.identity(), None),)
    segments = tuple(Segment(name, parent, rng.uniform(-0.4, 0.4, 3), part) for name, parent in PARENTS.items())
    marks = tuple(Landmark(f"{name}_mark", name, rng.uniform(-0.3, 0.3, 3)) for name in PARENTS)
    return BodyModel("figure", segments, marks)


def a_pose(model, seed=0, spread=0.8):
    rng = np.random.default_rng(seed)
    root = RigidTransform.from_components(rng.normal(size=3), Rotation.random(rng=rng))
    return Pose(world_from_root=root, joint_angles=spread * rng.normal(size=(len(model.segments) - 1, 3)))


def owners(model):
    return np.array([model.index_of(mark.segment) for mark in model.landmarks])


def n_dof(model):
    return 6 + 3 * (len(model.segments) - 1)


MODEL = body()


@pytest.mark.parametrize("k", range(n_dof(MODEL)))
def test_point_jacobian_is_the_difference_quotient_of_every_degree_of_freedom(k):
    pose, delta = a_pose(MODEL), np.zeros(n_dof(MODEL))
    delta[k] = STEP
    ahead, behind = (MODEL.with_pose(move_pose(pose, sign * delta)).landmarks for sign in (1, -1))
    posed = MODEL.with_pose(pose)
    found = point_jacobian(posed, owners(MODEL), posed.landmarks)
    np.testing.assert_allclose(found[..., k], (ahead - behind) / (2 * STEP), atol=SECOND_ORDER)


@pytest.mark.parametrize("k", range(n_dof(MODEL)))
def test_segment_jacobian_is_the_difference_quotient_of_every_degree_of_freedom(k):
    pose, delta, origin = a_pose(MODEL), np.zeros(n_dof(MODEL)), np.array([0.3, -0.2, 0.9])
    delta[k] = STEP
    now = MODEL.with_pose(pose)
    at_origin = np.einsum("sji,sj->si", now.R, origin - now.t)  # in each segment's own frame
    ahead, behind = (MODEL.with_pose(move_pose(pose, sign * delta)) for sign in (1, -1))
    places = [np.einsum("sij,sj->si", p.R, at_origin) + p.t for p in (ahead, behind)]
    turn = Rotation.from_matrix(ahead.R @ np.swapaxes(behind.R, -1, -2)).as_rotvec()
    found = segment_jacobians(now, origin)[..., k]
    np.testing.assert_allclose(found[:, :3], (places[0] - places[1]) / (2 * STEP), atol=SECOND_ORDER)
    np.testing.assert_allclose(found[:, 3:], turn / (2 * STEP), atol=SECOND_ORDER)


def test_points_of_one_segment_move_as_the_segment_does():
    posed, origin = MODEL.with_pose(a_pose(MODEL)), np.array([0.1, 0.2, 0.3])
    points = np.random.default_rng(1).normal(size=(4, 5, 3))
    for segment, jacobian in enumerate(segment_jacobians(posed, origin)):
        by_segment = jacobian[:3] - np.cross(points[..., None, :] - origin, jacobian[3:].T).swapaxes(-1, -2)
        np.testing.assert_allclose(point_jacobian(posed, segment, points), by_segment, atol=EXACT)
    assert point_jacobian(posed, [], np.zeros((0, 3))).shape == (0, *jacobian[:3].shape)


def test_two_segments_separate_as_their_points_move_apart():
    posed, rng = MODEL.with_pose(a_pose(MODEL, 5)), np.random.default_rng(5)
    segments = np.array([[a, b] for a in range(len(PARENTS)) for b in range(len(PARENTS))])
    points, directions = rng.normal(size=(2, len(segments), 3))
    first, other = (point_jacobian(posed, segments[:, side], points) for side in (0, 1))
    rows = separation_rows(posed, segments, points, directions)
    np.testing.assert_allclose(rows, np.einsum("ki,kij->kj", directions, first - other), atol=EXACT)


def test_body_in_one_piece_has_the_six_columns_of_a_rigid_body():
    model = BodyModel("stone", body().segments[:1])
    posed = model.with_pose(a_pose(model))
    found = point_jacobian(posed, 0, posed.t[0] + [0.0, 0.0, 2.0])
    np.testing.assert_allclose(found, [[1, 0, 0, 0, 2, 0], [0, 1, 0, -2, 0, 0], [0, 0, 1, 0, 0, 0]], atol=EXACT)
    assert move_pose(a_pose(model), np.ones(6)).joint_angles.size == 0


@pytest.mark.parametrize("spread", [0.1, 1.0, 3.0])
def test_no_motion_leaves_a_pose_where_it_is(spread):
    pose = a_pose(MODEL, spread=spread)  # 3 rad: most joints lie on another branch than a first reading gives
    moved = move_pose(pose, np.zeros(n_dof(MODEL)))
    np.testing.assert_allclose(moved.joint_angles, pose.joint_angles, atol=ROUNDTRIP)
    np.testing.assert_allclose(moved.world_from_root.as_matrix(), pose.world_from_root.as_matrix(), atol=EXACT)


@pytest.mark.parametrize("seed", range(5))
def test_turning_a_joint_back_undoes_the_turn(seed):
    pose, delta = a_pose(MODEL, seed), 0.3 * np.random.default_rng(seed).normal(size=n_dof(MODEL))
    there = move_pose(pose, delta)
    back = move_pose(there, -delta)
    np.testing.assert_allclose(back.joint_angles, pose.joint_angles, atol=ROUNDTRIP)
    np.testing.assert_allclose(back.world_from_root.as_matrix(), pose.world_from_root.as_matrix(), atol=ROUNDTRIP)


@pytest.mark.parametrize("seed", range(5))
def test_motion_between_two_poses_takes_the_one_to_the_other(seed):
    delta = 0.3 * np.random.default_rng(seed).normal(size=n_dof(MODEL))
    pose = a_pose(MODEL, seed)
    np.testing.assert_allclose(delta_between(pose, move_pose(pose, delta)), delta, atol=ROUNDTRIP)
    rigid = Pose(world_from_root=pose.world_from_root)
    np.testing.assert_allclose(delta_between(rigid, move_pose(rigid, delta[:6])), delta[:6], atol=ROUNDTRIP)


def test_a_joint_turns_about_its_own_axes_after_its_angles():
    pose, delta = a_pose(MODEL), np.zeros(n_dof(MODEL))
    delta[6 + 3 * 3 : 9 + 3 * 3] = [0.2, -0.4, 0.1]  # the joint of the fourth segment after the root
    before, after = MODEL.with_pose(pose), MODEL.with_pose(move_pose(pose, delta))
    expected = before.R[4] @ Rotation.from_rotvec([0.2, -0.4, 0.1]).as_matrix()
    np.testing.assert_allclose(after.R[4], expected, atol=EXACT)
    np.testing.assert_allclose(after.R[:4], before.R[:4], atol=EXACT)


def test_missing_joint_angles_are_straight_joints():
    root = a_pose(MODEL).world_from_root
    delta = np.zeros(n_dof(MODEL))
    delta[6] = 0.25
    found = move_pose(Pose(world_from_root=root), delta).joint_angles
    assert found[0].tolist() == pytest.approx([0.25, 0, 0], abs=EXACT)
    assert np.abs(found[1:]).max() < EXACT


def test_angles_run_smoothly_through_a_right_angle():
    delta, poses = np.array([0.0] * 7 + [0.02, 0.0]), [Pose(world_from_root=RigidTransform.identity())]
    poses[0] = Pose(world_from_root=RigidTransform.identity(), joint_angles=np.array([[0.3, 1.4, 0.0]]))
    for _ in range(20):
        poses.append(move_pose(poses[-1], delta))
    angles = np.array([pose.joint_angles[0] for pose in poses])
    np.testing.assert_allclose(angles, [[0.3, 1.4 + 0.02 * k, 0.0] for k in range(21)], atol=1e2 * ROUNDTRIP)


@pytest.mark.parametrize("sign", [1, -1])
def test_x_stays_as_it_was_exactly_at_a_right_angle(sign):
    angles = np.array([[0.7, sign * np.pi / 2, -0.4]])
    pose = Pose(world_from_root=RigidTransform.identity(), joint_angles=angles)
    np.testing.assert_allclose(move_pose(pose, np.zeros(9)).joint_angles, angles, atol=ROUNDTRIP)


def test_angles_read_off_a_posed_body_are_the_poses():
    pose = a_pose(MODEL, spread=0.4)
    R = MODEL.with_pose(pose).R
    np.testing.assert_allclose(joint_angles_of(MODEL, R), pose.joint_angles, atol=ROUNDTRIP)
    many = joint_angles_of(MODEL, np.stack([R, R])[:, None])
    assert many.shape == (2, 1, len(MODEL.segments) - 1, 3)
    far = a_pose(MODEL, spread=3.0)
    found = joint_angles_of(MODEL, MODEL.with_pose(far).R, near=far.joint_angles + 0.1)
    np.testing.assert_allclose(found, far.joint_angles, atol=ROUNDTRIP)


def test_nearest_angles_are_the_same_rotation_within_reach_of_the_others():
    rng = np.random.default_rng(0)
    angles, near = rng.uniform(-9, 9, size=(2, 500, 3))
    found = nearest_angles(angles, near)
    np.testing.assert_allclose(matrix_from_angles(found), matrix_from_angles(angles), atol=EXACT * 100)
    assert np.abs(found - near)[:, 1].max() <= np.pi
    steps = 2 * np.pi * rng.integers(-2, 3, size=(500, 3))
    assert np.all(np.sum((found - near) ** 2, -1) <= np.sum((angles + steps - near) ** 2, -1) + ROUNDTRIP)
    assert np.isnan(nearest_angles(np.full(3, np.nan), np.zeros(3))).all()
