"""Eliminating the poses gives what one large least squares of poses and parameters gives."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airborne.tracking.self_check.free_flight import fall, find_wrong_flight
from airborne.tracking.self_check.solution import Evidence, pose_errors, solve
from tests.support.tolerances import SOLVED


def random_evidence(theta, *, n=7, c=3, noise=0.0):
    rng = np.random.default_rng(4)
    k = len(theta)
    S, D = rng.normal(0, 300, (n, c, 4, 6)), rng.normal(0, 30, (n, c, 4, k))
    S[..., 2:, :] /= 500  # the turn and the log scale
    D[..., 2:, :] /= 500
    poses = rng.normal(0, 0.01, (n, 6))
    offset = np.einsum("ncai,ni->nca", S, poses) + np.einsum("ncak,k->nca", D, theta)
    offset += noise * rng.normal(size=offset.shape) * [1, 1, 0.01, 0.01]
    edge = np.einsum("ncai,ncaj->ncij", S, S)
    seen = np.ones((n, c), bool)
    return Evidence(offset, S, D, seen, edge, np.einsum("ncai,ncak->ncik", S, D)), poses


def test_parameters_and_poses_are_found():
    theta = np.array([0.05, -0.02])
    evidence, poses = random_evidence(theta)
    solution, weights = solve(evidence, np.eye(2))
    mean, covariance, _ = solution.posterior(np.eye(2))
    np.testing.assert_allclose(mean, theta, atol=5 * SOLVED)
    assert np.all(np.sqrt(np.diag(covariance)) < 0.01)
    np.testing.assert_allclose(pose_errors(evidence, weights).at(mean), poses, atol=5 * SOLVED)


def test_a_parameter_without_freedom_stays_zero():
    evidence, _ = random_evidence(np.array([0.05, -0.02]), noise=0.1)
    solution, _ = solve(evidence, np.eye(2))
    mean, covariance, _ = solution.posterior(np.diag([1.0, 0.0]))
    assert mean[1] == 0 and covariance[1, 1] == 0


def test_independent_noise_is_as_large_between_blocks_as_within():
    evidence, _ = random_evidence(np.array([0.05, -0.02]), n=400, noise=0.5)
    solution, _ = solve(evidence, np.eye(2))
    ratio = np.sqrt(np.diag(solution.jackknife(np.eye(2))) / np.diag(solution.posterior(np.eye(2))[1]))
    assert np.all((ratio > 0.3) & (ratio < 2))  # a standard deviation of four numbers is 40 % off, one sd


def test_what_shows_for_some_moments_alone_is_not_sure():
    evidence, _ = random_evidence(np.zeros(2), n=16, noise=0.1)
    evidence.offset[:4] += evidence.by_parameter[:4, ..., 0] * 0.05  # as if the first parameter were 0.05 then
    solution, _ = solve(evidence, np.eye(2))
    mean, covariance, _ = solution.posterior(np.eye(2))
    sd_by_noise, sd_by_blocks = np.sqrt(covariance[0, 0]), np.sqrt(solution.jackknife(np.eye(2))[0, 0])
    assert mean[0] > 2.5 * sd_by_noise
    assert mean[0] < sd_by_blocks


def test_a_parameter_that_grows_is_found_with_its_growth():
    evidence, _ = random_evidence(np.array([0.05, -0.02]), n=16, noise=0.1)
    growth = np.repeat([-1.0, -1 / 3, 1 / 3, 1.0], 4)
    evidence.offset[:] += 0.03 * growth[:, None, None] * evidence.by_parameter[..., 0]
    grown = solve(evidence, np.eye(2))[0].with_growth(0)
    mean, covariance, _ = grown.posterior(np.eye(3))
    assert np.all(np.abs(mean - [0.05, -0.02, 0.03]) < 4 * np.sqrt(np.diag(covariance)))
    assert np.sqrt(covariance[2, 2]) < 0.005
    assert np.allclose([each.posterior(np.eye(3))[0] for each in grown.without], mean, atol=0.01)


def test_of_parameters_that_do_not_grow_nothing_changes():
    solution, _ = solve(random_evidence(np.array([0.05, -0.02]), n=16)[0], np.eye(2))
    grown = solution.with_row(np.array([1.0, 0.0]), 0.05, 1e-3).with_growth(1)
    np.testing.assert_allclose(grown.posterior(np.diag([1.0, 1.0, 0.0]))[0][:2], [0.05, -0.02], atol=SOLVED)
    np.testing.assert_allclose(grown.posterior(np.eye(3))[0], [0.05, -0.02, 0.0], atol=5 * SOLVED)


def test_a_row_tells_each_block_the_same():
    evidence, _ = random_evidence(np.array([0.05, -0.02]), noise=0.1)
    row, value = np.array([1.0, 0.0]), 0.3
    solution = solve(evidence, np.eye(2))[0].with_row(row, value, 1e-9)
    assert all(abs(each.posterior(np.eye(2))[0][0] - value) < SOLVED for each in (solution, *solution.without))


def thrown(n, rate):
    """Times at a stated rate of a throw filmed at 25 images a second, a point beside its centre, its rotations."""
    t = np.arange(n) / 25
    angle = 5 * t
    R = np.stack(
        [np.cos(angle), -np.sin(angle), 0 * t, np.sin(angle), np.cos(angle), 0 * t, 0 * t, 0 * t, 1 + 0 * t], 1
    )
    R = R.reshape(-1, 3, 3) @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0.0]])
    centre = np.outer(t, [1.0, 0.2, 3.0]) - 0.5 * np.outer(t**2, [0, 0, 9.81])
    return np.arange(n) / rate, centre + R @ np.array([0.1, 0.2, 0.0]), R


def known(n):
    """Covariances of positions that are known to a millimetre."""
    return np.tile(1e-6 * np.eye(3), (n, 1, 1))


def test_a_fall_is_measured_whatever_point_of_the_body_is_tracked():
    found = fall(*thrown(12, 25), known(12))
    assert found is not None
    np.testing.assert_allclose(found[1], -9.81, atol=1e-6)


def test_a_fall_is_measured_across_a_direction_that_one_camera_hardly_sees():
    time_s, position, R = thrown(25, 25)
    depth = np.array([0.6, 0.8, 0.0])
    blurred = position + np.random.default_rng(3).normal(0, 0.03, (25, 1)) * depth
    covariance = known(25) + 0.03**2 * np.outer(depth, depth)
    assert fall(time_s, blurred, R, known(25)) is None  # by its residuals no parabola
    found = fall(time_s, blurred, R, covariance)
    assert found is not None
    assert abs(found[1] + 9.81) < 2 * found[2] < 0.5
    blurred[3] += 5  # where nothing is known, a position counts for nothing
    covariance[3] = np.inf
    found = fall(time_s, blurred, R, covariance)
    assert found is not None
    assert abs(found[1] + 9.81) < 2 * found[2] < 0.5
    assert fall(time_s, blurred, R, np.full((25, 3, 3), np.nan)) is None


@pytest.mark.parametrize(
    ("rate", "said"),
    [(25, None), (22, None), (12.5, "2.5 m/s²"), (50, "39.2 m/s²"), (6.25, "0.6 m/s²"), (100, "157.0 m/s²"), (3, None)],
)
def test_a_fall_that_no_size_explains_tells_of_a_wrong_rate(rate, said):
    found = find_wrong_flight(*thrown(40, rate), known(40))
    assert (found is None) == (said is None)
    if found is not None:
        assert said in found.sentence and f"{rate / 25:.2f} times that" in found.sentence
        assert found.gravity_m_s2 == pytest.approx(9.81 * (rate / 25) ** 2, rel=0.01) and found.to_dict()["is_alarm"]


@pytest.mark.parametrize(("n", "is_long"), [(12, False), (14, True)])
def test_a_fall_counts_by_its_depth_whatever_the_rate(n, is_long):
    """Of 0.44 and 0.52 s in truth; hands lead a thing on a shorter one."""
    for rate in (12.5, 50):
        assert (find_wrong_flight(*thrown(n, rate), known(n)) is not None) == is_long


@pytest.mark.parametrize("up", ["x", "y"])
def test_a_fall_along_another_axis_than_z_is_named(up):
    time_s, position, R = thrown(40, 25)
    world = np.roll(np.eye(3), "xyz".index(up) + 1, axis=0)  # z becomes it
    turned = time_s, position @ world.T, world @ R
    found = find_wrong_flight(*turned, known(40))
    assert found is not None and f"towards −{up}, 90° from straight down" in found.sentence
    assert fall(*turned, known(40)) is None


@pytest.mark.parametrize(("off_deg", "is_named"), [(2, False), (5, True)])
def test_a_world_that_is_not_level_is_named(off_deg, is_named):
    time_s, position, R = thrown(40, 25)
    world = Rotation.from_euler("x", off_deg, degrees=True).as_matrix()
    found = find_wrong_flight(time_s, position @ world.T, world @ R, known(40))
    assert (found is not None) == is_named
    if found is not None:
        assert f"{off_deg}° from straight down" in found.sentence


def test_a_wrong_rate_is_named_in_a_world_that_is_not_level_too():
    time_s, position, R = thrown(40, 12.5)
    world = Rotation.from_euler("x", 5, degrees=True).as_matrix()
    found = find_wrong_flight(time_s, position @ world.T, world @ R, known(40))
    assert found is not None and "0.50 times that" in found.sentence


def test_a_world_upside_down_is_named():
    time_s, position, R = thrown(40, 25)
    found = find_wrong_flight(time_s, -position, R, known(40))
    assert found is not None and "towards +z, 180°" in found.sentence


def test_a_body_at_rest_does_not_fall():
    assert find_wrong_flight(np.arange(40) / 25, np.zeros((40, 3)), np.tile(np.eye(3), (40, 1, 1)), known(40)) is None
    assert fall(np.arange(12) / 25, np.zeros((12, 3)), np.tile(np.eye(3), (12, 1, 1)), known(12)) is None
