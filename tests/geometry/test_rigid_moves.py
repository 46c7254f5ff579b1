"""Moves of single rigid maps, against SciPy."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.geometry.joint_rotations import motion_between, move_matrix
from tests.support.tolerances import EXACT, ROUNDTRIP


@pytest.mark.parametrize("angle_rad", [0.0, 1e-9, 0.3, 3.1])
def test_a_moved_map_is_scipys(angle_rad):
    rng = np.random.default_rng(0)
    before = RigidTransform.from_components(rng.normal(size=3), Rotation.random(rng=rng))
    translation, axis = rng.normal(size=3), rng.normal(size=3)
    vector = angle_rad * axis / np.linalg.norm(axis)
    moved = move_matrix(before.as_matrix(), translation, vector)
    rotated = Rotation.from_rotvec(vector) * before.rotation
    expected = RigidTransform.from_components(before.translation + translation, rotated)
    np.testing.assert_allclose(moved, expected.as_matrix(), atol=10 * EXACT)
    found = motion_between(before.as_matrix(), moved)
    np.testing.assert_allclose(found, [*translation, *vector], atol=ROUNDTRIP)


def test_many_moves_leave_a_rotation():
    matrix, vector = np.eye(4), np.array([0.3, -0.2, 0.5])
    for _ in range(10_000):
        matrix = move_matrix(matrix, np.zeros(3), vector)
    np.testing.assert_allclose(matrix[:3, :3] @ matrix[:3, :3].T, np.eye(3), atol=EXACT)
