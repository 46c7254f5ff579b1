"""How late each camera is, from the normal equations of its own images for a body that all cameras track together.

Every camera's images locate the body at the moment they were taken. Over all frames, poses and lags are estimated
jointly: a lag s moves the body in that camera's images by s times its velocity. Arrays only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airborne.geometry.robust import covariance_of_sum
from airborne.types import Array


@dataclass(frozen=True, slots=True, eq=False)
class LagEquations:
    """Each camera's own normal equations for the pose, at n moments of a tracked body."""

    time_s: Array  # (n,)
    velocity: Array  # (n, d) of the pose [m/s, rad/s]
    information: Array  # (n, c, d, d) of each camera's log-likelihood at the joint pose; zero where it sees nothing
    gradient: Array  # (n, c, d)
    prior: Array | float = 0.0  # (d, d) information about the pose that no camera gives
    n_correlated: int = 2  # neighbouring frames whose errors are correlated
    is_noise_known: bool = False  # the information is that of the noise, which counts beside the frames' scatter


def solve_lags(equations: LagEquations, *, with_drift: bool = False) -> tuple[Array, Array]:
    """Find the lags at time 0, then the drifts, by least squares with the poses' corrections eliminated: (2 c,), sds.

    The sds are those of the sandwich of the frames' own scores, so that they hold however the images' noise is
    correlated. NaN where a camera saw no motion; drifts are zero without `with_drift`.
    """
    n, c = equations.gradient.shape[:2]
    coupling = np.einsum("kcij,kj->kci", equations.information, equations.velocity)
    pose_covariance = np.linalg.pinv(equations.information.sum(axis=1) + equations.prior, hermitian=True)
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
    covariance = inverse @ covariance_of_sum(scores, equations.n_correlated) @ inverse
    if equations.is_noise_known:
        covariance = covariance + inverse
    step[index], sd[index] = solution, np.sqrt(np.maximum(np.diag(covariance), 0))
    return step, sd
