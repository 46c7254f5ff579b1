"""Segments do not pass through each other: what overlaps, how deep, and which way out."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from airborne.body import Pose, human18
from airborne.body.chain import move_pose
from airborne.body.contact import FLESH_M, contact_model, overlaps
from tests.support.people import swinging
from tests.support.scenes import FIGURE

HUMAN = human18()
CONTACT = contact_model(HUMAN)
NAMES = [segment.name for segment in HUMAN.segments]


def pose(**angles_deg):
    angles = np.zeros((HUMAN.n_joints, 3))
    for name, xyz in angles_deg.items():
        angles[HUMAN.index_of(name) - 1] = np.radians(xyz)
    return Pose(world_from_root=RigidTransform.identity(), joint_angles=angles)


def found(pose):
    posed = HUMAN.with_pose(pose)
    return overlaps(CONTACT, posed.R, posed.t)


INSIDE = pose(upper_arm_left=(0, 20, 0))  # a straight arm goes into the trunk


@pytest.mark.parametrize(
    "free", [pose(), swinging(0), pose(upper_arm_left=(0, -170, 0)), pose(forearm_left=(-140, 0, 0))]
)
def test_body_that_does_not_touch_itself_has_no_overlap(free):
    assert not len(found(free).depth_m)


def test_arm_inside_the_trunk_overlaps_it():
    result = found(INSIDE)
    pairs = {(NAMES[a].split("_")[0], NAMES[b]) for a, b in result.segments}
    assert {("forearm", "pelvis"), ("forearm", "torso")} <= pairs
    assert result.depth_m.max() > 0.05


def test_tucked_thighs_rest_on_the_trunk():
    tuck = found(
        pose(thigh_left=(-125, 0, 0), thigh_right=(-125, 0, 0), shank_left=(120, 0, 0), shank_right=(120, 0, 0))
    )
    assert np.all(tuck.depth_m < FLESH_M)


def test_depth_falls_along_the_normal():
    result, step = found(INSIDE), 0.0005
    posed = HUMAN.with_pose(INSIDE)
    one = int(np.argmin(result.depth_m))
    sphere, other = result.segments[one]
    t = posed.t.copy()
    t[sphere] += step * result.normal[one]
    again = overlaps(CONTACT, posed.R, t)
    same = (again.segments == (sphere, other)).all(axis=1)
    assert np.abs(again.depth_m[same] - (result.depth_m[one] - step)).min() < 0.1 * step


def test_where_the_body_is_does_not_matter():
    moved = move_pose(INSIDE, np.concatenate([[3.0, -2.0, 1.0, 0.4, 1.0, -0.3], np.zeros(51)]))
    np.testing.assert_allclose(found(moved).depth_m, found(INSIDE).depth_m, atol=1e-9)


def test_body_of_boxes_has_nothing_to_overlap():
    contact = contact_model(FIGURE)
    posed = FIGURE.with_pose(Pose(world_from_root=RigidTransform.identity()))
    assert not len(overlaps(contact, posed.R, posed.t).depth_m)
