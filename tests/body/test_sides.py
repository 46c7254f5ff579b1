"""Left and right, and crossed legs, told from where the joints are."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Pose
from airborne.body.sides import are_crossed, leg_pairs, limb_pairs, other_side
from airborne.motion import landmarks
from airborne.motion.joints import joint_statuses
from tests.support.motions import motion_of
from tests.support.people import HUMAN

UPRIGHT = Rotation.identity()


def standing(*, spread_deg: float = 0.0, turn: Rotation = UPRIGHT) -> Pose:
    """A person whose legs are spread sideways, or past each other where that is negative."""
    angles = np.zeros((HUMAN.n_joints, 3))
    for side, sign in (("left", 1), ("right", -1)):
        angles[HUMAN.index_of(f"thigh_{side}") - 1, 1] = sign * np.radians(spread_deg)
    return Pose(world_from_root=RigidTransform.from_components([1.0, 2.0, 3.0], turn), joint_angles=angles)


def crossed(pose: Pose) -> bool:
    return bool(are_crossed(HUMAN, HUMAN.with_pose(pose).t))


@pytest.mark.parametrize("seed", range(3))
def test_legs_are_crossed_where_they_pass_each_other_however_the_body_lies(seed):
    turn = Rotation.random(rng=np.random.default_rng(seed))
    outward = next(sign for sign in (1, -1) if not crossed(standing(spread_deg=sign * 30)))
    assert not crossed(standing(turn=turn))
    assert not crossed(standing(spread_deg=outward * 30, turn=turn))
    assert crossed(standing(spread_deg=-outward * 30, turn=turn))


def test_many_frames_are_told_as_each_of_them_is():
    poses = [standing(spread_deg=each) for each in (-30, -10, 0, 10, 30)]
    t = np.stack([HUMAN.with_pose(pose).t for pose in poses])
    assert are_crossed(HUMAN, t).tolist() == [crossed(pose) for pose in poses]


def test_a_body_without_legs_has_none_to_cross():
    trunk = BodyModel("trunk", HUMAN.segments[:3])
    assert not leg_pairs(trunk)
    assert not are_crossed(trunk, np.zeros((4, 3, 3))).any()


@pytest.mark.parametrize(("n_views", "status"), [(2, "uncertain"), (3, "tracked")])
def test_crossed_legs_are_uncertain_where_only_two_cameras_show_them(n_views, status):
    inward = next(sign for sign in (1, -1) if crossed(standing(spread_deg=sign * 30)))
    poses = [standing(), standing(spread_deg=inward * 30)]
    motion = motion_of(HUMAN, poses, covariance=1e-8 * np.eye(HUMAN.n_dofs))
    motion = replace(motion, n_views=np.full(2, n_views))
    names = [landmark.name for landmark in HUMAN.landmarks]
    statuses = joint_statuses(motion, HUMAN, landmarks(motion, HUMAN)[1])
    assert set(statuses[0]) == {"tracked"}
    for name in ("hip_left", "knee_right", "ankle_left"):
        assert statuses[1, names.index(name)] == status
    assert statuses[1, names.index("wrist_left")] == "tracked"


def test_the_other_side_of_the_other_side_is_the_name_itself():
    assert other_side("thigh_left_skin") == "thigh_right_skin"
    assert other_side("head") == "head"
    for name in (landmark.name for landmark in HUMAN.landmarks):
        assert other_side(other_side(name)) == name


def test_pairs_of_limbs_are_of_both_sides_from_the_trunk_on():
    for limb in limb_pairs(HUMAN):
        assert HUMAN.parents[limb[0][0]] == HUMAN.parents[limb[0][1]]
        for left, right in limb:
            assert other_side(HUMAN.segments[left].name) == HUMAN.segments[right].name
