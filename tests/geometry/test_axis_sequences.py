"""Angles about a sequence of axes: they give the rotation back, as SciPy's do, and are continuous over time."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airborne.geometry.axis_sequences import angles_from_rotation, continue_angles, is_singular, sequence_angles
from tests.support.tolerances import ROUNDTRIP, SOLVED

AXES = {name: np.stack([np.eye(3)["XYZ".index(axis)] for axis in name]) for name in ("ZXY", "YXZ", "XYZ", "YXY")}
SEQUENCES = pytest.mark.parametrize("name", AXES)


def turn(angles, axes):
    """Rotate about the axes, one after the other, each in the frame turned so far: (..., 3, 3)."""
    matrices = [Rotation.from_rotvec(angles[..., k, None] * axes[k]).as_matrix() for k in range(3)]
    return matrices[0] @ matrices[1] @ matrices[2]


@SEQUENCES
@pytest.mark.parametrize("sign", [[1, 1, 1], [1, -1, -1]])
def test_angles_give_the_rotation_back_singular_ones_too(name, sign):
    axes, straight = AXES[name] * sign, [np.eye(3), Rotation.from_euler("Y", 90, degrees=True).as_matrix()]
    R = np.concatenate(
        [Rotation.random(200, rng=3).as_matrix(), straight, turn(np.array([[0.3, np.pi / 2, 0.4]]), axes)]
    )
    np.testing.assert_allclose(turn(sequence_angles(R, axes), axes), R, atol=ROUNDTRIP)


@SEQUENCES
def test_angles_are_those_of_scipy(name):
    R = Rotation.random(200, rng=4)
    expected = R.as_euler(name)
    if name == "YXY":  # its middle angle is positive, the ISB's elevation negative
        expected = np.angle(np.exp(1j * (expected * [1, -1, 1] + [np.pi, 0, np.pi])))
    np.testing.assert_allclose(sequence_angles(R.as_matrix(), AXES[name]), expected, atol=ROUNDTRIP)


@SEQUENCES
def test_angles_continue_through_the_singular_middle_and_over_revolutions(name):
    t = np.linspace(0, 1, 101)
    middle = np.linspace(-2.5, -0.7, 101) if name != "YXY" else np.linspace(-0.9, 0.8, 101)
    true = np.stack([7 * t, middle, 0.5 - 8 * t], axis=-1)
    found = sequence_angles(turn(true, AXES[name]), AXES[name])
    found[40:43] = np.nan
    found[0], found[40:43] = true[0], np.nan  # the first row's branch is kept
    known = np.isfinite(found[:, 0])
    result = continue_angles(found, AXES[name])
    np.testing.assert_allclose(result[known], true[known], atol=1e3 * ROUNDTRIP)
    assert np.isnan(result[~known]).all()


@SEQUENCES
def test_derivatives_are_those_of_small_rotations_but_where_singular(name):
    axes = AXES[name]
    angles = sequence_angles(Rotation.random(30, rng=5).as_matrix(), axes)
    jacobian, step = angles_from_rotation(angles, axes), 1e-6
    for k in range(3):
        moved = turn(angles, axes) @ Rotation.from_rotvec(step * np.eye(3)[k]).as_matrix()
        difference = np.angle(np.exp(1j * (sequence_angles(moved, axes) - angles))) / step
        usable = ~is_singular(angles, axes)
        np.testing.assert_allclose(jacobian[usable, :, k], difference[usable], rtol=SOLVED, atol=SOLVED)
    locked = np.array([[0.3, 0.0 if name == "YXY" else np.pi / 2, 0.1]])
    assert is_singular(locked, axes)[0]
    assert np.isnan(angles_from_rotation(locked, axes)).all()
