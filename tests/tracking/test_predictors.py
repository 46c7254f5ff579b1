"""Predictions are exact for the motions they assume, over any time steps."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose
from airborne.tracking.predictors import ballistic, constant, linear, quadratic
from tests.support.tolerances import ROUNDTRIP

EVEN = [Fraction(k, 50) for k in range(4)]
UNEVEN = [Fraction(0), Fraction(1, 50), Fraction(1, 20), Fraction(7, 50)]
AXIS = np.array([1.0, -2.0, 0.5]) / np.linalg.norm([1.0, -2.0, 0.5])
VELOCITY = np.array([1.0, -0.5, 3.0])
TIMES = pytest.mark.parametrize("times", [EVEN, UNEVEN], ids=["even", "uneven"])


def pose(time_s, *, acceleration=(0, 0, 0), rate=7.0, rate_change=0.0):
    """Motion at constant acceleration, turning about a fixed axis at a rate that changes evenly."""
    t = float(time_s)
    position = np.array([0.3, 0.2, 1.0]) + VELOCITY * t + 0.5 * np.array(acceleration) * t**2
    turn = Rotation.from_rotvec(AXIS * (rate * t + 0.5 * rate_change * t**2)) * Rotation.from_euler("xyz", [0.1, 1, 2])
    return Pose(world_from_root=RigidTransform.from_components(position, turn))


def predict_last(predict, times, n=3, **motion):
    """The prediction for the last time from the n before it, and the truth."""
    past = [(time, pose(time, **motion)) for time in times[-1 - n : -1]]
    return predict(past, times[-1]), pose(times[-1], **motion)


def assert_same(pair, atol=ROUNDTRIP):
    a, b = (p.world_from_root.as_matrix() for p in pair)
    np.testing.assert_allclose(a, b, atol=atol)


@TIMES
@pytest.mark.parametrize("predict", [linear, quadratic])
def test_constant_velocity_and_turning_rate_are_extrapolated(predict, times):
    assert_same(predict_last(predict, times))


@TIMES
def test_changing_turning_rate_is_extrapolated_from_three_poses(times):
    assert_same(predict_last(quadratic, times, rate_change=30.0))
    with pytest.raises(AssertionError):
        assert_same(predict_last(linear, times, rate_change=30.0))


@TIMES
@pytest.mark.parametrize("n", [2, 3])
def test_free_flight_is_extrapolated_by_ballistic_alone(times, n):
    assert_same(predict_last(ballistic, times, n, acceleration=(0, 0, -9.81)))
    with pytest.raises(AssertionError):
        assert_same(predict_last(quadratic, times, n, acceleration=(0, 0, -9.81)))


@pytest.mark.parametrize("predict", [constant, linear, quadratic, ballistic])
def test_single_pose_is_predicted_to_stay(predict):
    assert_same((predict([(Fraction(0), pose(0))], Fraction(1)), pose(0)))


def test_turn_of_nearly_half_a_circle_a_step_goes_the_short_way_on():
    assert_same(predict_last(linear, EVEN, rate=3.0 * 50), atol=1e-6)


def test_prediction_for_the_last_time_is_the_last_pose():
    past = [(time, pose(time)) for time in UNEVEN]
    for predict in (constant, linear, quadratic, ballistic):
        assert_same((predict(past, UNEVEN[-1]), pose(UNEVEN[-1])))


def test_joints_turn_on_at_their_last_rate_or_stay():
    """About one axis the angle of a joint is its turn."""

    def bent(t):
        return Pose(world_from_root=pose(t).world_from_root, joint_angles=np.array([[0.4 * float(t), 0, 0]] * 2))

    past = [(time, bent(time)) for time in EVEN[:3]]
    for predict in (linear, quadratic, ballistic):
        np.testing.assert_allclose(predict(past, EVEN[3]).joint_angles, bent(EVEN[3]).joint_angles, atol=ROUNDTRIP)
    np.testing.assert_array_equal(constant(past, EVEN[3]).joint_angles, past[-1][1].joint_angles)
