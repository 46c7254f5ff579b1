"""Kalman smoother: a white-jerk path and a tracker's errors, whose sizes the path itself shows, by maximum likelihood.

Each path obeys d3x/dt3 = white noise of density q, the same on all axes. A measurement is the path plus the tracker's
fast error: its covariance as stated, times one number up to 1, part of it white and the rest a process of its own, a
Matern process of order 3/2 over 0.05 s. What smoothing does depends on q over that number, which is concentrated out of
the likelihood: Harvey 1989, "Forecasting, structural time series models and the Kalman filter", section 3.4. The rest
of the stated covariance is slow: no smoother tells it from motion, so it stays in the result. People's errors are slow,
as their bodies' shapes give them; those of a thing without joints come from its images: all are fast.

White jerk: Bar-Shalom, Li and Kirubarajan, "Estimation with Applications to Tracking and Navigation", section 6.2;
Matern processes as states: Hartikainen and Sarkka 2010, "Kalman filtering and smoothing solutions to temporal Gaussian
process regression models"; derivatives of a Gaussian process: Rasmussen and Williams 2006, "Gaussian Processes for
Machine Learning", section 9.4.
"""

from __future__ import annotations

from typing import NamedTuple, cast

import numpy as np
from scipy.optimize import OptimizeResult, minimize_scalar

from airborne.motion.smoothing.segments import MIN_FRAMES, SmoothedPaths, finite_rows
from airborne.motion.smoothing.state_space import StateSpaceModel, kalman_filter, rts_smoother
from airborne.types import Array

PRIOR_SD = (10.0, 100.0, 1000.0)  # of value, velocity, acceleration at first [unit, unit/s, ...], over scale: weak
# of the smooth errors' correlation, chosen on synthetic somersaults 71 and 72: with 0.03 s less is smoothed, with
# 0.07 s joints of a pike err more
ERROR_S = 0.05
# of the slow errors' correlation, a Gaussian's sd; chosen on synthetic somersaults 901 to 904: there velocities are
# within their sds as often as positions are
SLOW_S = 0.12
_SLOW_DERIVATIVES = np.array([1.0, 1 / SLOW_S**2, 3 / SLOW_S**4])  # variances of such a process and its derivatives
_WHITE_SHARES = (0.003, 0.03, 0.3)  # of the error's variance, that are tried
_LOG_DENSITY = (-6.0, 12.0)  # search range: powers of ten of q over the scale of the errors [unit2/s5]
_LOG_STEP = 0.02  # tolerance of the search, powers of ten
_UNOBSERVED_SD = 0.15  # [unit] of a direction with an infinite variance: `tracking.covariance` states none beyond
_WHITE_JERK = np.array([[20.0, 8.0, 6.0], [8.0, 3.0, 2.0], [6.0, 2.0, 1.0]])  # divisors of its discrete noise
_FEWEST = 3  # rows: a parabola has as many numbers
_LEAST_VARIANCE = 1e-12  # [unit2] keeps roots and logarithms finite


def kalman_smoother(time_s: Array, values: Array, covariance: Array, *, are_errors_slow: bool = False) -> SmoothedPaths:
    """Smooth one stretch (n, k) with the Kalman smoother; see `Smoother`.

    A row whose covariance is unknown counts as missing; an infinite variance as that of 0.15 units. NaN if no
    covariance is known. Missing rows are predicted from both sides. The standard deviations are those of the fast
    errors after smoothing, and of the slow ones.
    """
    measured = _measurements(values, covariance)
    if measured is None:
        return SmoothedPaths.unknown(values.shape)
    values, noise = measured
    errors = maximum_likelihood(time_s, values, noise, are_slow=are_errors_slow)
    model = state_space_model(time_s, values, noise, errors.density, white_share=errors.white_share)
    mean, P = rts_smoother(model, values)
    n, k = values.shape
    per_unit = _period(time_s) ** -np.arange(3.0)
    value = mean[:, : 3 * k].reshape(n, 3, k) * per_unit[:, None]
    fast = errors.fast_share * np.diagonal(P, axis1=1, axis2=2)[:, : 3 * k].reshape(n, 3, k) * per_unit[:, None] ** 2
    stated = np.diagonal(noise.root @ noise.root, axis1=1, axis2=2) + noise.unobserved
    rows = np.flatnonzero(finite_rows(values))  # in gaps slow errors are as between their ends
    stated = np.stack([np.interp(np.arange(n), rows, each[rows]) for each in stated.T], axis=1)
    slow = (1 - errors.fast_share) * stated[:, None] * _SLOW_DERIVATIVES[:, None]
    sd = np.sqrt(np.maximum(fast, 0.0) + slow)
    return SmoothedPaths(value[:, 0], value[:, 1], value[:, 2], sd[:, 0], sd[:, 1], sd[:, 2])


def _measurements(values: Array, covariance: Array) -> tuple[Array, MeasurementNoise] | None:
    """Return values (n, k), NaN where they or their errors are unknown, and the errors; None of fewer than three."""
    noise = measurement_noise(covariance)
    is_measured = finite_rows(values) & finite_rows(noise.root.reshape(len(values), -1))
    if is_measured.sum() < _FEWEST:
        return None
    root = np.where(is_measured[:, None, None], noise.root, np.eye(values.shape[1]))
    return np.where(is_measured[:, None], values, np.nan), noise._replace(root=root)


def path_errors(time_s: Array, values: Array, covariance: Array, *, are_slow: bool) -> PathErrors | None:
    """Return the likeliest errors of a path (n, k); None where hardly any of its covariances is known."""
    measured = _measurements(values, covariance)
    return None if measured is None else maximum_likelihood(time_s, *measured, are_slow=are_slow)


class PathErrors(NamedTuple):
    """A path's jerk and its tracker's fast errors, as likely as can be."""

    density: float  # [unit2/s5] of the white jerk, over the fast share
    fast_share: float  # of the stated variance
    white_share: float  # of that share


def error_correlations(time_s: Array, white_share: float) -> tuple[Array, Array]:
    """Return the correlations of a tracker's fast errors and of its slow ones at times (n,): two (n, n)."""
    lag_s = np.abs(time_s[:, None] - time_s)
    x = np.sqrt(3) * lag_s / ERROR_S
    fast = white_share * np.eye(len(time_s)) + (1 - white_share) * (1 + x) * np.exp(-x)
    return fast, np.exp(-((lag_s / SLOW_S) ** 2) / 2)


class MeasurementNoise(NamedTuple):
    """The stated errors of a tracker; NaN where unknown."""

    root: Array  # (n, k, k) symmetric root of the covariance, infinite variances left out
    unobserved: Array  # (n, k) variance of the unobserved directions, else 0


def measurement_noise(covariance: Array) -> MeasurementNoise:
    """Split covariances (n, k, k) into observed and unobserved parts; eigenvalues are clipped to be positive."""
    is_unobserved = np.isinf(np.diagonal(covariance, axis1=1, axis2=2))
    observed = np.where(is_unobserved[:, :, None] | is_unobserved[:, None, :], 0.0, covariance)
    is_known = finite_rows(observed.reshape(len(observed), -1))
    root = np.full(observed.shape, np.nan)
    eigenvalues, axes = np.linalg.eigh(observed[is_known])
    root[is_known] = np.einsum("nij,nj,nkj->nik", axes, np.sqrt(np.maximum(eigenvalues, _LEAST_VARIANCE)), axes)
    return MeasurementNoise(root, np.where(is_unobserved, _UNOBSERVED_SD**2, 0.0))


def maximum_likelihood(time_s: Array, values: Array, noise: MeasurementNoise, *, are_slow: bool = False) -> PathErrors:
    """Return the likeliest density of the white jerk, size of the fast errors, and their white share.

    Unless some are slow all errors are fast.

    Rows that are not observed in all directions only count where there are hardly others.
    """
    observed = np.where(np.any(noise.unobserved, axis=1, keepdims=True), np.nan, values)
    values = observed if finite_rows(observed).sum() >= MIN_FRAMES else values
    n_values = max(int(np.isfinite(values).sum()) - 3 * values.shape[1], 1)  # less what the weak first state takes

    def fit(log_density: float, white_share: float) -> tuple[float, float]:
        """Return -2 log-likelihood and the likeliest fast share, no larger than stated."""
        model = state_space_model(time_s, values, noise, 10.0**log_density, white_share=white_share)
        result = kalman_filter(model, values)
        share = float(np.clip(result.squares / n_values, _LEAST_VARIANCE, 1.0))
        return n_values * np.log(share) + result.squares / share + result.log_determinant, share

    ends = []
    for white_share in _WHITE_SHARES:
        found = minimize_scalar(
            lambda x, share=white_share: fit(x, share)[0],
            bounds=_LOG_DENSITY,
            method="bounded",
            options={"xatol": _LOG_STEP},
        )
        result = cast(OptimizeResult, found)
        ends.append((float(result.fun), float(result.x), white_share))
    _, log_density, white_share = min(ends)
    return PathErrors(10.0**log_density, fit(log_density, white_share)[1] if are_slow else 1.0, white_share)


def state_space_model(
    time_s: Array, values: Array, noise: MeasurementNoise, density: float, *, white_share: float
) -> StateSpaceModel:
    """Build the model of one stretch: states are value, velocity and acceleration in units of the period, and the
    smooth error and its rate in units of their standard deviations, (5 k,).
    """  # noqa: D205
    k = values.shape[1]
    period = _period(time_s)
    step = np.diff(time_s)
    one = np.eye(k)
    transition, process_noise = np.zeros((2, len(step), 5, 5))
    T = step / period
    transition[:, range(3), range(3)] = 1.0
    transition[:, 0, 1] = transition[:, 1, 2] = T
    transition[:, 0, 2] = T**2 / 2
    powers = np.add.outer(range(3), range(3))[::-1, ::-1] + 1  # of T: 5, 4, 3 in the first row
    process_noise[:, :3, :3] = density * period**5 * T[:, None, None] ** powers / _WHITE_JERK
    x = np.sqrt(3) * step / ERROR_S
    decay = np.exp(-x) * np.array([[1 + x, x], [-x, 1 - x]])
    transition[:, 3:, 3:] = error = decay.transpose(2, 0, 1)
    process_noise[:, 3:, 3:] = np.eye(2) - error @ error.transpose(0, 2, 1)
    nothing = np.zeros((len(values), k, 2 * k))
    smooth_error = np.sqrt(1 - white_share) * noise.root
    path = np.broadcast_to(one, smooth_error.shape)
    white = white_share * noise.root @ noise.root + noise.unobserved[:, :, None] * one
    first = values[np.flatnonzero(np.isfinite(values).all(axis=1))[0]]
    prior_variance = np.square([PRIOR_SD[0], PRIOR_SD[1] * period, PRIOR_SD[2] * period**2, 1.0, 1.0])
    return StateSpaceModel(
        F=_for_each_axis(transition, one),
        Q=_for_each_axis(process_noise, one),
        H=np.concatenate([path, nothing, smooth_error, nothing[:, :, :k]], axis=2),
        R=white,
        mean=np.concatenate([first, np.zeros(4 * k)]),
        P=np.asarray(np.kron(np.diag(prior_variance), one), float),
    )


def _for_each_axis(small: Array, one: Array) -> Array:
    """Repeat matrices (m, 5, 5) for independent axes: (m, 5 k, 5 k)."""
    size = small.shape[1] * len(one)
    return np.ascontiguousarray(np.einsum("mab,ij->maibj", small, one).reshape(-1, size, size))


def _period(time_s: Array) -> float:
    return float(np.median(np.diff(time_s)))
