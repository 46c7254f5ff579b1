"""Synthetic block jumps do what bodies can do: they stand, leave the floor, fly and land."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.body import human18
from airborne.synthetic.block.jump import build_jump
from airborne.synthetic.block.legs import LegSizes, axis_rotation, leg_angles, roll_foot
from airborne.synthetic.block.margins import NET_TOP_M, BodyVolume, gap_m, margins_of
from airborne.synthetic.block.motion import evaluate_clamped, translate
from airborne.synthetic.block.plan import JumpPlan
from airborne.synthetic.block.steps import STEP_S, approach_steps, foot_placements
from airborne.synthetic.block.waiting import WaitPlan, wait
from tests.support.tolerances import EXACT, ROUNDTRIP, SOLVED

BODY = human18(1.86, 78.0)
PLAN = JumpPlan(rise_m=0.47, position=np.array([0.4, -0.72]), yaw=np.pi, drift_m_s=np.array([0.3, 0.08]))
SIZES = LegSizes(0.46, 0.45, np.array([0.0, -0.058, -0.039]), 0.141, 0.034)


@pytest.fixture(
    scope="module",
    params=[("static", 0.0, 38.0), ("shuffle", 0.9, 38.0), ("crossover", -1.0, 50.0)],
    ids=lambda param: param[0],
)
def movement(request):
    approach, approach_m, knee = request.param
    return build_jump(BODY, replace(PLAN, approach=approach, approach_m=approach_m, knee_ready=knee))


def all_times(movement, rate=80):
    return np.arange(-1.4, movement.flight.duration_s + 0.9, 1 / rate)


def test_centre_of_mass_flies_a_parabola(movement):
    flight = movement.flight
    t = np.linspace(1e-6, flight.duration_s - 1e-6, 60)
    centre = movement.person.centre_of_mass(movement(t))
    parabola = flight.centre + np.outer(t, flight.velocity) + np.outer(t**2, [0, 0, -9.81 / 2])
    np.testing.assert_allclose(centre, parabola, atol=1e-10)
    steps = movement.person.centre_of_mass(movement(np.array([0.1, 0.2, 0.3])))
    np.testing.assert_allclose((steps[0] - 2 * steps[1] + steps[2]) / 0.01, [0, 0, -9.81], atol=1e-6)


def test_jump_rises_as_planned(movement):
    t = np.linspace(0, movement.flight.duration_s, 401)
    heights = movement.person.centre_of_mass(movement(t))[:, 2]
    assert heights.max() - heights[0] == pytest.approx(PLAN.rise_m, abs=1e-5)


def test_position_and_velocity_are_continuous_at_takeoff_and_landing(movement):
    h = 1e-5
    for edge in (0.0, movement.flight.duration_s):
        t = edge + h * np.array([-2, -1, 1, 2])
        poses = movement(t)
        for values in (movement.person.centre_of_mass(poses), movement.person.landmarks(poses)["knee_left"]):
            before, after = (values[1] - values[0]) / h, (values[3] - values[2]) / h
            np.testing.assert_allclose(values[1], values[2], atol=1e-3)
            np.testing.assert_allclose(before, after, atol=0.02)  # h times an acceleration of some 100 m/s^2
        at = movement(np.array([edge - 1e-9, edge + 1e-9]))
        np.testing.assert_allclose(at.joint_angles[0], at.joint_angles[1], atol=1e-6)


def test_acceleration_is_continuous_at_takeoff(movement):
    h = 1e-4
    t = h * np.array([-3, -2, -1, 0, 1, 2, 3])
    centre = movement.person.centre_of_mass(movement(t))
    double = (centre[:-2] - 2 * centre[1:-1] + centre[2:]) / h**2
    np.testing.assert_allclose(double[:, 2], -9.81, atol=0.3)  # its change in 0.2 ms


def test_push_off_is_one_that_muscles_can_make(movement):
    t = np.linspace(movement.before.centre_z.x[0], 0, 500)
    assert np.abs(movement.before.centre_z(t, 2)).max() < 30


def test_standing_feet_do_not_slide(movement):
    """The touching point of a rolling foot is at rest: the foot's velocity there, from its turn and its ankle."""
    leg, h, t = movement.person.leg, 1e-6, np.arange(-1.3, 0.0, 0.02)
    ends = [movement.person.pose_segments(movement(t + step)) for step in (-h, h)]
    for side, foot in enumerate(movement.before.feet):
        is_down = (
            evaluate_clamped(foot.lift, t - h) + evaluate_clamped(foot.lift, t) + evaluate_clamped(foot.lift, t + h)
            == 0
        )
        assert is_down.sum() > 25
        k = movement.person.model.index_of(("foot_left", "foot_right")[side])
        pitch = evaluate_clamped(foot.pitch, t)
        a, b = leg.foot_half_length_m, leg.foot_half_height_m
        depth = np.hypot(a * np.sin(pitch), b * np.cos(pitch))
        touching = np.column_stack([0 * t, -(a**2) * np.sin(pitch) / depth, -(b**2) * np.cos(pitch) / depth])
        before, after = (np.einsum("nij,nj->ni", R[:, k], leg.foot_centre_m + touching) + q[:, k] for R, q in ends)
        assert np.linalg.norm(after - before, axis=1)[is_down].max() / (2 * h) < SOLVED
        np.testing.assert_allclose(before[is_down, 2], 0, atol=1e-4)


def test_no_limb_changes_its_length(movement):
    marks = movement.person.landmarks(movement(all_times(movement, 60)))
    for a, b in (("hip_left", "knee_left"), ("knee_right", "ankle_right"), ("ankle_left", "toe_left")):
        lengths = np.linalg.norm(marks[a] - marks[b], axis=1)
        np.testing.assert_allclose(lengths, lengths[0], atol=ROUNDTRIP)


def test_body_stays_over_the_floor_on_its_side_of_the_net_and_within_its_joints(movement):
    margins = margins_of(movement.person, movement(all_times(movement)), side=-1)
    assert margins.floor_m > -ROUNDTRIP
    assert margins.net_m > 0
    assert margins.limits_rad > 0


def test_hands_reach_over_the_tape():
    movement = build_jump(BODY, PLAN)
    hands = movement.person.landmarks(movement(np.array([movement.flight.velocity[2] / 9.81])))["hand_left"]
    assert hands[0, 2] > NET_TOP_M + 0.1


def test_margins_see_a_body_under_the_floor_and_through_the_net():
    movement = build_jump(BODY, PLAN)
    t = np.array([-0.2])
    fair = margins_of(movement.person, movement(t), side=-1)
    poses = movement(t)
    sunk = margins_of(movement.person, poses._replace(root_t=poses.root_t - [0, 0, 0.05]), side=-1)
    assert sunk.floor_m == pytest.approx(fair.floor_m - 0.05, abs=ROUNDTRIP)
    through = margins_of(movement.person, translate(movement, np.array([0.0, 0.6]))(t), side=-1)
    assert through.net_m == pytest.approx(fair.net_m - 0.6, abs=1e-6)
    bent = poses._replace(joint_angles=poses.joint_angles - [1.0, 0, 0])
    assert margins_of(movement.person, bent, side=-1).limits_rad < 0


def test_translated_movement_is_the_same_elsewhere(movement):
    t, way = all_times(movement, 25), np.array([0.7, -0.3])
    here, there = movement(t), translate(movement, way)(t)
    np.testing.assert_allclose(there.root_t, here.root_t + np.array([0.7, -0.3, 0]), atol=ROUNDTRIP)
    np.testing.assert_allclose(there.joint_angles, here.joint_angles, atol=1e-7)


def test_leg_reaches_its_foot():
    rng, n = np.random.default_rng(0), 100
    R = axis_rotation(2, rng.normal(np.pi, 0.5, n)) @ axis_rotation(0, rng.normal(0.3, 0.2, n))
    hip = rng.normal(0, 0.1, (n, 3)) + np.array([0, 0, 0.7])
    position = np.column_stack([rng.normal(0, 0.1, (n, 2)), rng.normal(np.pi, 0.4, n)])
    ankle, R_foot = roll_foot(SIZES, position, rng.uniform(0, 0.8, n), np.zeros(n))
    angles, short = leg_angles(SIZES, R, hip, ankle=ankle, R_foot=R_foot)
    chain, end = R, hip
    for k, length in enumerate((SIZES.thigh_m, SIZES.shank_m, 0.0)):
        x, y, z = angles[:, k].T
        chain = chain @ axis_rotation(0, x) @ axis_rotation(1, y) @ axis_rotation(2, z)
        end = end + chain @ np.array([0, 0, -length])
    is_reached = short == 0
    assert is_reached.mean() > 0.9
    np.testing.assert_allclose(end[is_reached], ankle[is_reached], atol=EXACT)
    np.testing.assert_allclose(chain[is_reached], R_foot[is_reached], atol=EXACT)


def test_leg_that_is_too_short_says_by_how_much():
    straight = np.eye(3)[None]
    ankle = np.array([[0.0, 0.0, 1.0 - 0.95]])
    _, short = leg_angles(SIZES, straight, np.array([[0.0, 0.0, 1.0]]), ankle=ankle, R_foot=straight)
    assert short[0] == pytest.approx(0.95 - 0.91, abs=1e-4)


def test_level_foot_stands_on_its_sole_at_its_placement():
    ankle, R = roll_foot(SIZES, np.array([[0.3, -0.5, np.pi]]), np.zeros(1), np.zeros(1))
    centre = ankle[0] + R[0] @ SIZES.foot_centre_m
    np.testing.assert_allclose(centre, [0.3, -0.5, SIZES.foot_half_height_m], atol=EXACT)
    np.testing.assert_allclose(R[0] @ [0, -1, 0], [0, 1, 0], atol=EXACT)


@pytest.mark.parametrize("approach", ["shuffle", "crossover"])
def test_steps_end_where_and_when_they_should(approach):
    first, last = (
        foot_placements(np.array([0.0, -0.7]), np.pi, 0.36),
        foot_placements(np.array([1.0, -0.7]), np.pi, 0.36),
    )
    steps = approach_steps(approach, first, last, -0.4)
    assert steps[-1].start_s + STEP_S == pytest.approx(-0.4)
    for side in (0, 1):
        own = [step for step in steps if step.side == side]
        np.testing.assert_allclose(own[-1].placement, last[side], atol=EXACT)
    starts = np.array([step.start_s for step in steps])
    assert np.all(np.diff(starts) > STEP_S / 2)


def test_waiting_player_stands_and_steps():
    rng = np.random.default_rng(2)
    plan = WaitPlan(position=np.array([1.0, -4.0]), yaw=np.pi, approach_m=0.5, arrival_s=0.8, duration_s=1.4)
    movement = wait(rng, BODY, plan)
    poses = movement(np.arange(0, 1.4, 0.02))
    margins = margins_of(movement.person, poses, side=-1)
    assert margins.floor_m > -ROUNDTRIP
    assert margins.limits_rad > 0
    feet = movement.person.landmarks(poses)["ankle_left"]
    assert feet[-1, 0] - feet[0, 0] == pytest.approx(0.5, abs=0.02)


def test_gap_between_capsules_is_that_of_their_nearest_points():
    def capsule(a, b, radius):
        return BodyVolume(np.array(a, float)[None, None], np.array(b, float)[None, None], np.array([radius]))

    crossed = gap_m(capsule([-1, 0, 0], [1, 0, 0], 0.1), capsule([0, -1, 1], [0, 1, 1], 0.2))
    beside = gap_m(capsule([0, 0, 0], [1, 0, 0], 0.1), capsule([3, 0, 4], [3, 5, 4], 0.2))
    parallel = gap_m(capsule([0, 0, 0], [1, 0, 0], 0.1), capsule([0.2, 0.5, 0], [0.8, 0.5, 0], 0.1))
    np.testing.assert_allclose([crossed, beside, parallel], [0.7, np.sqrt(20) - 0.3, 0.3], atol=EXACT)
