"""A figure of sticks stands where the joints are, and claims no turn that joint centres do not show."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose
from airborne.errors import ResultError
from airborne.export.stick_figure import fit_stick_figure
from tests.support.takes import LEGS, jumping
from tests.support.tolerances import ROUNDTRIP


def pose_figure(figure, row):
    R = Rotation.from_euler("XYZ", figure.root_angles[row])
    root = RigidTransform.from_components(figure.position[row], R)
    return figure.model.with_pose(Pose(world_from_root=root, joint_angles=figure.joint_angles[row]))


@pytest.mark.parametrize("joints", [(*LEGS, "torso"), LEGS, LEGS[:6], (*LEGS[:6], "torso")])
def test_its_pose_gives_the_joints_back(joints):
    motion = jumping(joints=joints)
    figure = fit_stick_figure(motion.points[:, 1], motion.joints)
    names = [landmark.name for landmark in figure.model.landmarks]
    assert sorted(names) == sorted(name for name in joints if name != "torso")
    at = [joints.index(name) for name in names]
    for row in range(len(motion)):
        np.testing.assert_allclose(pose_figure(figure, row).landmarks, motion.points[row, 1, at], atol=ROUNDTRIP)


def test_what_joint_centres_do_not_show_is_zero_and_locked():
    motion = jumping()
    figure = fit_stick_figure(motion.points[:, 0], motion.joints)
    x, _, z = np.moveaxis(Rotation.from_euler("XYZ", figure.root_angles).as_matrix(), -1, 0)
    np.testing.assert_allclose(np.sum(np.cross(x, [0, 0, 1]) * z, axis=1), 0, atol=ROUNDTRIP)  # as vertical as it can
    assert (z[:, 2] > 0).all()
    for segment, angles in zip(figure.model.segments[1:], np.moveaxis(figure.joint_angles, 1, 0), strict=True):
        locked = np.flatnonzero(np.ptp(segment.limits.angle_ranges_rad, axis=1) == 0)
        assert list(locked) == [1 if segment.name.startswith("foot") else 2]
        np.testing.assert_array_equal(angles[:, locked], 0)


def test_the_torso_points_from_the_hips_to_its_joint():
    motion = jumping()
    figure = fit_stick_figure(motion.points[:, 0], motion.joints)
    body = pose_figure(figure, 3)
    up = body.R[figure.model.index_of("torso")] @ [0, 0, 1]
    observed = motion.points[3, 0, 8] - motion.points[3, 0, :2].mean(axis=0)
    np.testing.assert_allclose(up, observed / np.linalg.norm(observed), atol=ROUNDTRIP)


def test_a_person_at_attention_has_no_angle():
    heights = np.repeat([0.9, 0.5, 0.1], 2)
    points = np.stack([np.tile([0.1, -0.1], 3), np.zeros(6), heights], axis=-1)[None]
    figure = fit_stick_figure(points, LEGS[:6])
    np.testing.assert_allclose(figure.joint_angles, 0, atol=ROUNDTRIP)
    np.testing.assert_allclose(figure.root_angles, 0, atol=ROUNDTRIP)


def test_a_missing_joint_leaves_the_rest_of_the_body_intact():
    motion = jumping()
    points = motion.points[:, 0].copy()
    points[2, LEGS.index("knee_left")] = np.nan
    figure = fit_stick_figure(points, motion.joints)
    names = [segment.name for segment in figure.model.segments[1:]]
    unknown = {name for name, angle in zip(names, figure.joint_angles[2], strict=True) if np.isnan(angle).any()}
    assert unknown == {"thigh_left", "shank_left", "foot_left"}
    assert np.isfinite(figure.position).all()
    assert np.isfinite(figure.joint_angles[[0, 1, 3]]).all()


def test_lengths_are_medians_over_time():
    motion = jumping(9)
    points = motion.points[:, 0].copy()
    down = points[:, 4] - points[:, 2]
    points[:, 4] += down * np.linspace(-0.1, 0.1, 9)[:, None]
    figure = fit_stick_figure(points, motion.joints)
    foot = figure.model.segments[figure.model.index_of("foot_left")]
    np.testing.assert_allclose(np.linalg.norm(foot.joint_m), 0.42, atol=ROUNDTRIP)


def test_no_figure_without_legs():
    motion = jumping()
    points = motion.points[:, 0].copy()
    points[:, 2] = np.nan
    with pytest.raises(ResultError, match="has no knee_left"):
        fit_stick_figure(points, motion.joints)
    with pytest.raises(ResultError, match="has no ankle_left, ankle_right"):
        fit_stick_figure(motion.points[:, 0, :4], motion.joints[:4])
