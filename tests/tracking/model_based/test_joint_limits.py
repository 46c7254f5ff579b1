"""Joints are held softly at their limits, and a fit changes only its own degrees of freedom."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from airborne.body import Pose
from airborne.body.chain import clamp_to_limits, delta_between, move_pose, segment_jacobians
from airborne.geometry.rotations import geodesic, matrix_from_angles
from airborne.tracking.model_based.degrees_of_freedom import (
    DegreesOfFreedom,
    PosePrior,
    all_joints,
    joints_of,
    limb_of_segment,
    proximal_to_distal,
    root_only,
)
from tests.support.bodies import is_within_limits
from tests.support.people import HUMAN, swinging
from tests.support.scenes import FIGURE, standing
from tests.support.tolerances import EXACT, ROUNDTRIP, SOLVED

NAMES = [segment.name for segment in HUMAN.segments]
ALL = all_joints(HUMAN)
POSE = swinging(0)
TRUNK = {"pelvis", "torso", "chest"}


def deltas(n: int, size: float, seed: int = 0) -> np.ndarray:
    return size * np.random.default_rng(seed).normal(size=(n, len(ALL.columns)))


def bend(name: str, *xyz: float) -> Pose:
    """The pose with one joint at other angles [rad]."""
    angles = POSE.joint_angles.copy()
    angles[NAMES.index(name) - 1] = xyz
    return replace(POSE, joint_angles=angles)


def approach(target: Pose, start: Pose = POSE, prior: PosePrior | None = None, sd_rad: float = 0.01) -> Pose:
    """Where steps toward a target with an sd of `sd_rad` end."""
    H = np.eye(len(ALL.columns)) / sd_rad**2
    pose = start
    for _ in range(12):
        pose = ALL.update(pose, ALL.solve_step(pose, H, H @ delta_between(pose, target), prior))
    return pose


def turned_between(one: Pose, other: Pose) -> np.ndarray:
    """The angle between each joint's rotations in two poses [rad]."""
    return geodesic(matrix_from_angles(one.joint_angles), matrix_from_angles(other.joint_angles))


def test_pose_within_limits_is_left_as_it_is_and_one_beyond_is_brought_within():
    np.testing.assert_array_equal(clamp_to_limits(HUMAN, POSE).joint_angles, POSE.joint_angles)
    beyond = replace(POSE, joint_angles=np.random.default_rng(1).normal(scale=3, size=POSE.joint_angles.shape))
    held = clamp_to_limits(HUMAN, beyond)
    assert not is_within_limits(HUMAN, beyond)
    assert is_within_limits(HUMAN, held)
    np.testing.assert_allclose(clamp_to_limits(HUMAN, held).joint_angles, held.joint_angles, atol=ROUNDTRIP)


def test_steps_reach_a_target_within_the_limits():
    target = bend("shank_left", 1.9, 0.05, -0.1)
    np.testing.assert_allclose(approach(target).joint_angles, target.joint_angles, atol=SOLVED)


@pytest.mark.parametrize(("knee_deg", "end_deg"), [(-60, -5), (170, 140)])
def test_target_beyond_a_limit_is_followed_a_little_beyond_it(knee_deg, end_deg):
    """The limit has an sd of 3 degrees, the images one of 10 here."""
    end = approach(bend("shank_left", np.radians(knee_deg), 0, 0), sd_rad=np.radians(10))
    k = NAMES.index("shank_left") - 1
    stiffness = (10 / 3) ** 2
    np.testing.assert_allclose(
        np.degrees(end.joint_angles[k]), [(stiffness * end_deg + knee_deg) / (stiffness + 1), 0, 0], atol=0.5
    )
    others = np.arange(len(NAMES) - 1) != k
    np.testing.assert_allclose(end.joint_angles[others], POSE.joint_angles[others], atol=SOLVED)


def test_arm_goes_through_overhead_whichever_way_its_angles_are_written():
    """Overhead and forward: on the way the x-y-z angles of the upper arm pass their singularity."""
    overhead, forward = bend("upper_arm_left", 0, -np.pi + 0.2, 0), bend("upper_arm_left", -np.pi / 2, 0.1, 0)
    forward = clamp_to_limits(HUMAN, forward)
    assert is_within_limits(HUMAN, overhead)
    assert turned_between(approach(forward, start=overhead), forward).max() < np.radians(0.1)


def test_cost_of_limits_is_the_squared_angle_beyond_them():
    assert ALL.prior_cost(POSE, None) == 0
    beyond = bend("shank_left", np.radians(-11), 0, 0)
    assert ALL.prior_cost(beyond, None) == pytest.approx(0.5 * (6 / 3) ** 2, rel=1e-9)


def test_what_the_images_do_not_show_stays_where_it_is_without_a_prior():
    nothing = np.zeros((len(ALL.columns),) * 2)
    np.testing.assert_array_equal(ALL.solve_step(POSE, nothing, nothing[0]), 0)


def test_what_the_images_do_not_show_goes_where_it_is_expected():
    nothing = np.zeros((len(ALL.columns),) * 2)
    expected = clamp_to_limits(HUMAN, move_pose(POSE, deltas(1, 0.1)[0]))
    firm = PosePrior(expected, np.full(len(ALL.columns), 1e-3))
    pose = ALL.update(POSE, ALL.solve_step(POSE, nothing, nothing[0], firm))
    np.testing.assert_allclose(delta_between(expected, pose), 0, atol=2e-3)


def test_joints_without_observation_come_to_rest_in_the_zero_pose():
    nothing, wide, pose = np.zeros((len(ALL.columns),) * 2), PosePrior(POSE, np.full(len(ALL.columns), 1e3)), POSE
    for _ in range(80):
        pose = ALL.update(pose, ALL.solve_step(pose, nothing, nothing[0], wide))
    np.testing.assert_allclose(pose.joint_angles, 0, atol=SOLVED)


def test_priors_step_is_downhill_in_its_cost():
    prior = PosePrior(POSE, np.full(len(ALL.columns), 0.2))
    away = clamp_to_limits(HUMAN, move_pose(POSE, deltas(1, 0.15)[0]))
    nothing = np.zeros((len(ALL.columns),) * 2)
    nearer = ALL.update(away, ALL.solve_step(away, nothing, nothing[0], prior))
    assert ALL.prior_cost(nearer, prior) < 0.5 * ALL.prior_cost(away, prior)
    assert ALL.prior_cost(away, None) == pytest.approx(0)


def test_widened_prior_is_wide_for_the_columns_named_and_the_same_for_the_others():
    prior = PosePrior(POSE, np.full(len(ALL.columns), 0.02))
    wide = prior.widen(np.array([7, 9]))
    assert np.all(wide.sd[[7, 9]] > 1)
    np.testing.assert_array_equal(np.delete(wide.sd, [7, 9]), np.delete(prior.sd, [7, 9]))
    np.testing.assert_array_equal(prior.sd, 0.02)


@pytest.mark.parametrize(
    "dofs", [root_only(HUMAN), ALL, *proximal_to_distal(HUMAN), joints_of(HUMAN, np.array([6, 7]))]
)
def test_jacobian_has_the_columns_that_are_free_and_embed_puts_them_back(dofs):
    posed = HUMAN.with_pose(POSE)
    full = segment_jacobians(posed, posed.t[0])
    delta = np.random.default_rng(0).normal(size=len(dofs.columns))
    whole = dofs.embed(delta)
    np.testing.assert_allclose(dofs.jacobian(posed, posed.t[0]) @ delta, full @ whole, atol=ROUNDTRIP)
    np.testing.assert_array_equal(whole[dofs.columns], delta)
    assert np.count_nonzero(whole) == len(dofs.columns)


@pytest.mark.parametrize("model", [HUMAN, FIGURE])
def test_proximal_to_distal_stages_nest_from_the_root_to_everything(model):
    stages = [set(dofs.columns) for dofs in proximal_to_distal(model)]
    assert set(range(6)) <= stages[0]
    assert all(inner < outer for inner, outer in pairwise(stages))
    assert stages[-1] == set(all_joints(model).columns)
    for stage in stages:
        moved = {(column - 3) // 3 for column in stage if column >= 6}
        assert all(parent == 0 or parent in moved for parent in model.parents[list(moved)])


def test_trunk_goes_first_and_hands_and_feet_last():
    stages = proximal_to_distal(HUMAN)
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


def test_joints_of_some_segments_move_nothing_else():
    chosen = np.array([NAMES.index(name) for name in ("forearm_left", "foot_right")])
    dofs = joints_of(HUMAN, chosen)
    moved = dofs.update(POSE, np.full(len(dofs.columns), 0.05))
    changed = np.flatnonzero(np.abs(moved.joint_angles - POSE.joint_angles).max(axis=1) > EXACT) + 1
    assert set(changed) == set(chosen)
    np.testing.assert_allclose(moved.world_from_root.as_matrix(), POSE.world_from_root.as_matrix(), atol=EXACT)


def test_body_in_one_piece_has_no_limits_to_meet():
    root = root_only(FIGURE)
    delta = np.array([0.1, -0.2, 0.3, 0.2, 0.1, -0.3])
    moved = root.update(standing(0), delta)
    np.testing.assert_allclose(delta_between(standing(0), moved)[:6], delta, atol=ROUNDTRIP)
    np.testing.assert_allclose(moved.joint_angles, standing(0).joint_angles, atol=EXACT)
    assert isinstance(root, DegreesOfFreedom)
