import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from tests.support.bodies import random_body, random_pose
from tests.support.tolerances import EXACT


def test_segments_lie_where_their_joints_and_turns_put_them():
    """The product of 4 x 4 matrices from the root to each segment, built by SciPy."""
    rng = np.random.default_rng(0)
    model = random_body(["ellipsoid", "box", "mesh"], rng)
    poses = [random_pose(rng) for _ in range(5)]
    roots = np.stack([pose.world_from_root.as_matrix() for pose in poses])
    angles = np.stack([pose.joint_angles for pose in poses])
    R, t = model.pose_segments(roots[:, :3, :3], roots[:, :3, 3], angles)
    for h, pose in enumerate(poses):
        world = [roots[h]]
        for segment in range(1, len(model.segments)):
            own = RigidTransform.from_components(
                model.joints_m[segment], Rotation.from_euler("XYZ", angles[h, segment - 1])
            )
            world.append(world[model.parents[segment]] @ own.as_matrix())
        np.testing.assert_allclose(R[h], np.array(world)[:, :3, :3], atol=EXACT)
        np.testing.assert_allclose(t[h], np.array(world)[:, :3, 3], atol=EXACT)
        body = model.with_pose(pose)
        np.testing.assert_array_equal(body.R, R[h])
        np.testing.assert_array_equal(body.t, t[h])
