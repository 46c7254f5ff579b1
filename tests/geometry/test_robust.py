"""Where the middle of numbers is, and how much they scatter."""

import warnings

import numpy as np

from airborne.geometry.robust import covariance_of_sum, known_median, robust_sd


def test_a_known_median_is_that_of_what_is_not_nan():
    rng = np.random.default_rng(0)
    values = rng.random((9, 4, 50)).astype(np.float32)
    values[rng.random(values.shape) < 0.5] = np.nan
    values[1:, 0, 0] = values[:, 0, 1] = np.nan
    values[0, 0, 0] = 0.3
    with warnings.catch_warnings(action="ignore"):  # that nothing is known of one
        np.testing.assert_array_equal(known_median(values), np.nanmedian(values, axis=0))


def test_robust_sd_is_that_of_normal_noise_however_far_outliers_are():
    rng = np.random.default_rng(1)
    values = rng.normal(5.0, 0.3, 20_000)
    clean = robust_sd(values)
    values[:200] += 1e6
    assert abs(clean / 0.3 - 1) < 0.02
    assert abs(robust_sd(values) / 0.3 - 1) < 0.04


def test_covariance_of_sum_counts_what_neighbours_share():
    """Moving means over three: what repeated sums scatter by, against what one run says, and what independence says."""
    rng = np.random.default_rng(2)

    def terms() -> np.ndarray:
        noise = rng.normal(0, [1.0, 2.0], (402, 2))
        return noise[:-2] + noise[1:-1] + noise[2:]

    sums = np.stack([terms().sum(axis=0) for _ in range(3000)])
    said = np.mean([covariance_of_sum(terms(), 12) for _ in range(300)], axis=0)
    alone = np.mean([covariance_of_sum(terms(), 0) for _ in range(300)], axis=0)
    assert np.allclose(np.diag(said) / sums.var(axis=0), 1, atol=0.15)
    assert np.all(np.diag(alone) < 0.4 * sums.var(axis=0))
