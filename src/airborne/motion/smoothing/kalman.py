"""Kalman smoother: a white-jerk path and a tracker's errors, whose sizes the path itself shows, by maximum likelihood.

Each path obeys d3x/dt3 = white noise of density q, the same on all axes. A measurement is the path plus the tracker's
error: its covariance as stated, times one number up to 1, part of it white and the rest a process of its own, a Matern
process of order 3/2 over 0.05 s: trackers' errors are smooth. Stated covariances are bounds, often several times too
wide, so only their course in time and direction is believed. What smoothing does depends on q over that number, which
is concentrated out of the likelihood: Harvey 1989, "Forecasting, structural time series models and the Kalman filter",
section 3.4. The states are smoothed after Rauch, Tung and Striebel 1965, "Maximum likelihood estimates of linear
dynamic systems"; white jerk: Bar-Shalom, Li and Kirubarajan, "Estimation with Applications to Tracking and Navigation",
section 6.2; Matern processes as states: Hartikainen and Sarkka 2010, "Kalman filtering and smoothing solutions to
temporal Gaussian process regression models".
"""

from __future__ import annotations

from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, minimize_scalar

from airborne.kernels import kernel
from airborne.kernels.arrays import assign
from airborne.motion.smoothing.segments import MIN_FRAMES, SmoothedPaths, finite_rows
from airborne.types import Array

PRIOR_SD = (10.0, 100.0, 1000.0)  # of value, velocity, acceleration at first [unit, unit/s, ...], over scale: weak
# of the smooth errors' correlation, chosen on synthetic somersaults 71 and 72: with 0.03 s less is smoothed, with
# 0.07 s joints of a pike err more
ERROR_S = 0.05
_WHITE_SHARES = (0.003, 0.03, 0.3)  # of the error's variance, that are tried
_LOG_DENSITY = (-6.0, 12.0)  # search range: powers of ten of q over the scale of the errors [unit2/s5]
_LOG_STEP = 0.02  # tolerance of the search, powers of ten
_UNOBSERVED_SD = 0.15  # [unit] of a direction with an infinite variance: `tracking.covariance` states none beyond
_WHITE_JERK = np.array([[20.0, 8.0, 6.0], [8.0, 3.0, 2.0], [6.0, 2.0, 1.0]])  # divisors of its discrete noise
_LEAST_VARIANCE = 1e-12  # [unit2] keeps roots and logarithms finite


class StateSpaceModel(NamedTuple):
    """A linear Gaussian model of n times: x' = F x + noise Q, z = H x + noise R; NaN rows of z are missing."""

    F: Array  # (n - 1, d, d)
    Q: Array  # (n - 1, d, d)
    H: Array  # (n, k, d)
    R: Array  # (n, k, k)
    mean: Array  # (d,) of the first state
    P: Array  # (d, d)


def kalman_smoother(time_s: Array, values: Array, covariance: Array) -> SmoothedPaths:
    """Smooth one stretch (n, k) with the Kalman smoother; see `Smoother`.

    A row whose covariance is unknown counts as missing; an infinite variance as that of 0.15 units. NaN if no
    covariance is known. Missing rows are predicted from both sides. The standard deviations are those of the stated
    covariances.
    """
    noise = measurement_noise(covariance)
    is_measured = finite_rows(values) & finite_rows(noise.root.reshape(len(values), -1))
    if is_measured.sum() < 3:
        return SmoothedPaths.unknown(values.shape)
    values = np.where(is_measured[:, None], values, np.nan)
    noise = noise._replace(root=np.where(is_measured[:, None, None], noise.root, np.eye(values.shape[1])))
    density, white_share = maximum_likelihood(time_s, values, noise)
    mean, P = rts_smoother(state_space_model(time_s, values, noise, density, white_share=white_share), values)
    n, k = values.shape
    per_unit = _period(time_s) ** -np.arange(3.0)
    value = mean[:, : 3 * k].reshape(n, 3, k) * per_unit[:, None]
    variance = np.diagonal(P, axis1=1, axis2=2)[:, : 3 * k].reshape(n, 3, k)
    sd = np.sqrt(np.maximum(variance, 0.0)) * per_unit[:, None]
    return SmoothedPaths(value[:, 0], value[:, 1], value[:, 2], sd[:, 0], sd[:, 1], sd[:, 2])


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


def maximum_likelihood(time_s: Array, values: Array, noise: MeasurementNoise) -> tuple[float, float]:
    """Return the likeliest density of the white jerk over the errors' scale [unit2/s5], and their white share.

    Rows that are not observed in all directions only count where there are hardly others.
    """
    observed = np.where(np.any(noise.unobserved, axis=1, keepdims=True), np.nan, values)
    values = observed if finite_rows(observed).sum() >= MIN_FRAMES else values
    n_values = max(int(np.isfinite(values).sum()) - 3 * values.shape[1], 1)  # less what the weak first state takes

    def cost(log_density: float, white_share: float) -> float:
        model = state_space_model(time_s, values, noise, 10.0**log_density, white_share=white_share)
        fit = kalman_filter(model, values)
        scale = np.clip(fit.squares / n_values, _LEAST_VARIANCE, 1.0)  # the likeliest that is no larger than stated
        return n_values * np.log(scale) + fit.squares / scale + fit.log_determinant

    ends = []
    for share in _WHITE_SHARES:
        found = minimize_scalar(
            cost, bounds=_LOG_DENSITY, args=(share,), method="bounded", options={"xatol": _LOG_STEP}
        )
        result = cast(OptimizeResult, found)
        ends.append((float(result.fun), 10.0 ** float(result.x), share))
    return min(ends)[1:]


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


class FilterResult(NamedTuple):
    """What the Kalman filter leaves; -2 log-likelihood is squares + log_determinant + a constant."""

    predicted: Array  # (n, d) means before each measurement
    P_predicted: Array  # (n, d, d)
    mean: Array  # (n, d) after it
    P: Array  # (n, d, d)
    squares: float  # of the innovations, over their variances
    log_determinant: float  # of these


def kalman_filter(model: StateSpaceModel, values: Array) -> FilterResult:
    """Run the Kalman filter. Measurements are whitened first, so that a row's numbers are processed one at a time."""
    root = np.linalg.cholesky(model.R)
    H = np.linalg.solve(root, model.H)
    white = np.linalg.solve(root, values[..., None])[..., 0]
    is_measured = finite_rows(values)
    results = _filter_kernel(model.F, model.Q, H, white, is_measured, model.mean, model.P)
    before, P_before, mean, P, squares, logs = results
    whitened = 2 * np.log(np.diagonal(root, axis1=1, axis2=2)[is_measured]).sum()
    return FilterResult(before, P_before, mean, P, float(squares), float(logs + whitened))


@kernel
def _filter_kernel(
    F: Array, Q: Array, H: Array, z: Array, is_measured: NDArray[np.bool_], mean: Array, P: Array
) -> tuple[Array, Array, Array, Array, float, float]:
    n, k, d = H.shape
    before, after = np.empty((n, d)), np.empty((n, d))
    P_before, P_after = np.empty((n, d, d)), np.empty((n, d, d))
    mean, P, Ph, squares, logs = mean.copy(), P.copy(), np.empty(d), 0.0, 0.0
    for i in range(n):
        if i:
            mean = _predict_mean(F[i - 1], mean)
            P = _predict_covariance(F[i - 1], P, Q[i - 1])
        assign(before[i], mean)
        assign(P_before[i], P)
        if is_measured[i]:
            for j in range(k):
                S, error = 1.0, z[i, j]
                for a in range(d):
                    Ph[a] = 0.0
                    for b in range(d):
                        Ph[a] += P[a, b] * H[i, j, b]
                    S += H[i, j, a] * Ph[a]
                    error -= H[i, j, a] * mean[a]
                for a in range(d):
                    mean[a] += Ph[a] * error / S
                    for b in range(d):
                        P[a, b] -= Ph[a] * Ph[b] / S
                squares += error * error / S
                logs += np.log(S)
        assign(after[i], mean)
        assign(P_after[i], P)
    return before, P_before, after, P_after, squares, logs


@kernel(is_inner=True)
def _predict_mean(F: Array, mean: Array) -> Array:
    predicted = np.zeros_like(mean)
    for a in range(len(mean)):
        for b in range(len(mean)):
            predicted[a] += F[a, b] * mean[b]
    return predicted


@kernel(is_inner=True)
def _predict_covariance(F: Array, P: Array, Q: Array) -> Array:
    """Return F P F' + Q."""
    d = len(P)
    half, predicted = np.zeros_like(P), Q.copy()
    for a in range(d):
        for b in range(d):
            if F[a, b] != 0.0:
                for c in range(d):
                    half[a, c] += F[a, b] * P[b, c]
    for a in range(d):
        for b in range(d):
            if F[a, b] != 0.0:
                for c in range(d):
                    predicted[c, a] += half[c, b] * F[a, b]
    return predicted


def rts_smoother(model: StateSpaceModel, values: Array) -> tuple[Array, Array]:
    """Run the filter forward and the Rauch-Tung-Striebel smoother backward: means (n, d), covariances (n, d, d)."""
    predicted, P_predicted, mean, P, _, _ = kalman_filter(model, values)
    for i in range(len(values) - 2, -1, -1):
        gain = np.linalg.solve(P_predicted[i + 1], model.F[i] @ P[i]).T
        mean[i] += gain @ (mean[i + 1] - predicted[i + 1])
        P[i] += gain @ (P[i + 1] - P_predicted[i + 1]) @ gain.T
    return mean, P


def _for_each_axis(small: Array, one: Array) -> Array:
    """Repeat matrices (m, 5, 5) for independent axes: (m, 5 k, 5 k)."""
    size = small.shape[1] * len(one)
    return np.ascontiguousarray(np.einsum("mab,ij->maibj", small, one).reshape(-1, size, size))


def _period(time_s: Array) -> float:
    return float(np.median(np.diff(time_s)))
