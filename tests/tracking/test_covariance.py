"""A covariance says how sure a pose is, and what the images do not show."""

import numpy as np
import pytest

from airborne.tracking.covariance import covariance_of, eigen_decomposition
from tests.support.tolerances import ROUNDTRIP

ROUND = np.diag([1e6, 1e6, 1e6, 0, 0, 0])  # a ball: rotating it changes nothing


def steep(seed=0):
    """A curvature that shows every direction well."""
    factor = np.random.default_rng(seed).normal(size=(6, 6))
    return 1e4 * (factor @ factor.T + np.eye(6))


@pytest.mark.parametrize("seed", range(4))
def test_covariance_is_the_inverse_curvature_times_the_noise(seed):
    curvature = steep(seed)
    np.testing.assert_allclose(covariance_of(curvature, noise=2.5) @ curvature, 2.5 * np.eye(6), atol=ROUNDTRIP)


def test_variance_grows_with_the_noise():
    np.testing.assert_allclose(covariance_of(steep(), noise=4.0), 4 * covariance_of(steep(), noise=1.0), rtol=ROUNDTRIP)


def test_ball_has_a_position_and_no_rotation():
    covariance = covariance_of(ROUND, noise=1.0)
    np.testing.assert_allclose(covariance[:3, :3], 1e-6 * np.eye(3), atol=ROUNDTRIP * 1e-6)
    np.testing.assert_array_equal(np.diag(covariance)[3:], np.inf)
    assert not covariance[:3, 3:].any()


def test_unobserved_direction_touches_only_the_axes_it_has_a_part_in():
    axis = np.array([0, 0, 0, 0, 0.6, 0.8])  # rotations about an axis between y and z
    curvature = 1e5 * (np.eye(6) - np.outer(axis, axis))
    variance = np.diag(covariance_of(curvature, noise=1.0))
    np.testing.assert_array_equal(np.isinf(variance), [False, False, False, False, True, True])


def test_depth_of_one_camera_counts_as_unobserved_only_when_it_is_worse_than_the_limit():
    observed, unobserved = (
        np.diag([1e6, precision, 1e6, 1e6, 1e6, 1e6]) for precision in (0.15**-2 * 1.01, 0.15**-2 * 0.99)
    )
    assert np.isfinite(covariance_of(observed, noise=1.0)).all()
    assert np.isinf(covariance_of(unobserved, noise=1.0)[1, 1])


def test_nothing_observed_is_all_infinite():
    variance = np.diag(covariance_of(np.zeros((6, 6)), noise=1.0))
    np.testing.assert_array_equal(variance, np.inf)


def test_hollow_curvature_counts_as_unobserved():
    curvature = np.diag([1e6, 1e6, 1e6, 1e6, 1e6, -1e3])
    assert np.isinf(covariance_of(curvature, noise=1.0)[5, 5])


def test_covariance_is_symmetric_and_positive():
    for seed in range(4):
        score_covariance = steep(seed + 10)
        covariance = covariance_of(steep(seed), noise=1.0, score_covariance=score_covariance)
        np.testing.assert_array_equal(covariance, covariance.T)
        assert np.linalg.eigvalsh(covariance).min() > 0


def test_the_larger_of_noise_and_score_covariance_holds():
    curvature = steep()
    quiet = covariance_of(curvature, noise=1.0, score_covariance=0.01 * curvature)
    loud = covariance_of(curvature, noise=1.0, score_covariance=9 * curvature)
    np.testing.assert_allclose(quiet, covariance_of(curvature, noise=1.0), rtol=ROUNDTRIP)
    np.testing.assert_allclose(loud, covariance_of(curvature, noise=9.0), rtol=ROUNDTRIP)


@pytest.mark.parametrize("size", [1, 6, 57])
def test_eigenvectors_are_lapacks(size):
    rng = np.random.default_rng(size)
    root = rng.normal(size=(size, size)) * 10.0 ** rng.uniform(-3, 3, size)
    matrix = root.T @ root
    values, directions = eigen_decomposition(matrix)
    np.testing.assert_allclose(np.sort(values), np.linalg.eigvalsh(matrix), rtol=1e-9, atol=1e-9 * values.max())
    np.testing.assert_allclose(directions.T @ directions, np.eye(size), atol=1e-12)
    np.testing.assert_allclose(directions * values @ directions.T, matrix, atol=1e-10 * values.max())
