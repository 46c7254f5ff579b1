"""A jumper's chain: constant lengths, mirror symmetry, and rotations about the right axes."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airborne.tracking.capsules.jumper import (
    CAPSULES,
    FOOT,
    HIP_OUT,
    JOINTS,
    LIMITS_RAD,
    N_DOF,
    PELVIS,
    R_HIP,
    R_KNEE,
    R_WAIST,
    SHANK,
    SHORTS_END,
    SOCK_END,
    SOLE,
    SURFACE_CLASSES,
    THIGH,
    TRUNK,
    WAIST,
    border_shares,
    pose_capsules,
)
from tests.support.tolerances import EXACT

LENGTHS = np.array([0.10, 0.5, 0.35, 0.42, 0.12, 0.45, 0.43, 0.14, 0.07])
RADII = np.array([0.10, 0.095, 0.09, 0.06, 0.042, 0.045, 0.08, 0.05])
LEFT_TO_RIGHT = np.array([1, 0, 3, 2, 5, 4, 7, 6, 8])
MIRRORED_CAPSULES = np.array([1, 0, 3, 2, 7, 8, 9, 4, 5, 6])


def pose_jumper(pose, lengths=LENGTHS, radii=RADII):
    points, ends, end_radii = np.full((9, 3), np.nan), np.full((10, 2, 3), np.nan), np.full((10, 2), np.nan)
    pose_capsules(np.asarray(pose, float), lengths, radii, points, ends, end_radii)
    return points, ends, end_radii


def random_poses(n=20, seed=0):
    rng = np.random.default_rng(seed)
    low, high = np.clip(LIMITS_RAD, -np.pi, np.pi).T
    return rng.uniform(low, high, (n, N_DOF))


def gap(points, a, b):
    return np.linalg.norm(points[a] - points[b])


@pytest.mark.parametrize("pose", random_poses())
def test_rods_keep_their_lengths(pose):
    points, ends, end_radii = pose_jumper(pose)
    assert np.isfinite(points).all() and np.isfinite(ends).all() and np.isfinite(end_radii).all()
    assert gap(points, 0, 1) == pytest.approx(2 * LENGTHS[PELVIS], abs=EXACT)
    np.testing.assert_allclose((points[0] + points[1]) / 2, pose[:3], atol=EXACT)
    for side in (0, 1):
        assert gap(points, side, 2 + side) == pytest.approx(LENGTHS[THIGH], abs=EXACT)
        assert gap(points, 2 + side, 4 + side) == pytest.approx(LENGTHS[SHANK], abs=EXACT)
        assert gap(points, 4 + side, 6 + side) == pytest.approx(np.hypot(LENGTHS[FOOT], LENGTHS[SOLE]), abs=EXACT)
        np.testing.assert_allclose(ends[4 + 3 * side], points[[side, 2 + side]], atol=EXACT)
        np.testing.assert_allclose(ends[5 + 3 * side], points[[2 + side, 4 + side]], atol=EXACT)


@pytest.mark.parametrize("pose", random_poses(8, seed=1))
def test_a_mirrored_pose_is_the_mirrored_body(pose):
    mirror = np.ones(N_DOF)
    mirror[[0, 3, 4, 7, 9, 10, 14, 15]] = -1
    swapped = np.concatenate([pose[:8], pose[13:18], pose[8:13]]) * mirror
    points, ends, end_radii = pose_jumper(pose)
    other_points, other_ends, other_radii = pose_jumper(swapped)
    np.testing.assert_allclose(other_points[LEFT_TO_RIGHT], points * [-1, 1, 1], atol=EXACT)
    np.testing.assert_allclose(other_ends[MIRRORED_CAPSULES], ends * [-1, 1, 1], atol=EXACT)
    np.testing.assert_allclose(other_radii[MIRRORED_CAPSULES], end_radii, atol=EXACT)


@pytest.mark.parametrize("pose", random_poses(8, seed=2))
def test_position_and_heading_carry_the_whole_body(pose):
    points, ends, _ = pose_jumper(np.concatenate([np.zeros(4), pose[4:]]))
    rotation = Rotation.from_euler("z", pose[3])
    moved_points, moved_ends, _ = pose_jumper(pose)
    np.testing.assert_allclose(moved_points, rotation.apply(points) + pose[:3], atol=EXACT)
    np.testing.assert_allclose(
        moved_ends, rotation.apply(ends.reshape(-1, 3)).reshape(ends.shape) + pose[:3], atol=EXACT
    )


def test_a_neutral_jumper_stands_straight_and_faces_away_from_y():
    points, _, _ = pose_jumper(np.zeros(N_DOF))
    leg = LENGTHS[THIGH] + LENGTHS[SHANK]
    by_name = dict(zip(JOINTS, points, strict=True))
    np.testing.assert_allclose(by_name["hip_left"], [LENGTHS[PELVIS], 0, 0], atol=EXACT)
    np.testing.assert_allclose(by_name["ankle_right"], [-LENGTHS[PELVIS], 0, -leg], atol=EXACT)
    np.testing.assert_allclose(
        by_name["foot_left"], [LENGTHS[PELVIS], -LENGTHS[FOOT], -leg - LENGTHS[SOLE]], atol=EXACT
    )
    np.testing.assert_allclose(by_name["torso"], [0, 0, (LENGTHS[WAIST] + LENGTHS[TRUNK]) / 2], atol=EXACT)


def test_orientation_is_heading_then_side_then_forward_lean():
    pose = np.zeros(N_DOF)
    pose[3:6] = 0.7, 0.3, -0.4
    points, ends, _ = pose_jumper(pose)
    rotation = Rotation.from_euler("ZYX", pose[3:6])
    straight, straight_ends, _ = pose_jumper(np.zeros(N_DOF))
    np.testing.assert_allclose(points, rotation.apply(straight), atol=EXACT)
    np.testing.assert_allclose(ends.reshape(-1, 3), rotation.apply(straight_ends.reshape(-1, 3)), atol=EXACT)


@pytest.mark.parametrize(
    ("number", "joint", "axis", "sign"), [(8, 2, 1, -1), (11, 4, 1, 1), (12, 6, 2, -1), (6, 8, 1, -1)]
)
def test_flexion_rotates_the_way_people_bend(number, joint, axis, sign):
    """A hip with a negative angle brings the knee forward (-y); a positive knee angle the ankle back; and so on."""
    straight, bent = np.zeros(N_DOF), np.zeros(N_DOF)
    bent[number] = 0.3 if number != 8 else -0.3
    moved = pose_jumper(bent)[0] - pose_jumper(straight)[0]
    assert sign * moved[joint, axis] > 0.02


@pytest.mark.parametrize("number", range(8, 18))
def test_each_leg_moves_alone(number):
    pose = np.zeros(N_DOF)
    pose[number] = 0.2
    moved = np.linalg.norm(pose_jumper(pose)[0] - pose_jumper(np.zeros(N_DOF))[0], axis=1) > 1e-9
    side = (number - 8) // 5
    assert not moved[[0, 1, 8]].any()
    assert not moved[[2, 4, 6]].any() if side else not moved[[3, 5, 7]].any()
    assert moved[6 + side]


def test_radii_stand_where_they_belong():
    _, ends, end_radii = pose_jumper(np.zeros(N_DOF))
    np.testing.assert_array_equal(end_radii[[4, 7], 0], RADII[R_HIP])
    np.testing.assert_array_equal(end_radii[[4, 7], 1], RADII[R_KNEE])
    np.testing.assert_array_equal(end_radii[[5, 8], 0], RADII[R_KNEE])
    assert ends[2, 0, 0] == pytest.approx(RADII[HIP_OUT], abs=EXACT)


def test_surface_classes_change_where_shorts_and_socks_end():
    out = np.empty(10)
    border_shares(LENGTHS, RADII, out)
    hips, thighs, shanks = [2, 3], [4, 7], [5, 8]
    np.testing.assert_allclose((1 - out[hips]) * LENGTHS[WAIST], np.pi / 4 * RADII[R_WAIST])
    np.testing.assert_array_equal(out[thighs], LENGTHS[SHORTS_END])
    np.testing.assert_allclose(out[shanks], 1 - LENGTHS[SOCK_END])
    np.testing.assert_array_equal(np.delete(out, hips + thighs + shanks), 1)
    assert [(SURFACE_CLASSES[a], SURFACE_CLASSES[b]) for a, b, _ in CAPSULES[[0, 2]]] == [
        ("shirt", "shirt"),
        ("shorts", "shirt"),
    ]
    assert [(SURFACE_CLASSES[a], SURFACE_CLASSES[b]) for a, b, _ in CAPSULES[4:7]] == [
        ("shorts", "skin"),
        ("skin", "socks"),
        ("shoes", "shoes"),
    ]
    np.testing.assert_array_equal(CAPSULES[4:7, :2], CAPSULES[7:10, :2])
    assert list(CAPSULES[:, 2]) == [0] * 4 + [1] * 3 + [2] * 3


def test_limits_of_the_right_leg_mirror_those_of_the_left():
    left, right = LIMITS_RAD[8:13], LIMITS_RAD[13:18]
    assert np.all(LIMITS_RAD[:, 0] < LIMITS_RAD[:, 1])
    np.testing.assert_array_equal(right[[0, 3, 4]], left[[0, 3, 4]])
    np.testing.assert_array_equal(right[[1, 2]], -left[[1, 2], ::-1])
