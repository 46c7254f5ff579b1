"""Swing and twist: coordinates of a rotation, regular but where z is turned right round."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airborne.geometry.swing_twist import rotation_of, swing_twist_from_matrix, swing_twist_jacobian
from tests.support.tolerances import EXACT, ROUNDTRIP, SOLVED


@pytest.mark.parametrize("shape", [(), (1,), (3, 1, 2)])
def test_coordinates_give_the_rotation_back(shape):
    n = int(np.prod(shape))
    R = Rotation.random(n, rng=1).as_matrix().reshape(*shape, 3, 3)
    np.testing.assert_allclose(rotation_of(swing_twist_from_matrix(R)), R, atol=ROUNDTRIP)


def test_rotation_is_a_swing_about_an_axis_across_z_after_a_twist_about_z():
    R = Rotation.random(50, rng=2)
    x, y, twist = swing_twist_from_matrix(R.as_matrix()).T
    swing = Rotation.from_rotvec(np.column_stack([x, y, 0 * x]))
    composed = swing * Rotation.from_rotvec(np.column_stack([0 * x, 0 * x, twist]))
    np.testing.assert_allclose(composed.as_matrix(), R.as_matrix(), atol=ROUNDTRIP)


def test_no_rotation_has_no_swing_and_no_twist():
    np.testing.assert_array_equal(swing_twist_from_matrix(np.eye(3)), 0)
    np.testing.assert_allclose(swing_twist_jacobian(np.eye(3)), np.eye(3), atol=EXACT)


def test_jacobian_is_the_finite_difference():
    R = np.concatenate([Rotation.random(40, rng=3).as_matrix(), Rotation.from_euler("z", [[0.0], [2.0]]).as_matrix()])
    h = 1e-6
    turned = [
        [swing_twist_from_matrix(R @ Rotation.from_rotvec(sign * h * axis).as_matrix()) for sign in (1, -1)]
        for axis in np.eye(3)
    ]
    numeric = np.stack([(up - down) / (2 * h) for up, down in turned], axis=-1)
    np.testing.assert_allclose(swing_twist_jacobian(R), numeric, atol=SOLVED)
