"""Kalman smoother with the tracker's own covariances: a white-jerk path, its noise density by maximum likelihood.

Each path obeys d3x/dt3 = white noise of density q, the same on all axes. A measurement is the path plus the tracker's
error; half of its covariance is white and half correlated over 0.1 s (`motion.free_fall.GENERIC_NOISE`), the latter
a state of its own. Source: Rauch, Tung and Striebel 1965, "Maximum likelihood estimates of linear dynamic
systems"; Bar-Shalom, Li and Kirubarajan, "Estimation with Applications to Tracking and Navigation", section 6.2 (the
discrete noise of a continuous white jerk). With white noise alone the result is the fifth-order smoothing spline.
"""

from __future__ import annotations

from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, minimize_scalar

from airborne.kernels import kernel
from airborne.motion.free_fall import GENERIC_NOISE
from airborne.motion.smoothing.segments import SmoothedPaths, finite_rows
from airborne.types import Array

PRIOR_SD = (10.0, 30.0, 300.0)  # of value, velocity, acceleration at the first frame [unit, unit/s, ...]: weak
_LOG_DENSITY = (-6.0, 9.0)  # search range: powers of ten of q [unit2/s5]
_LOG_STEP = 0.02  # tolerance of the search, powers of ten
_UNOBSERVED_SD = 10.0  # of a direction with an infinite variance
_LEAST_VARIANCE = 1e-12  # [unit2] keeps the root finite


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

    A row whose covariance is unknown counts as missing; an infinite variance as that of 10 units. NaN if no covariance
    is known. Missing rows are predicted from both sides, with the resulting standard deviations.
    """
    noise = measurement_noise(covariance)
    is_measured = finite_rows(values) & finite_rows(noise.root.reshape(len(values), -1))
    if is_measured.sum() < 3:
        return SmoothedPaths.unknown(values.shape)
    values = np.where(is_measured[:, None], values, np.nan)
    noise = noise._replace(root=np.where(is_measured[:, None, None], noise.root, np.eye(values.shape[1])))
    density = maximum_likelihood_density(time_s, values, noise)
    mean, P = rts_smoother(state_space_model(time_s, values, noise, density), values)
    n, k = values.shape
    period = _period(time_s)
    scale = period ** -np.arange(3)
    value = mean[:, : 3 * k].reshape(n, 3, k) * scale[:, None]
    variance = np.diagonal(P, axis1=1, axis2=2)[:, : 3 * k].reshape(n, 3, k)
    sd = np.sqrt(np.maximum(variance, 0.0)) * scale[:, None]
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


def maximum_likelihood_density(time_s: Array, values: Array, noise: MeasurementNoise) -> float:
    """Return the maximum-likelihood density q of the white jerk [unit2/s5]."""

    def cost(log_density: float) -> float:
        return -kalman_filter(state_space_model(time_s, values, noise, 10.0**log_density), values)[-1]

    result = minimize_scalar(cost, bounds=_LOG_DENSITY, method="bounded", options={"xatol": _LOG_STEP})
    return float(10.0 ** cast(OptimizeResult, result).x)


def state_space_model(time_s: Array, values: Array, noise: MeasurementNoise, density: float) -> StateSpaceModel:
    """Build the model of one stretch: states are value, velocity and acceleration in units of the period, and the
    correlated part of the error in units of its standard deviation, (4 k,).
    """  # noqa: D205
    k = values.shape[1]
    period = _period(time_s)
    step = np.diff(time_s)
    one = np.eye(k)
    T = step / period
    decay = np.exp(-step / GENERIC_NOISE.correlation_time_s)
    zero, unit = np.zeros_like(T), np.ones_like(T)
    transition = np.array(
        [[unit, T, T**2 / 2, zero], [zero, unit, T, zero], [zero, zero, unit, zero], [zero, zero, zero, decay]]
    )
    jerk = density * period**5
    process_noise = np.array(
        [
            [jerk * T**5 / 20, jerk * T**4 / 8, jerk * T**3 / 6, zero],
            [jerk * T**4 / 8, jerk * T**3 / 3, jerk * T**2 / 2, zero],
            [jerk * T**3 / 6, jerk * T**2 / 2, jerk * T, zero],
            [zero, zero, zero, 1 - decay**2],
        ]
    )
    nothing = np.zeros((len(values), k, 2 * k))
    correlated = np.sqrt(1 - GENERIC_NOISE.white_share) * noise.root
    observation = np.concatenate([np.broadcast_to(one, correlated.shape), nothing, correlated], axis=2)
    white = GENERIC_NOISE.white_share * noise.root @ noise.root + noise.unobserved[:, :, None] * one
    first = values[np.flatnonzero(np.isfinite(values).all(axis=1))[0]]
    prior_variance = np.square([PRIOR_SD[0], PRIOR_SD[1] * period, PRIOR_SD[2] * period**2, 1.0])
    return StateSpaceModel(
        F=_for_each_axis(transition, one),
        Q=_for_each_axis(process_noise, one),
        H=observation,
        R=white,
        mean=np.concatenate([first, np.zeros(3 * k)]),
        P=np.kron(np.diag(prior_variance), one),
    )


def kalman_filter(model: StateSpaceModel, values: Array) -> tuple[Array, Array, Array, Array, float]:
    """Run the Kalman filter: predicted means (n, d) and covariances, filtered ones, log-likelihood [nat].

    Measurements are whitened first, so that a row's numbers can be processed one at a time.
    """
    root = np.linalg.cholesky(model.R)
    H = np.linalg.solve(root, model.H)
    white = np.linalg.solve(root, values[..., None])[..., 0]
    is_measured = finite_rows(values)
    results = _filter_kernel(model.F, model.Q, H, white, is_measured, model.mean, model.P)
    scale = np.log(np.diagonal(root, axis1=1, axis2=2)[is_measured]).sum()
    return *results[:4], float(results[4] - scale)


@kernel
def _filter_kernel(
    F: Array, Q: Array, H: Array, z: Array, is_measured: NDArray[np.bool_], mean: Array, P: Array
) -> tuple[Array, Array, Array, Array, float]:
    n, k, d = H.shape
    before, after = np.empty((n, d)), np.empty((n, d))
    P_before, P_after = np.empty((n, d, d)), np.empty((n, d, d))
    mean, P, Ph, log_likelihood = mean.copy(), P.copy(), np.empty(d), 0.0
    for i in range(n):
        if i:
            mean = _predict_mean(F[i - 1], mean)
            P = _predict_covariance(F[i - 1], P, Q[i - 1])
        before[i], P_before[i] = mean, P
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
                log_likelihood -= 0.5 * (np.log(2 * np.pi * S) + error * error / S)
        after[i], P_after[i] = mean, P
    return before, P_before, after, P_after, log_likelihood


@kernel
def _predict_mean(F: Array, mean: Array) -> Array:
    predicted = np.zeros_like(mean)
    for a in range(len(mean)):
        for b in range(len(mean)):
            predicted[a] += F[a, b] * mean[b]
    return predicted


@kernel
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
    before, P_before, mean, P, _ = kalman_filter(model, values)
    for i in range(len(values) - 2, -1, -1):
        gain = np.linalg.solve(P_before[i + 1], model.F[i] @ P[i]).T
        mean[i] += gain @ (mean[i + 1] - before[i + 1])
        P[i] += gain @ (P[i + 1] - P_before[i + 1]) @ gain.T
    return mean, P


def _for_each_axis(small: Array, one: Array) -> Array:
    """Repeat matrices (4, 4, m) for independent axes: (m, 4 k, 4 k)."""
    size = 4 * len(one)
    return np.ascontiguousarray(np.einsum("abm,ij->maibj", small, one).reshape(-1, size, size))


def _period(time_s: Array) -> float:
    return float(np.median(np.diff(time_s)))
