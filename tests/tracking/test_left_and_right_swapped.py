"""Left-right swaps: legs that have changed sides are put right."""

import numpy as np
import pytest

from airborne.body import Pose
from airborne.body.chain import move_pose
from airborne.tracking.model_based.left_right_swap import is_nearer, swap_limbs
from tests.support.bodies import is_within_limits
from tests.support.people import HUMAN, mean_errors_mm, person, swinging, tracker, wrong
from tests.support.scenes import CROSS, FIGURE, standing, statuses, thrown, track
from tests.support.tolerances import EXACT, ROUNDTRIP

SCENE = person()
TRUTH = SCENE.start()
LEGS = {HUMAN.index_of(f"{each}_left"): HUMAN.index_of(f"{each}_right") for each in ("thigh", "shank", "foot")}
EITHER = [*LEGS, *LEGS.values()]
OTHERS = [i for i in range(len(HUMAN.segments)) if i not in EITHER]


def with_legs_swapped(pose: Pose) -> Pose:
    """The one of the two swaps in which the legs have changed sides."""
    joints = np.array(EITHER) - 1
    changed = [
        np.abs(each.joint_angles - pose.joint_angles)[joints].max() > ROUNDTRIP for each in swap_limbs(HUMAN, pose)
    ]
    assert sum(changed) == 1
    return swap_limbs(HUMAN, pose)[changed.index(True)]


def test_there_is_a_swap_for_the_arms_and_one_for_the_legs_and_none_without_pairs():
    assert len(swap_limbs(HUMAN, TRUTH)) == 2
    assert len(swap_limbs(FIGURE, standing(0))) == 1
    assert swap_limbs(CROSS, thrown(0)) == []


def test_each_segment_of_a_swapped_leg_takes_its_counterparts_orientation_and_nothing_else_moves():
    before, after = HUMAN.with_pose(TRUTH), HUMAN.with_pose(with_legs_swapped(TRUTH))
    for left, right in LEGS.items():
        np.testing.assert_allclose(after.R[left], before.R[right], atol=ROUNDTRIP)
        np.testing.assert_allclose(after.R[right], before.R[left], atol=ROUNDTRIP)
    np.testing.assert_allclose(after.t[OTHERS], before.t[OTHERS], atol=EXACT)


@pytest.mark.parametrize("time_s", [0.0, 0.05, 0.1])
def test_legs_swapped_twice_are_where_they_were(time_s):
    pose = swinging(time_s)
    back = with_legs_swapped(with_legs_swapped(pose))
    np.testing.assert_allclose(back.joint_angles, pose.joint_angles, atol=ROUNDTRIP)


@pytest.mark.parametrize("swap", [0, 1])
def test_swapped_pose_is_within_the_limits(swap):
    assert is_within_limits(HUMAN, swap_limbs(HUMAN, TRUTH)[swap])


def test_truth_is_nearer_than_its_swap_by_more_than_the_margin():
    swap = with_legs_swapped(TRUTH)
    assert is_nearer(HUMAN, TRUTH, swap, expected=TRUTH)
    assert not is_nearer(HUMAN, swap, TRUTH, expected=TRUTH)
    assert is_nearer(HUMAN, swap, TRUTH, expected=swap)


def test_neither_of_two_poses_is_nearer_when_they_are_the_same_or_equally_far():
    assert not is_nearer(HUMAN, TRUTH, TRUTH, expected=with_legs_swapped(TRUTH))
    turn = np.zeros(6 + 3 * len(TRUTH.joint_angles))
    turn[3 + 3 * HUMAN.index_of("thigh_left")] = np.radians(20)
    either_way = [move_pose(TRUTH, sign * turn) for sign in (1, -1)]
    assert not is_nearer(HUMAN, *either_way, expected=TRUTH)
    assert not is_nearer(HUMAN, *either_way[::-1], expected=TRUTH)


def test_start_with_the_legs_swapped_is_put_right():
    start = wrong(with_legs_swapped(TRUTH), seed=4)
    far_mm = 1000 * np.linalg.norm(HUMAN.with_pose(start).t - HUMAN.with_pose(TRUTH).t, axis=1)
    assert far_mm.max() > 300
    estimates = track(SCENE, range(2), tracker(SCENE, start))
    assert statuses(estimates) == ["tracked"] * 2
    assert mean_errors_mm(SCENE, estimates).max() < 5
