"""Limits of joints: what lies within is left alone, what lies beyond comes back to the nearest swing and twist."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airborne.body import human18
from airborne.body.limits import FREE, JointLimits
from airborne.geometry.rotations import matrix_from_angles
from tests.support.tolerances import ROUNDTRIP

BODY = human18().limits
TURNS = Rotation.random(17 * 20, rng=0).as_matrix().reshape(20, 17, 3, 3)


def test_clamped_rotations_are_within_and_stay():
    held = BODY.clamp(TURNS)
    assert np.all(BODY.slack(held) > -ROUNDTRIP)
    np.testing.assert_allclose(BODY.clamp(held), held, atol=ROUNDTRIP)
    np.testing.assert_allclose(BODY.excess(held), 0, atol=ROUNDTRIP)


def test_rotations_within_are_kept_bit_for_bit():
    inside = BODY.rotation(0.7 * BODY.half_rad * np.sin(np.arange(51)).reshape(17, 3))
    np.testing.assert_array_equal(BODY.clamp(inside), inside)
    np.testing.assert_allclose(BODY.excess(inside), 0, atol=ROUNDTRIP)


def test_slack_and_excess_agree_about_what_is_beyond():
    beyond = np.any(BODY.excess(TURNS) != 0, axis=-1)
    np.testing.assert_array_equal(beyond, BODY.slack(TURNS) < 0)
    assert 0.2 < beyond.mean() < 1


def test_swing_of_a_ball_ends_on_an_ellipse_and_of_a_hinge_on_a_rectangle():
    half = np.array([1.0, 0.5, 0.3])
    corner = np.array([0.9, 0.45, 0.0])
    ball, hinge = (JointLimits(np.eye(3), half, np.asarray(is_ball)) for is_ball in (True, False))
    np.testing.assert_array_equal(hinge.nearest(corner), corner)
    on_ellipse = ball.nearest(corner)
    assert np.hypot(*(on_ellipse / half)[:2]) == pytest.approx(1)
    assert on_ellipse[0] / on_ellipse[1] == pytest.approx(2)


def test_free_joint_has_no_limits():
    assert not FREE.is_limited
    np.testing.assert_array_equal(FREE.clamp(TURNS), TURNS)
    np.testing.assert_array_equal(FREE.excess(TURNS), 0)


def test_ranges_of_angles_become_limits_with_the_same_middle_and_width():
    knee = JointLimits.from_angles(np.radians([[-5, 140], [-5, 5], [-10, 10]]))
    np.testing.assert_allclose(np.degrees(knee.half_rad), [72.5, 5, 10])
    np.testing.assert_allclose(np.degrees(knee.angle_ranges_rad), [[-5, 140], [-5, 5], [-10, 10]], atol=ROUNDTRIP)
    assert not knee.is_ball
    hip = JointLimits.from_angles(np.radians([[-125, 30], [-45, 25], [-40, 60]]))
    assert hip.is_ball
    for flexion in (-110, 0, 20):
        assert hip.slack(matrix_from_angles(np.radians([flexion, -10, 10]))) > -np.radians(1)


def test_joints_move_about_their_own_axes_to_the_coordinates_of_their_rotations():
    angles, vectors = np.random.default_rng(2).normal(0, 0.8, (2, 17, 3))
    moved = matrix_from_angles(angles) @ Rotation.from_rotvec(vectors).as_matrix()
    after, bound = BODY.move(angles, vectors)
    np.testing.assert_allclose(after, BODY.coordinates(moved), atol=ROUNDTRIP)
    np.testing.assert_allclose(bound, BODY.nearest(after), atol=ROUNDTRIP)
