"""A body is a tree of rigid segments."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Box, Ellipsoid, Part, Pose, Segment
from airborne.errors import BodyError
from tests.support.tolerances import EXACT

BALL = Ellipsoid(np.array([0.1, 0.1, 0.1]))


def part(name="part", colour=(1.0, 2.0, 3.0)):
    return Part(name, BALL, RigidTransform.identity(), None if colour is None else np.array(colour))


def segment(name, parent=None, joint=(0.0, 0.0, 0.0), parts=None):
    return Segment(name, parent, np.array(joint, float), (part(name),) if parts is None else parts)


def leg():
    """A chain of four with a side branch: the pelvis carries two thighs."""
    return BodyModel(
        "leg",
        (
            segment("pelvis"),
            segment("thigh", "pelvis", (0.1, 0.0, -0.1)),
            segment("shank", "thigh", (0.0, 0.02, -0.4)),
            segment("other", "pelvis", (-0.1, 0.0, -0.1)),
            segment("foot", "shank", (0.0, 0.0, -0.4)),
        ),
    )


def random_pose(seed, joints=4):
    rng = np.random.default_rng(seed)
    root = RigidTransform.from_components(rng.normal(size=3), Rotation.random(rng=rng))
    return Pose(world_from_root=root, joint_angles=rng.uniform(-2, 2, (joints, 3)))


@pytest.mark.parametrize("seed", range(5))
def test_each_segment_stands_where_the_transforms_along_its_chain_put_it(seed):
    model, pose = leg(), random_pose(seed)
    posed = model.with_pose(pose)
    chains = {0: (), 1: (1,), 2: (1, 2), 3: (3,), 4: (1, 2, 4)}
    for index, chain in chains.items():
        world_from_segment = pose.world_from_root
        for step in chain:
            about_x, about_y, about_z = np.eye(3) * pose.joint_angles[step - 1][:, None]
            turn = Rotation.from_rotvec(about_x) * Rotation.from_rotvec(about_y) * Rotation.from_rotvec(about_z)
            world_from_segment *= RigidTransform.from_components(model.segments[step].joint_m, turn)
        np.testing.assert_allclose(posed.R[index], world_from_segment.rotation.as_matrix(), atol=EXACT)
        np.testing.assert_allclose(posed.t[index], world_from_segment.translation, atol=EXACT)


@pytest.mark.parametrize("seed", range(5))
def test_moving_a_posed_body_is_posing_the_moved_body(seed):
    model, pose = leg(), random_pose(seed)
    delta = np.random.default_rng(seed).normal(size=6)
    moved, posed = model.with_pose(pose).move(delta), model.with_pose(pose.move(delta[:3], delta[3:]))
    np.testing.assert_allclose(moved.R, posed.R, atol=EXACT)
    np.testing.assert_allclose(moved.t, posed.t, atol=EXACT)


def test_moving_turns_about_the_root_and_the_world_axes():
    pose = Pose(world_from_root=RigidTransform.from_translation([1.0, 2.0, 3.0]))
    turned = pose.move(np.array([0, 0, 0.5]), np.array([0, 0, np.pi / 2])).world_from_root
    np.testing.assert_allclose(turned.translation, [1, 2, 3.5], atol=EXACT)
    np.testing.assert_allclose(turned.rotation.apply([1, 0, 0]), [0, 1, 0], atol=EXACT)


def test_root_of_a_posed_body_is_the_poses_root():
    pose = random_pose(3)
    posed, root = leg().with_pose(pose), pose.world_from_root.as_matrix()
    np.testing.assert_allclose(posed.R[0], root[:3, :3], atol=EXACT)
    np.testing.assert_allclose(posed.t[0], root[:3, 3], atol=EXACT)


def test_pose_without_angles_has_straight_joints():
    pose = Pose(world_from_root=RigidTransform.identity())
    posed = leg().with_pose(pose)
    np.testing.assert_allclose(posed.R, np.tile(np.eye(3), (5, 1, 1)), atol=EXACT)
    np.testing.assert_allclose(posed.t[4], [0.1, 0.02, -0.9], atol=EXACT)


def test_pose_of_another_body_is_refused():
    with pytest.raises(BodyError, match="body 'leg' has 4 joints, the pose 3"):
        leg().with_pose(random_pose(0, joints=3))


def test_colours_are_given_in_the_order_of_the_parts():
    segments = (
        segment("root", parts=(part("a"), part("b", None))),
        segment("limb", "root", parts=()),
        segment("end", "limb", parts=(part("c"),)),
    )
    model = BodyModel("body", segments)
    assert model.needs_colours
    coloured = model.with_colours(np.arange(9).reshape(3, 3))
    assert not coloured.needs_colours
    assert [p.name for p in coloured.parts] == ["a", "b", "c"]
    np.testing.assert_array_equal([p.colour for p in coloured.parts], np.arange(9).reshape(3, 3))
    assert model.needs_colours, "the body given stays as it was"


@pytest.mark.parametrize(
    ("segments", "complaint"),
    [
        ((segment("a"), segment("a", "a")), "two segments are named 'a'"),
        ((segment("a", "b"),), "exactly the first segment has no parent"),
        ((segment("a"), segment("b")), "exactly the first segment has no parent"),
        ((segment("a"), segment("b", "c"), segment("c", "a")), "parent 'c' must stand before it; so far: a"),
        ((segment("a"), segment("b", "b")), "parent 'b' must stand before it; so far: a"),
        ((segment("a", parts=()),), "has no part to see"),
    ],
)
def test_tree_that_is_no_tree_is_refused(segments, complaint):
    with pytest.raises(BodyError, match=complaint):
        BodyModel("body", segments)


@pytest.mark.parametrize("sizes", [(0, 1, 1), (-1, 1, 1), (1, 1), (np.nan, 1, 1), (np.inf, 1, 1)])
def test_shape_without_three_lengths_above_zero_is_refused(sizes):
    with pytest.raises(BodyError, match="needs three lengths above zero, in metres"):
        Box(np.array(sizes, float))
    with pytest.raises(BodyError, match="needs three lengths above zero, in metres"):
        Ellipsoid(np.array(sizes, float))
