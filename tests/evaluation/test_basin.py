"""Trials about a known pose."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose
from airborne.evaluation import Basin, is_recovered, perturb
from airborne.geometry.rotations import geodesic
from tests.support.evaluation import HALF_TURN, IDENTITY
from tests.support.tolerances import ROUNDTRIP, sampled

START = Pose(
    world_from_root=RigidTransform.from_components([0.1, 0.2, 1.3], Rotation.from_euler("XYZ", [0.3, 0.4, 0.5]))
)


def trials(n=200, distance_m=0.05, angle_rad=0.2):
    return perturb(np.random.default_rng(1), START, distance_m=distance_m, angle_rad=angle_rad, n=n)


def test_trials_lie_exactly_the_distance_and_the_angle_away():
    for pose in trials():
        offset = pose.world_from_root.translation - START.world_from_root.translation
        angle = geodesic(pose.world_from_root.rotation.as_matrix(), START.world_from_root.rotation.as_matrix())
        assert np.linalg.norm(offset) == pytest.approx(0.05, abs=ROUNDTRIP)
        assert angle == pytest.approx(0.2, abs=ROUNDTRIP)


def test_directions_and_axes_favour_no_side():
    n = 2000
    back = START.world_from_root.rotation.inv()
    offsets = [pose.world_from_root.translation - START.world_from_root.translation for pose in trials(n)]
    axes = [(pose.world_from_root.rotation * back).as_rotvec() / 0.2 for pose in trials(n)]
    np.testing.assert_allclose(np.mean(offsets, axis=0) / 0.05, 0, atol=sampled(n))
    np.testing.assert_allclose(np.mean(axes, axis=0), 0, atol=sampled(n))


def test_same_generator_gives_the_same_trials():
    for a, b in zip(trials(5), trials(5), strict=True):
        np.testing.assert_array_equal(a.world_from_root.as_matrix(), b.world_from_root.as_matrix())


@pytest.mark.parametrize(
    ("distance_m", "angle_deg", "expected"), [(0.009, 1.9, True), (0.011, 1.9, False), (0.009, 2.1, False)]
)
def test_pose_is_found_again_within_ten_millimetres_and_two_degrees(distance_m, angle_deg, expected):
    for pose in trials(10, distance_m, np.deg2rad(angle_deg)):
        assert is_recovered(pose, START, IDENTITY) is expected


def test_pose_that_looks_the_same_is_found_again_and_a_lost_one_is_not():
    root = START.world_from_root
    flipped = Pose(
        world_from_root=RigidTransform.from_components(
            root.translation, root.rotation * Rotation.from_matrix(HALF_TURN[1])
        )
    )
    assert is_recovered(flipped, START, HALF_TURN)
    assert not is_recovered(flipped, START, IDENTITY)
    assert not is_recovered(None, START, HALF_TURN)


def test_wilson_interval_has_its_published_values():
    np.testing.assert_allclose(Basin(10, 8).interval, [0.4902, 0.9433], atol=5e-5)  # a textbook case
    np.testing.assert_allclose(Basin(10, 0).interval, [0, 0.2775], atol=5e-5)
    assert Basin(0, 0).interval == (0.0, 1.0)


def test_wilson_interval_holds_the_true_rate_as_often_as_it_says():
    n_runs, rate = 2000, 0.9
    result = np.random.default_rng(3).binomial(50, rate, size=n_runs)
    intervals = [Basin(50, int(k)).interval for k in result]
    share = np.mean([low <= rate <= high for low, high in intervals])
    assert share == pytest.approx(0.95, abs=0.03)


def test_description_gives_the_rate_and_its_interval():
    assert Basin(10, 8).describe() == "8 of 10 found again within 10 mm and 2 degrees (95 %: 49% to 94%)"
