"""Two passes over the same frames: joined by their covariances; where they disagree, one of them, said to be so."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from airborne.body.chain import delta_between, move_pose
from airborne.tracking.estimate import Doubt, Estimate, Status, lost_estimate
from airborne.tracking.passes import Passes, differences, join_passes, parts_of
from tests.support.people import HUMAN, swinging

TRUTH = swinging(0)
N = HUMAN.n_dofs


def estimate(pose, sd=0.01, index=0, status=Status.TRACKED) -> Estimate:
    covariance = np.eye(N) * sd**2
    return Estimate(
        index=index, time_s=Fraction(index, 50), status=status, score=1.0, pose=pose, covariance=covariance, n_views=3
    )


def join(forward, backward, nats=None):
    """Join two lists of estimates; the images prefer the backward pose by so many nats a frame."""
    passes = []
    for k, (ahead, back) in enumerate(zip(forward, backward, strict=True)):
        pair = differences(HUMAN, ahead, back)
        weights = None if not pair.candidates else np.array([0.0, *[-nats[k]] * (len(pair.candidates) - 1)])
        passes.append(Passes(ahead, back, pair, weights))
    return join_passes(HUMAN, passes)


def with_arm(angle: float):
    """The pose with its left arm lifted by an angle [rad]."""
    angles = TRUTH.joint_angles.copy()
    angles[HUMAN.index_of("upper_arm_left") - 1, 0] += angle
    return replace(TRUTH, joint_angles=angles)


def test_parts_hold_every_degree_of_freedom_once():
    assert np.array_equal(np.sort(np.concatenate(parts_of(HUMAN))), np.arange(N))


def test_equal_passes_stay_as_they_are_and_are_no_surer_for_it():
    joined = join([estimate(TRUTH)], [estimate(TRUTH)])[0]
    np.testing.assert_allclose(delta_between(TRUTH, joined.pose), 0, atol=1e-9)
    np.testing.assert_allclose(joined.covariance, np.eye(N) * 1e-4, rtol=1e-6)
    assert joined.status is Status.TRACKED


def test_passes_that_agree_are_averaged_by_their_information():
    delta = np.zeros(N)
    delta[:3] = 0.003
    joined = join([estimate(TRUTH, 0.01)], [estimate(move_pose(TRUTH, delta), 0.005)])[0]
    np.testing.assert_allclose(delta_between(TRUTH, joined.pose)[:3], 0.003 * 0.8, rtol=1e-4)


def test_what_one_pass_does_not_see_is_the_others():
    own = slice(3 + 3 * HUMAN.index_of("forearm_left"), 6 + 3 * HUMAN.index_of("forearm_left"))
    blind = estimate(TRUTH)
    blind.covariance[own, own] = np.diag([np.inf] * 3)
    turned = move_pose(TRUTH, np.where(np.arange(N) == own.start, 0.05, 0.0))
    joined = join([blind], [estimate(turned)])[0]
    np.testing.assert_allclose(delta_between(TRUTH, joined.pose)[own.start], 0.05, atol=1e-3)
    assert np.all(np.isfinite(joined.covariance[own, own]))


@pytest.mark.parametrize(("gain", "taken"), [(50.0, 1.0), (-2.0, 0.0)])
@pytest.mark.parametrize("angle", [1.0, 0.07])
def test_a_limb_in_two_places_is_in_the_likelier_one_and_as_uncertain_as_they_are_apart(gain, taken, angle):
    joined = join([estimate(TRUTH, 0.001)], [estimate(with_arm(angle), 0.001)], [gain])[0]
    arm = HUMAN.index_of("upper_arm_left") - 1
    assert (joined.pose.joint_angles - TRUTH.joint_angles)[arm, 0] == pytest.approx(taken * angle)
    assert joined.status is Status.TRACKED  # of the frame: joints have a status of their own
    assert np.sqrt(np.trace(joined.covariance[6 + 3 * arm :, 6 + 3 * arm :][:3, :3])) > 0.9 * angle


def test_segments_that_are_far_apart_are_uncertain_by_name():
    angles = TRUTH.joint_angles.copy()
    angles[HUMAN.index_of("forearm_left") - 1, 0] += 0.5
    joined = join([estimate(TRUTH)], [estimate(replace(TRUTH, joint_angles=angles))], [5.0])[0]
    assert [HUMAN.segments[1 + joint].name for joint in joined.uncertain_joints] == ["hand_left"]  # the elbow stays
    assert joined.status is Status.TRACKED
    assert join([estimate(TRUTH)], [estimate(TRUTH)])[0].uncertain_joints == ()


@pytest.mark.parametrize(("moved_m", "doubts"), [(0.04, ()), (0.06, (Doubt.DIRECTIONS,))])
def test_a_frame_is_uncertain_where_its_trunk_is_in_two_places(moved_m, doubts):
    elsewhere = TRUTH.move(np.array([moved_m, 0, 0]), np.zeros(3))
    (joined,) = join([estimate(TRUTH, 0.001)], [estimate(elsewhere, 0.001)], [1.0])
    assert (joined.status, joined.doubts) == (Status.UNCERTAIN if doubts else Status.TRACKED, doubts)


def test_the_forward_pass_is_right_up_to_one_frame_and_the_backward_pass_from_there():
    """Single frames may say otherwise: the whole stretch decides where."""
    gains = [-30, -20, 5, -10, 20, -5, 30]
    n = len(gains)
    joined = join(
        [estimate(TRUTH, index=k) for k in range(n)], [estimate(with_arm(1.0), index=k) for k in range(n)], gains
    )
    lifted = [each.pose.joint_angles[HUMAN.index_of("upper_arm_left") - 1, 0] for each in joined]
    moved = np.array(lifted) - TRUTH.joint_angles[HUMAN.index_of("upper_arm_left") - 1, 0]
    np.testing.assert_allclose(moved, [0, 0, 0, 0, 1, 1, 1], atol=1e-9)


def test_a_frame_that_one_pass_lost_is_the_others():
    assert join([lost_estimate(0, Fraction(0))], [estimate(TRUTH)])[0].pose is TRUTH
    assert join([estimate(TRUTH)], [lost_estimate(0, Fraction(0))])[0].status is Status.TRACKED


def test_the_other_passs_trunk_brings_its_limbs_along():
    elsewhere = TRUTH.move(np.array([0.5, 0, 0]), np.zeros(3))
    joined = join([estimate(TRUTH)], [estimate(elsewhere)], [40.0])[0]
    np.testing.assert_allclose(delta_between(elsewhere, joined.pose), 0, atol=1e-9)
