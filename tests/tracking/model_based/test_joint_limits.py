"""Joints stay within their limits, and a fit is told which degrees of freedom it may change."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from airborne.body import Pose
from airborne.body.chain import motion_between, moved_pose, segment_jacobians
from airborne.tracking.model_based.degrees_of_freedom import (
    Freedom,
    Prior,
    all_joints,
    limb_of_segment,
    only,
    outward,
    root_only,
    within_limits,
)
from tests.support.people import HUMAN, swinging
from tests.support.scenes import FIGURE, standing
from tests.support.tolerances import EXACT, ROUNDTRIP, SOLVED

LOW, HIGH = np.moveaxis(HUMAN.limits_rad, -1, 0)
NAMES = [segment.name for segment in HUMAN.segments]
ALL = all_joints(HUMAN)
POSE = swinging(0)
TRUNK = {"pelvis", "torso", "chest"}


def is_within(pose: Pose) -> bool:
    return bool(np.all((pose.joint_angles >= LOW - EXACT) & (pose.joint_angles <= HIGH + EXACT)))


def motions(n: int, size: float, seed: int = 0) -> np.ndarray:
    return size * np.random.default_rng(seed).normal(size=(n, len(ALL.columns)))


def bent(name: str, *xyz: float) -> Pose:
    """The pose with one joint at other angles [rad]."""
    angles = POSE.joint_angles.copy()
    angles[NAMES.index(name) - 1] = xyz
    return replace(POSE, joint_angles=angles)


def approached(target: Pose, start: Pose = POSE, prior: Prior | None = None, sd_rad: float = 0.01) -> Pose:
    """Where steps toward a target, as sure as `sd_rad`, end."""
    H = np.eye(len(ALL.columns)) / sd_rad**2
    pose = start
    for _ in range(12):
        pose = ALL.moved(pose, ALL.step(pose, H, H @ motion_between(pose, target), prior))
    return pose


@pytest.mark.parametrize("size", [0.2, 1.0])
def test_moved_pose_is_within_the_limits_however_large_the_motion(size):
    left = 0
    for motion in motions(20, size):
        left += not is_within(moved_pose(POSE, motion))
        assert is_within(ALL.moved(POSE, motion))
    assert left == 20  # without the limits each would have gone beyond


def test_pose_within_limits_is_left_as_it_is_and_one_beyond_goes_to_the_nearest_angle():
    np.testing.assert_array_equal(within_limits(HUMAN, POSE).joint_angles, POSE.joint_angles)
    beyond = replace(POSE, joint_angles=np.random.default_rng(1).normal(scale=3, size=LOW.shape))
    held = within_limits(HUMAN, beyond)
    assert is_within(held)
    np.testing.assert_array_equal(held.joint_angles, np.clip(beyond.joint_angles, LOW, HIGH))
    np.testing.assert_array_equal(within_limits(HUMAN, held).joint_angles, held.joint_angles)


def test_steps_reach_a_target_within_the_limits():
    target = bent("shank_left", 1.9, 0.05, -0.1)
    np.testing.assert_allclose(approached(target).joint_angles, target.joint_angles, atol=SOLVED)


@pytest.mark.parametrize(("knee_deg", "end_deg"), [(-60, -5), (170, 140)])
def test_target_beyond_a_limit_is_followed_to_the_limit(knee_deg, end_deg):
    end = approached(bent("shank_left", np.radians(knee_deg), 0, 0))
    assert is_within(end)
    knee_rad = end.joint_angles[NAMES.index("shank_left") - 1]
    np.testing.assert_allclose(knee_rad, [np.radians(end_deg), 0, 0], atol=SOLVED)
    others = np.arange(len(NAMES) - 1) != NAMES.index("shank_left") - 1
    np.testing.assert_allclose(end.joint_angles[others], POSE.joint_angles[others], atol=SOLVED)


def test_step_itself_stops_about_where_the_limit_is():
    """The limit is held by half a degree's firmness against pictures that are as sure as 0.05 rad."""
    target, H = bent("shank_left", -0.6, 0, 0), np.eye(len(ALL.columns)) / 0.05**2
    step = ALL.step(POSE, H, H @ motion_between(POSE, target))
    knee_rad = moved_pose(POSE, step).joint_angles[NAMES.index("shank_left") - 1, 0]
    assert abs(knee_rad - np.radians(-5)) < np.radians(1.5)


def test_what_the_pictures_do_not_show_stays_where_it_is_without_a_prior():
    nothing = np.zeros((len(ALL.columns),) * 2)
    np.testing.assert_array_equal(ALL.step(POSE, nothing, nothing[0]), 0)


def test_what_the_pictures_do_not_show_goes_where_it_is_expected():
    nothing = np.zeros((len(ALL.columns),) * 2)
    expected = within_limits(HUMAN, moved_pose(POSE, motions(1, 0.1)[0]))
    firm = Prior(expected, np.full(len(ALL.columns), 1e-3))
    pose = ALL.moved(POSE, ALL.step(POSE, nothing, nothing[0], firm))
    np.testing.assert_allclose(motion_between(expected, pose), 0, atol=2e-3)


def test_joints_that_nothing_is_said_of_come_to_rest_in_the_zero_pose():
    nothing, loose, pose = np.zeros((len(ALL.columns),) * 2), Prior(POSE, np.full(len(ALL.columns), 1e3)), POSE
    for _ in range(60):
        pose = ALL.moved(pose, ALL.step(pose, nothing, nothing[0], loose))
    np.testing.assert_allclose(pose.joint_angles, np.clip(0.0, LOW, HIGH), atol=SOLVED)


def test_priors_step_is_downhill_in_its_cost():
    prior = Prior(POSE, np.full(len(ALL.columns), 0.2))
    away = within_limits(HUMAN, moved_pose(POSE, motions(1, 0.15)[0]))
    nothing = np.zeros((len(ALL.columns),) * 2)
    nearer = ALL.moved(away, ALL.step(away, nothing, nothing[0], prior))
    assert ALL.prior_cost(nearer, prior) < 0.5 * ALL.prior_cost(away, prior)
    assert ALL.prior_cost(away, None) == 0


def test_loosened_prior_says_little_of_the_columns_named_and_the_same_of_the_others():
    prior = Prior(POSE, np.full(len(ALL.columns), 0.02))
    loose = prior.loosened(np.array([7, 9]))
    assert np.all(loose.sd[[7, 9]] > 1)
    np.testing.assert_array_equal(np.delete(loose.sd, [7, 9]), np.delete(prior.sd, [7, 9]))
    np.testing.assert_array_equal(prior.sd, 0.02)


@pytest.mark.parametrize("freedom", [root_only(HUMAN), ALL, *outward(HUMAN), only(HUMAN, np.array([6, 7]))])
def test_jacobian_has_the_columns_that_are_free_and_whole_puts_them_back(freedom):
    posed = HUMAN.with_pose(POSE)
    full = segment_jacobians(posed, posed.t[0])
    motion = np.random.default_rng(0).normal(size=len(freedom.columns))
    whole = freedom.whole(motion)
    np.testing.assert_allclose(freedom.jacobian(posed, posed.t[0]) @ motion, full @ whole, atol=ROUNDTRIP)
    np.testing.assert_array_equal(whole[freedom.columns], motion)
    assert np.count_nonzero(whole) == len(freedom.columns)


@pytest.mark.parametrize("model", [HUMAN, FIGURE])
def test_outward_stages_nest_from_the_root_to_everything(model):
    stages = [set(freedom.columns) for freedom in outward(model)]
    assert set(range(6)) <= stages[0]
    assert all(inner < outer for inner, outer in pairwise(stages))
    assert stages[-1] == set(all_joints(model).columns)
    for stage in stages:
        moved = {(column - 3) // 3 for column in stage if column >= 6}
        assert all(parent == 0 or parent in moved for parent in model.parents[list(moved)])


def test_trunk_goes_first_and_hands_and_feet_last():
    stages = outward(HUMAN)
    of_stage = [{NAMES[(column - 3) // 3] for column in stage.columns if column >= 6} for stage in stages]
    assert of_stage[0] == TRUNK - {"pelvis"}
    assert of_stage[-1] - of_stage[-2] == {"hand_left", "hand_right"}


def test_each_limb_is_named_for_the_segment_that_hangs_on_the_trunk():
    limb = {name: NAMES[first] if first >= 0 else "" for name, first in zip(NAMES, limb_of_segment(HUMAN), strict=True)}
    assert {name for name in NAMES if not limb[name]} == TRUNK
    for side in ("left", "right"):
        assert {name for name in NAMES if limb[name] == f"thigh_{side}"} == {
            f"{each}_{side}" for each in ("thigh", "shank", "foot")
        }
        assert {name for name in NAMES if limb[name] == f"shoulder_{side}"} == {
            f"{each}_{side}" for each in ("shoulder", "upper_arm", "forearm", "hand")
        }
    assert limb["head"] == "head"


def test_freedom_of_some_segments_moves_nothing_else():
    chosen = np.array([NAMES.index(name) for name in ("forearm_left", "foot_right")])
    freedom = only(HUMAN, chosen)
    moved = freedom.moved(POSE, np.full(len(freedom.columns), 0.05))
    changed = np.flatnonzero(np.abs(moved.joint_angles - POSE.joint_angles).max(axis=1) > EXACT) + 1
    assert set(changed) == set(chosen)
    np.testing.assert_allclose(moved.world_from_root.as_matrix(), POSE.world_from_root.as_matrix(), atol=EXACT)


def test_body_in_one_piece_has_no_limits_to_meet():
    root = root_only(FIGURE)
    motion = np.array([0.1, -0.2, 0.3, 0.2, 0.1, -0.3])
    moved = root.moved(standing(0), motion)
    np.testing.assert_allclose(motion_between(standing(0), moved)[:6], motion, atol=ROUNDTRIP)
    np.testing.assert_allclose(moved.joint_angles, standing(0).joint_angles, atol=EXACT)
    assert isinstance(root, Freedom)
