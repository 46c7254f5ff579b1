"""Values between and around tracked times: polynomials near one time, with their covariances."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airborne.motion.contact import noise_covariance

Array = NDArray[np.floating]

_NEAREST, _FARTHEST_S = 9, 0.12


def local_fit(time_s: Array, values: Array, variance: Array, at_s: float) -> tuple[Array, Array]:
    """Fit a parabola to the nine known values nearest to a time: value and slope there (2, k), covariance (2, 2, k).

    `values` and `variance` are (n, k), NaN where unknown; only values within 0.12 s count. NaN where fewer than five
    are known, or all lie on one side and the nearest is not the time's neighbour.
    """
    k = values.shape[1]
    unknown = np.full((2, k), np.nan), np.full((2, 2, k), np.nan)
    is_known = np.isfinite(values).all(axis=1) & (np.abs(time_s - at_s) <= _FARTHEST_S)
    rows = np.flatnonzero(is_known)
    rows = np.sort(rows[np.argsort(np.abs(time_s[rows] - at_s), kind="stable")[:_NEAREST]])
    if len(rows) < 5:
        return unknown
    u = time_s[rows] - at_s
    step = float(np.min(np.diff(time_s[rows])))
    if u[0] > step or u[-1] < -step:
        return unknown
    scale = float(np.abs(u).max())
    powers = np.vander(u / scale, 3, increasing=True)
    hat = np.linalg.solve(powers.T @ powers, powers.T)[:2] / np.array([[1.0], [scale]])
    return hat @ values[rows], np.moveaxis(hat @ noise_covariance(u, variance[rows].T) @ hat.T, 0, -1)


def peak_draws(
    rng: np.random.Generator, time_s: Array, height_m: Array, variance: Array, *, bend: tuple[float, float, float]
) -> Array:
    """Draw the largest height of a path near time 0 from its posterior: (draws,) [m].

    A cubic is fitted to the heights (n,), known all of them, at `time_s` (n,) around the peak. `bend` is what is known
    before: mean and deviation of the acceleration [m/s2], deviation of its change [m/s3].
    """
    mean_bend, bend_sd, change_sd = bend
    terms = np.stack([np.ones_like(time_s), time_s, time_s**2 / 2, time_s**3 / 6], axis=-1)
    weight = np.linalg.inv(noise_covariance(time_s, variance))
    prior = np.diag([0.0, 0.0, bend_sd**-2, change_sd**-2])
    covariance = np.linalg.inv(terms.T @ weight @ terms + prior)
    mean = covariance @ (terms.T @ weight @ height_m + prior @ [0, 0, mean_bend, 0])
    draws = rng.multivariate_normal(mean, covariance, N_DRAWS, method="cholesky")
    grid = np.linspace(time_s[0], time_s[-1], 61)
    return np.asarray((draws @ np.stack([np.ones(61), grid, grid**2 / 2, grid**3 / 6])).max(axis=1))


N_DRAWS = 1000
