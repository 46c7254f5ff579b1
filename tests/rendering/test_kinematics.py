import numpy as np

from airborne.rendering import pose_segments
from tests.support.bodies import random_body, random_pose
from tests.support.tolerances import EXACT


def test_a_batch_of_poses_is_the_same_as_one_by_one():
    rng = np.random.default_rng(0)
    model = random_body(["ellipsoid", "box", "mesh"], rng)
    poses = [random_pose(rng) for _ in range(5)]
    roots = [pose.world_from_root for pose in poses]
    R, t = pose_segments(
        model,
        np.stack([root.rotation.as_matrix() for root in roots]),
        np.stack([root.translation for root in roots]),
        np.stack([pose.joint_angles for pose in poses]),
    )
    for pose, R_pose, t_pose in zip(poses, R, t, strict=True):
        body = model.with_pose(pose)
        np.testing.assert_allclose(R_pose, body.R, atol=EXACT)
        np.testing.assert_allclose(t_pose, body.t, atol=EXACT)
