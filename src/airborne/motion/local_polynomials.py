"""Local polynomials: values and slopes between and around tracked times, with their covariances."""

from __future__ import annotations

import numpy as np

from airborne.motion.free_fall import noise_covariance
from airborne.types import Array

N_DRAWS = 1000  # from a posterior
_NEAREST, _LEAST, _FARTHEST_S = 9, 5, 0.12  # frames of a parabola, at least, and how far off they may lie


def local_fits(time_s: Array, values: Array, variance: Array, at_s: Array) -> tuple[Array, Array]:
    """Fit parabolas to the nine known values nearest to each of the given times.

    `time_s` (n,) in order; `values` and `variance` (n, k), NaN where unknown; `at_s` (m,). Returns value and slope
    there (m, 2, k) and their covariance (m, k, 2, 2). Only values within 0.12 s count. NaN where fewer than five are
    known, or where all lie on one side and the nearest is more than one frame away.
    """
    m, k = len(at_s), values.shape[1]
    fit, covariance = np.full((m, 2, k), np.nan), np.full((m, k, 2, 2), np.nan)
    known = np.flatnonzero(np.isfinite(values).all(axis=1))
    n = min(_NEAREST, len(known))
    if n < _LEAST:
        return fit, covariance
    known_s = time_s[known]
    starts = np.searchsorted(known_s, at_s)[:, None] + np.arange(-n, 1)
    starts = np.clip(starts, 0, len(known) - n)
    reach = np.maximum(at_s[:, None] - known_s[starts], known_s[starts + n - 1] - at_s[:, None])
    start = np.take_along_axis(starts, reach.argmin(axis=1)[:, None], axis=1)
    rows = known[start + np.arange(n)]
    u = time_s[rows] - at_s[:, None]
    counts = np.abs(u) <= _FARTHEST_S
    step = np.where(counts[:, 1:] & counts[:, :-1], np.diff(u), np.inf).min(axis=1)
    first, last = np.where(counts, u, np.inf).min(axis=1), np.where(counts, u, -np.inf).max(axis=1)
    is_known = (counts.sum(axis=1) >= _LEAST) & (first <= step) & (last >= -step)
    rows, u, counts = rows[is_known], u[is_known], counts[is_known]
    powers = (u / _FARTHEST_S)[..., None] ** np.arange(3) * counts[..., None]
    transposed = np.swapaxes(powers, 1, 2)
    hat = np.linalg.solve(transposed @ powers, transposed)[:, :2] / np.array([[1.0], [_FARTHEST_S]])
    fit[is_known] = hat @ values[rows]
    noise = noise_covariance(u[:, None], np.swapaxes(variance[rows], 1, 2))
    covariance[is_known] = hat[:, None] @ noise @ np.swapaxes(hat, 1, 2)[:, None]
    return fit, covariance


def peak_draws(
    rng: np.random.Generator,
    time_s: Array,
    height_m: Array,
    variance: Array,
    *,
    acceleration_prior: tuple[float, float, float],
) -> Array:
    """Draw the peak height of a path near time 0 from its posterior: (draws,) [m].

    A cubic is fitted to the heights (n,), all finite, at `time_s` (n,) around the peak. `acceleration_prior` holds the
    mean and standard deviation of the acceleration [m/s2], and the standard deviation of the jerk [m/s3].
    """
    mean, sd, jerk_sd = acceleration_prior
    terms = np.stack([np.ones_like(time_s), time_s, time_s**2 / 2, time_s**3 / 6], axis=-1)
    weight = np.linalg.inv(noise_covariance(time_s, variance))
    prior = np.diag([0.0, 0.0, sd**-2, jerk_sd**-2])
    covariance = np.linalg.inv(terms.T @ weight @ terms + prior)
    coefficients = covariance @ (terms.T @ weight @ height_m + prior @ [0, 0, mean, 0])
    draws = rng.multivariate_normal(coefficients, covariance, N_DRAWS, method="cholesky")
    grid = np.linspace(time_s[0], time_s[-1], 61)
    return np.asarray((draws @ np.stack([np.ones(61), grid, grid**2 / 2, grid**3 / 6])).max(axis=1))
