"""The lag of each camera, from the normal equations of its own images for a body that all cameras track together.

Every camera's images locate the body at the moment they were taken. Over all frames, poses and lags are estimated
jointly: a lag s moves the body in that camera's images by s times its velocity. Arrays only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from airborne.geometry.robust import covariance_of_sum
from airborne.types import Array

_N_CORRELATED = 2  # neighbouring frames whose errors are correlated
_GAIN = 1.6  # a first step is too short by about this factor, as those of the poses are
_MOST_GAIN = 6.0  # on a step, however nearly parallel the steps before
_MOST_PASSES = 8  # over the recording
_CONVERGED_S = 2e-5  # a step below it, or below ...
_CONVERGED_SDS = 0.1  # ... this share of the lag's sd, ends the iteration


@dataclass(frozen=True, slots=True, eq=False)
class LagEquations:
    """Each camera's own normal equations for the pose, at n moments of a tracked body."""

    time_s: Array  # (n,)
    velocity: Array  # (n, 6) [m/s, rad/s]
    information: Array  # (n, c, 6, 6) of each camera's log-likelihood at the joint pose; zero where it sees nothing
    gradient: Array  # (n, c, 6)


@dataclass(frozen=True, slots=True, eq=False)
class CameraLags:
    """How much later than its time stamps each camera is; the first that sees the body keeps its lag. NaN: unknown."""

    lag_s: Array  # (c,)
    sd_s: Array  # (c,)
    drift: Array  # (c,) [s/s]; the lag holds at time 0
    drift_sd: Array  # (c,)


def find_lags(measure: Callable[[Array, Array], LagEquations], lag_s: Array, *, with_drift: bool = False) -> CameraLags:
    """Iterate `measure(lag_s, drift)`, tracking with the current lags (c,), to convergence.

    The step of a single pass is too short; from the second pass on, the steps show by what factor (secant), which
    widens the sds too.
    """
    n = len(lag_s)
    x = np.concatenate([lag_s, np.zeros(n)])
    gain = np.full(2 * n, _GAIN)
    last: tuple[Array, Array] | None = None
    for _ in range(_MOST_PASSES):
        step, sd = solve_lags(measure(x[:n], x[n:]), with_drift=with_drift)
        step = np.nan_to_num(step)
        if last is not None:
            gain = _secant_gain(x - last[0], last[1] - step, gain)
        last = x, step
        x = x + gain * step
        if np.all(np.abs(step[:n]) < np.maximum(_CONVERGED_S, _CONVERGED_SDS * np.nan_to_num(sd[:n]))):
            break
    x, sd = np.where(np.isnan(sd), np.nan, x), gain * sd
    return CameraLags(x[:n], sd[:n], x[n:], sd[n:])


def _secant_gain(taken: Array, change: Array, gain: Array) -> Array:
    """Return by what factor each step is too short: what was taken by how much it changed the next one, else `gain`."""
    with np.errstate(divide="ignore", invalid="ignore"):
        secant = np.where(np.abs(taken) > 3 * _CONVERGED_S, taken / change, gain)
    return np.clip(np.where(np.isfinite(secant) & (secant > 0), secant, gain), 1.0, _MOST_GAIN)


def solve_lags(equations: LagEquations, *, with_drift: bool = False) -> tuple[Array, Array]:
    """Find the lags at time 0, then the drifts, by least squares with the poses' corrections eliminated: (2 c,), sds.

    The sds are those of the sandwich of the frames' own scores, so that they hold however the images' noise is
    correlated. NaN where a camera saw no motion; drifts are zero without `with_drift`.
    """
    n, c = equations.gradient.shape[:2]
    coupling = np.einsum("kcij,kj->kci", equations.information, equations.velocity)
    pose_covariance = np.linalg.pinv(equations.information.sum(axis=1), hermitian=True)
    own = np.einsum("kci,ki->kc", coupling, equations.velocity)[:, :, None] * np.eye(c)
    H = own - np.einsum("kci,kij,kdj->kcd", coupling, pose_covariance, coupling)
    r = np.einsum("kci,ki->kc", equations.gradient, equations.velocity)
    r = r - np.einsum("kci,kij,kj->kc", coupling, pose_covariance, equations.gradient.sum(axis=1))
    basis = np.stack([np.ones(n), equations.time_s], axis=1)[:, : 2 if with_drift else 1]
    m = basis.shape[1]
    H = np.einsum("kcd,ka,kb->kacbd", H, basis, basis).reshape(n, m * c, m * c)
    r = np.einsum("kc,ka->kac", r, basis).reshape(n, m * c)
    is_seen = np.diag(H.sum(axis=0)) > 0
    is_free = np.tile(np.arange(c) != np.argmax(is_seen[:c]), m)
    index = np.flatnonzero(is_free & is_seen)
    inverse = np.linalg.inv(H.sum(axis=0)[np.ix_(index, index)])
    solution = inverse @ r.sum(axis=0)[index]
    scores = r[:, index] - H[:, index][:, :, index] @ solution
    step, sd = np.zeros(2 * c), np.zeros(2 * c)
    unseen = np.flatnonzero(is_free & ~is_seen)
    step[unseen] = sd[unseen] = np.nan
    covariance = inverse @ covariance_of_sum(scores, _N_CORRELATED) @ inverse
    step[index], sd[index] = solution, np.sqrt(np.maximum(np.diag(covariance), 0))
    return step, sd
