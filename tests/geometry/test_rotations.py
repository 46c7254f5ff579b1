"""Laws of somersault, tilt and twist."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from airborne.geometry.rotations import (
    angles_from_matrix,
    angles_from_world_rotation,
    geodesic,
    is_near_singular,
    matrix_from_angles,
    shortest_rotations,
    super_fibonacci,
    unwrap,
    wrap,
)
from tests.support.tolerances import EXACT, ROUNDTRIP, SOLVED

ANGLE = st.floats(-np.pi, np.pi)
TILT = st.floats(-np.pi / 2, np.pi / 2)
SHAPES = [(), (1,), (3, 1, 2)]


def random_angles(shape, seed=0):
    return np.random.default_rng(seed).uniform([-3, -1.4, -3], [3, 1.4, 3], size=(*shape, 3))


@pytest.mark.parametrize("shape", SHAPES)
def test_angles_come_back_from_their_matrix(shape):
    angles = random_angles(shape)
    np.testing.assert_allclose(angles_from_matrix(matrix_from_angles(angles)), angles, atol=ROUNDTRIP)


@given(som=ANGLE, tilt=TILT, twist=ANGLE)
@settings(max_examples=200, deadline=None, derandomize=True)
def test_matrix_comes_back_from_its_angles_even_at_the_singularity(som, tilt, twist):
    R = matrix_from_angles(np.array([som, tilt, twist]))
    np.testing.assert_allclose(matrix_from_angles(angles_from_matrix(R)), R, atol=EXACT)


@pytest.mark.parametrize("tilt", [np.pi / 2, -np.pi / 2])
def test_matrix_comes_back_at_exactly_ninety_degrees_of_tilt(tilt):
    R = matrix_from_angles(np.array([0.4, tilt, 1.1]))
    angles = angles_from_matrix(R)
    np.testing.assert_allclose(matrix_from_angles(angles), R, atol=EXACT)
    assert is_near_singular(angles)


def test_matrix_is_scipys_body_fixed_xyz_rotation():
    angles = random_angles((50,))
    expected = Rotation.from_euler("XYZ", angles).as_matrix()
    np.testing.assert_allclose(matrix_from_angles(angles), expected, atol=EXACT)


def test_positive_somersault_takes_the_head_forward():
    head = matrix_from_angles(np.array([np.pi / 2, 0, 0])) @ [0, 0, 1]
    np.testing.assert_allclose(head, [0, -1, 0], atol=EXACT)  # y is posterior


def test_angles_of_an_unknown_rotation_are_unknown():
    R = matrix_from_angles(random_angles((3,)))
    R[1] = np.nan
    angles = angles_from_matrix(R)
    assert np.isnan(angles[1]).all()
    assert np.isfinite(angles[[0, 2]]).all()


def test_singular_only_within_five_degrees_of_ninety_degrees_of_tilt():
    tilt = np.deg2rad([-90, -86, -84, 0, 84, 86, 90])
    angles = np.stack([tilt * 0, tilt, tilt * 0], axis=-1)
    assert is_near_singular(angles).tolist() == [True, True, False, False, False, True, True]


@given(rate=st.floats(-2.5, 2.5), n=st.integers(2, 60))
@settings(max_examples=50, deadline=None, derandomize=True)
def test_unwrapped_steady_rotation_is_a_straight_line(rate, n):
    time_s = np.arange(n) * 1.0
    truth = np.stack([rate * time_s, 0.3 * np.sin(time_s), -rate * time_s], axis=-1)
    seen = angles_from_matrix(matrix_from_angles(truth))
    np.testing.assert_allclose(unwrap(seen, time_s), truth, atol=ROUNDTRIP)


def test_unwrapped_somersault_keeps_its_turns_over_a_long_gap():
    time_s = np.arange(60) / 50
    truth = np.stack([4 * np.pi * time_s, 0 * time_s, -6 * np.pi * time_s], axis=-1)
    seen = angles_from_matrix(matrix_from_angles(truth))
    seen[20:45] = np.nan  # half a second: one whole somersault unseen
    result = unwrap(seen, time_s)
    np.testing.assert_allclose(result[:20], truth[:20], atol=ROUNDTRIP)
    np.testing.assert_allclose(result[45:], truth[45:], atol=ROUNDTRIP)
    assert np.isnan(result[20:45]).all()


def test_unwrapping_changes_no_rotation_and_never_the_tilt():
    angles = random_angles((40,), seed=3)
    angles[[5, 6, 20]] = np.nan
    result = unwrap(angles, np.arange(40) / 50)
    np.testing.assert_array_equal(result[:, 1], angles[:, 1])
    np.testing.assert_allclose(matrix_from_angles(result), matrix_from_angles(angles), atol=ROUNDTRIP)


@pytest.mark.parametrize("rows", [0, 1])
def test_unwrapping_one_row_or_none_leaves_it(rows):
    angles = random_angles((rows,))
    np.testing.assert_array_equal(unwrap(angles, np.zeros(rows)), angles)


def test_unwrapping_only_unknown_rows_leaves_them():
    assert np.isnan(unwrap(np.full((3, 3), np.nan), np.arange(3.0))).all()


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.3, 3.1, np.pi - 1e-9, np.pi])
def test_geodesic_is_the_angle_turned(angle):
    rng = np.random.default_rng(1)
    axis = rng.normal(size=3)
    A = Rotation.random(rng=rng).as_matrix()
    B = A @ Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).as_matrix()
    assert geodesic(A, B) == pytest.approx(angle, abs=EXACT)
    assert geodesic(B, A) == pytest.approx(angle, abs=EXACT)


@pytest.mark.parametrize("shape", SHAPES)
def test_geodesic_keeps_the_batch_and_unknowns(shape):
    A, B = matrix_from_angles(random_angles(shape)), matrix_from_angles(random_angles(shape, seed=1))
    assert geodesic(A, B).shape == shape
    assert np.isnan(geodesic(A, np.full_like(B, np.nan))).all()


def test_derivative_of_the_angles_is_the_finite_difference():
    angles, step = random_angles((20,), seed=2), 1e-6
    R = matrix_from_angles(angles)
    columns = []
    for axis in np.eye(3):
        turned = [Rotation.from_rotvec(s * step * axis).as_matrix() @ R for s in (1, -1)]
        columns.append(wrap(angles_from_matrix(turned[0]) - angles_from_matrix(turned[1])) / (2 * step))
    np.testing.assert_allclose(angles_from_world_rotation(angles), np.stack(columns, axis=-1), atol=SOLVED)


def test_derivative_of_the_angles_is_unknown_near_the_singularity():
    derivative = angles_from_world_rotation(np.array([[0.1, np.deg2rad(88), 0.2], [0.1, 0.2, 0.3]]))
    assert np.isnan(derivative[0, [0, 2]]).any()
    assert np.isfinite(derivative[1]).all()


@given(angle=st.floats(-100, 100))
@settings(max_examples=100, deadline=None, derandomize=True)
def test_wrapping_takes_away_whole_turns(angle):
    result = float(wrap(np.array(angle)))
    assert -np.pi <= result < np.pi
    turns = (angle - result) / (2 * np.pi)
    assert turns == pytest.approx(round(turns), abs=ROUNDTRIP)


def test_a_spiral_of_3000_orientations_leaves_none_far_from_all():
    spiral = super_fibonacci(3000)
    assert np.abs(spiral @ np.swapaxes(spiral, 1, 2) - np.eye(3)).max() < EXACT
    nearest = [geodesic(spiral, R).min() for R in Rotation.random(200, random_state=1).as_matrix()]
    assert np.mean(nearest) < np.radians(9)
    assert np.max(nearest) < np.radians(16)


def test_shortest_rotations_turn_one_direction_to_another_about_what_is_square_to_both():
    rng = np.random.default_rng(4)
    before, after = rng.normal(size=(2, 50, 3))
    after[0], after[1] = 3 * before[0], 0
    after[2] = -before[2]
    R = shortest_rotations(before, after)
    turned, units = np.einsum("nij,nj->ni", R, before), after / np.maximum(np.linalg.norm(after, axis=1), 1e-9)[:, None]
    expected = units * np.linalg.norm(before, axis=1)[:, None]
    np.testing.assert_allclose(turned[3:], expected[3:], atol=ROUNDTRIP)
    np.testing.assert_allclose(R[[0, 1, 2]], np.tile(np.eye(3), (3, 1, 1)), atol=ROUNDTRIP)
    np.testing.assert_allclose(R @ R.swapaxes(1, 2), np.tile(np.eye(3), (50, 1, 1)), atol=ROUNDTRIP)
    oracle = np.array([Rotation.align_vectors(a, b)[0].as_matrix() for a, b in zip(after[3:], before[3:], strict=True)])
    np.testing.assert_allclose(R[3:], oracle, atol=1e-9)
