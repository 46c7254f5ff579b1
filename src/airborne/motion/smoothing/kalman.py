"""The Kalman smoother with the tracker's own covariances: a path of white jerk, its strength by maximum likelihood.

Each path obeys d3x/dt3 = white noise of density q, alike on its axes. A measurement is the path plus the tracker's
error; half of its covariance is white and half fades over 0.1 s, as `motion.contact.OF_ANYTHING` has it, the
latter as a state of its own. Source: Rauch, Tung and Striebel 1965, "Maximum likelihood estimates of linear dynamic
systems"; Bar-Shalom, Li and Kirubarajan, "Estimation with Applications to Tracking and Navigation", section 6.2 (the
discrete noise of a continuous white jerk). With white noise alone the result is the fifth-order smoothing spline.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from airborne.kernels import kernel
from airborne.motion.free_fall import OF_ANYTHING
from airborne.motion.smoothing.segments import Smoothed, known_rows

Array = NDArray[np.floating]

PRIOR_SD = (10.0, 30.0, 300.0)  # of value, velocity, acceleration at the first frame, a unit a second: nearly nothing
_LOG_DENSITY = (-6.0, 9.0)  # powers of ten of q [unit2/s5] that are tried
_LOG_STEP = 0.02
_UNSEEN_SD = 10.0  # of a direction with an infinite variance
_LEAST_VARIANCE = 1e-12


class Steps(NamedTuple):
    """A linear Gaussian model of n times: x' = F x + noise Q, z = H x + noise R; NaN rows of z are not measured."""

    F: Array  # (n - 1, d, d)
    Q: Array  # (n - 1, d, d)
    H: Array  # (n, k, d)
    R: Array  # (n, k, k)
    mean: Array  # (d,) of the first state
    P: Array  # (d, d)


def kalman(time_s: Array, values: Array, covariance: Array) -> Smoothed:
    """Smooth one stretch (n, k) with the Kalman smoother; see `Smoother`.

    A row whose covariance is unknown counts as not measured; an infinite variance as 10 units. NaN where no covariance
    is known. Missing rows are predicted from both sides, with the deviations that this leaves.
    """
    noise = noise_of(covariance)
    is_measured = known_rows(values) & known_rows(noise.root.reshape(len(values), -1))
    if is_measured.sum() < 3:
        return Smoothed.unknown(values.shape)
    values = np.where(is_measured[:, None], values, np.nan)
    noise = noise._replace(root=np.where(is_measured[:, None, None], noise.root, np.eye(values.shape[1])))
    density = likeliest_density(time_s, values, noise)
    mean, P = rts(steps_of(time_s, values, noise, density), values)
    n, k = values.shape
    period = _period(time_s)
    scale = period ** -np.arange(3)
    value = mean[:, : 3 * k].reshape(n, 3, k) * scale[:, None]
    variance = np.diagonal(P, axis1=1, axis2=2)[:, : 3 * k].reshape(n, 3, k)
    sd = np.sqrt(np.maximum(variance, 0.0)) * scale[:, None]
    return Smoothed(value[:, 0], value[:, 1], value[:, 2], sd[:, 0], sd[:, 1], sd[:, 2])


class Noise(NamedTuple):
    """What a tracker states of its errors; NaN where unknown."""

    root: Array  # (n, k, k) symmetric root of the covariance, infinite variances left out
    unseen: Array  # (n, k) variance of the directions that nothing shows, else 0


def noise_of(covariance: Array) -> Noise:
    """Split covariances (n, k, k) into what is known and what nothing shows; rounding may not make them negative."""
    is_unseen = np.isinf(np.diagonal(covariance, axis1=1, axis2=2))
    shown = np.where(is_unseen[:, :, None] | is_unseen[:, None, :], 0.0, covariance)
    is_known = known_rows(shown.reshape(len(shown), -1))
    root = np.full(shown.shape, np.nan)
    squares, axes = np.linalg.eigh(shown[is_known])
    root[is_known] = np.einsum("nij,nj,nkj->nik", axes, np.sqrt(np.maximum(squares, _LEAST_VARIANCE)), axes)
    return Noise(root, np.where(is_unseen, _UNSEEN_SD**2, 0.0))


def likeliest_density(time_s: Array, values: Array, noise: Noise) -> float:
    """Return the density q of the white jerk [unit2/s5] under which the measurements are likeliest."""

    def cost(log_density: float) -> float:
        return -filtered(steps_of(time_s, values, noise, 10.0**log_density), values)[-1]

    found = minimize_scalar(cost, bounds=_LOG_DENSITY, method="bounded", options={"xatol": _LOG_STEP})
    return float(10.0**found.x)


def steps_of(time_s: Array, values: Array, noise: Noise, density: float) -> Steps:
    """Build the model of one stretch: states are value, velocity and acceleration in units of the period, and the
    fading part of the error in units of its deviation, (4 k,).
    """  # noqa: D205
    k = values.shape[1]
    period = _period(time_s)
    step = np.diff(time_s)
    one = np.eye(k)
    T = step / period
    fade = np.exp(-step / OF_ANYTHING.fading_s)
    zero, unit = np.zeros_like(T), np.ones_like(T)
    move = np.array(
        [[unit, T, T**2 / 2, zero], [zero, unit, T, zero], [zero, zero, unit, zero], [zero, zero, zero, fade]]
    )
    jerk = density * period**5
    growth = np.array(
        [
            [jerk * T**5 / 20, jerk * T**4 / 8, jerk * T**3 / 6, zero],
            [jerk * T**4 / 8, jerk * T**3 / 3, jerk * T**2 / 2, zero],
            [jerk * T**3 / 6, jerk * T**2 / 2, jerk * T, zero],
            [zero, zero, zero, 1 - fade**2],
        ]
    )
    nothing = np.zeros((len(values), k, 2 * k))
    fading = np.sqrt(1 - OF_ANYTHING.white_share) * noise.root
    seen = np.concatenate([np.broadcast_to(one, fading.shape), nothing, fading], axis=2)
    white = OF_ANYTHING.white_share * noise.root @ noise.root + noise.unseen[:, :, None] * one
    first = values[np.flatnonzero(np.isfinite(values).all(axis=1))[0]]
    spread = np.square([PRIOR_SD[0], PRIOR_SD[1] * period, PRIOR_SD[2] * period**2, 1.0])
    return Steps(
        F=_for_each_axis(move, one),
        Q=_for_each_axis(growth, one),
        H=seen,
        R=white,
        mean=np.concatenate([first, np.zeros(3 * k)]),
        P=np.kron(np.diag(spread), one),
    )


def filtered(steps: Steps, values: Array) -> tuple[Array, Array, Array, Array, float]:
    """Run the Kalman filter: predicted means (n, d) and covariances, filtered ones, log-likelihood [nat].

    Measurements are whitened first, so that each number of a row can be taken in alone.
    """
    root = np.linalg.cholesky(steps.R)
    seen = np.linalg.solve(root, steps.H)
    white = np.linalg.solve(root, values[..., None])[..., 0]
    is_measured = known_rows(values)
    passes = _filtered(steps.F, steps.Q, seen, white, is_measured, steps.mean, steps.P)
    scale = np.log(np.diagonal(root, axis1=1, axis2=2)[is_measured]).sum()
    return *passes[:4], float(passes[4] - scale)


@kernel
def _filtered(
    F: Array, Q: Array, H: Array, z: Array, is_measured: NDArray[np.bool_], mean: Array, P: Array
) -> tuple[Array, Array, Array, Array, float]:
    n, k, d = H.shape
    before, after = np.empty((n, d)), np.empty((n, d))
    P_before, P_after = np.empty((n, d, d)), np.empty((n, d, d))
    mean, P, Ph, log_likelihood = mean.copy(), P.copy(), np.empty(d), 0.0
    for i in range(n):
        if i:
            mean = _moved_mean(F[i - 1], mean)
            P = _moved(F[i - 1], P, Q[i - 1])
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
def _moved_mean(F: Array, mean: Array) -> Array:
    found = np.zeros_like(mean)
    for a in range(len(mean)):
        for b in range(len(mean)):
            found[a] += F[a, b] * mean[b]
    return found


@kernel
def _moved(F: Array, P: Array, Q: Array) -> Array:
    """Return F P F' + Q."""
    d = len(P)
    half, found = np.zeros_like(P), Q.copy()
    for a in range(d):
        for b in range(d):
            if F[a, b] != 0.0:
                for c in range(d):
                    half[a, c] += F[a, b] * P[b, c]
    for a in range(d):
        for b in range(d):
            if F[a, b] != 0.0:
                for c in range(d):
                    found[c, a] += half[c, b] * F[a, b]
    return found


def rts(steps: Steps, values: Array) -> tuple[Array, Array]:
    """Run the filter forward and Rauch, Tung and Striebel's smoother back: means (n, d), covariances (n, d, d)."""
    before, P_before, mean, P, _ = filtered(steps, values)
    for i in range(len(values) - 2, -1, -1):
        gain = np.linalg.solve(P_before[i + 1], steps.F[i] @ P[i]).T
        mean[i] += gain @ (mean[i + 1] - before[i + 1])
        P[i] += gain @ (P[i + 1] - P_before[i + 1]) @ gain.T
    return mean, P


def _for_each_axis(small: Array, one: Array) -> Array:
    """Spread matrices (4, 4, m) over independent axes: (m, 4 k, 4 k)."""
    size = 4 * len(one)
    return np.ascontiguousarray(np.einsum("abm,ij->maibj", small, one).reshape(-1, size, size))


def _period(time_s: Array) -> float:
    return float(np.median(np.diff(time_s)))
