"""The Kalman filter of a linear Gaussian model, and its smoother.

Source: Rauch, Tung and Striebel 1965, "Maximum likelihood estimates of linear dynamic systems".
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.kernels import kernel
from airborne.kernels.arrays import assign
from airborne.motion.smoothing.segments import finite_rows
from airborne.types import Array


class StateSpaceModel(NamedTuple):
    """A linear Gaussian model of n times: x' = F x + noise Q, z = H x + noise R; NaN rows of z are missing."""

    F: Array  # (n - 1, d, d)
    Q: Array  # (n - 1, d, d)
    H: Array  # (n, k, d)
    R: Array  # (n, k, k)
    mean: Array  # (d,) of the first state
    P: Array  # (d, d)


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
