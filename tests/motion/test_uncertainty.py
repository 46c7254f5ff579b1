"""Variances pass through Jacobians, unseen and unknown directions with them."""

import numpy as np
import pytest

from airborne.motion.uncertainty import propagate_variances, standard_deviation
from tests.support.tolerances import EXACT

RNG = np.random.default_rng(0)
JACOBIAN, ROOT = RNG.normal(size=(3, 4, 6)), RNG.normal(size=(6, 6))
COVARIANCE = ROOT @ ROOT.T


def test_variances_are_the_diagonal_of_j_c_jt():
    expected = np.diagonal(JACOBIAN @ COVARIANCE @ np.swapaxes(JACOBIAN, -1, -2), axis1=-2, axis2=-1)
    np.testing.assert_allclose(propagate_variances(JACOBIAN, COVARIANCE), expected, rtol=EXACT * 10)


@pytest.mark.parametrize("odd", [np.inf, np.nan])
def test_unobserved_or_unknown_direction_counts_only_for_what_depends_on_it(odd):
    covariance = COVARIANCE.copy()
    covariance[2, :] = covariance[:, 2] = 0.0
    covariance[2, 2] = odd
    jacobian = JACOBIAN.copy()
    jacobian[0, :, 2] = 1e-17  # a rounding error, no motion
    result = propagate_variances(jacobian, covariance)
    seen = [0, 1, 3, 4, 5]
    np.testing.assert_allclose(result[0], propagate_variances(jacobian[..., seen], COVARIANCE[np.ix_(seen, seen)])[0])
    np.testing.assert_array_equal(result[1:], np.full((2, 4), odd))


def test_unknown_correlations_leave_what_rests_on_them_unknown():
    covariance = COVARIANCE.copy()
    covariance[0, 1] = covariance[1, 0] = np.nan
    result = propagate_variances(np.array([[1.0, 1, 0, 0, 0, 0], [1, 0, 1, 0, 0, 0]]), covariance)
    assert np.isnan(result).tolist() == [True, False]


def test_negative_variance_is_an_unknown_deviation():
    np.testing.assert_array_equal(
        standard_deviation(np.array([4.0, -1.0, np.inf, np.nan])), [2.0, np.nan, np.inf, np.nan]
    )
