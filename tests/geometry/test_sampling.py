"""Quantiles are those of SciPy's statistics; samples are even in every coordinate."""

import numpy as np
from scipy import stats

from airborne.geometry.sampling import chi2_quantile, latin_hypercube
from tests.support.tolerances import ROUNDTRIP


def test_quantiles_are_those_of_the_chi_squared_distribution():
    freedom = np.array([1, 2.5, 30])
    for share in (0.025, 0.95, 0.99):
        np.testing.assert_allclose(chi2_quantile(share, freedom), stats.chi2.ppf(share, freedom), rtol=ROUNDTRIP)


def test_every_coordinate_has_one_sample_in_each_part():
    points = latin_hypercube(6, 40, seed=3)
    for column in points.T:
        np.testing.assert_array_equal(np.sort((40 * column).astype(int)), np.arange(40))


def test_the_same_seed_gives_the_same_samples():
    np.testing.assert_array_equal(latin_hypercube(2, 8, seed=1), latin_hypercube(2, 8, seed=1))
    assert np.any(latin_hypercube(2, 8, seed=1) != latin_hypercube(2, 8, seed=2))
