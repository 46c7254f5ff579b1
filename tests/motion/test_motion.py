"""A motion is its estimates, labelled."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose
from airborne.motion import Motion
from airborne.motion.labelled import label_root
from airborne.tracking import Status
from tests.support.motions import estimate, run_with_gap
from tests.support.tolerances import EXACT


def test_lost_frames_are_unknown_and_the_others_are_not():
    motion = Motion.collect(run_with_gap(8, lost=[3, 4]))
    assert motion.has_pose.tolist() == [True] * 3 + [False] * 2 + [True] * 3
    for values in (motion.position, motion.quaternion, motion.position_sd, motion.rotation_sd):
        assert np.isnan(values[3:5]).all()
        assert np.isfinite(values[motion.has_pose]).all()


def test_quaternions_rotate_like_the_poses_and_have_no_negative_w():
    estimates = run_with_gap(20, lost=[])
    motion = Motion.collect(estimates)
    expected = np.stack([e.pose.world_from_root.rotation.as_matrix() for e in estimates])
    np.testing.assert_allclose(Rotation.from_quat(motion.quaternion).as_matrix(), expected, atol=EXACT)
    assert (motion.quaternion[:, 3] >= 0).all()


def test_sign_of_a_quaternion_makes_no_difference():
    quaternion = np.array([0.5, -0.5, 0.1, -0.7])
    root = [RigidTransform.from_rotation(Rotation.from_quat(sign * quaternion)) for sign in (1, -1)]
    estimates = [replace(estimate(i), pose=Pose(world_from_root=root[i])) for i in range(2)]
    first, second = Motion.collect(estimates).quaternion
    np.testing.assert_allclose(first, second, atol=EXACT)


def test_pose_of_a_row_is_the_estimates_pose_bit_for_bit():
    (item,) = [estimate(0, n_joints=2)]
    pose = Motion.collect([item], ("chest", "head")).pose(0)
    np.testing.assert_array_equal(pose.world_from_root.as_matrix(), item.pose.world_from_root.as_matrix())
    np.testing.assert_array_equal(pose.joint_angles, item.pose.joint_angles)


def test_pose_without_joint_angles_has_straight_joints():
    assert (Motion.collect([estimate(0)], ("chest", "head")).joint_angles == 0).all()


def test_statuses_are_counted():
    motion = Motion.collect([estimate(0), estimate(1, status=Status.UNCERTAIN), estimate(2, status=Status.LOST)])
    assert [motion.count(status) for status in Status] == [1, 1, 1]


@pytest.mark.parametrize("rows", [0, 1, 5])
def test_dataset_has_time_in_seconds_and_a_unit_on_every_number(rows):
    motion = Motion.collect(run_with_gap(rows, lost=[3], n_joints=1), ("chest",))
    labelled = label_root(motion, ["tracked"])
    np.testing.assert_array_equal(labelled["time"], motion.time_s)
    assert labelled["time"].attrs["units"] == "s"
    assert labelled.attrs["history"] == ["tracked"]
    assert all("units" in labelled[name].attrs for name in labelled.data_vars if name not in ("status", "doubts"))
    np.testing.assert_array_equal(labelled["position"].sel(space="z"), motion.position[:, 2])
    assert labelled["joint_angle"].sel(joint="chest").shape == (rows, 3)
