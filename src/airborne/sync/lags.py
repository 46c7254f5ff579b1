"""How late each camera is, from what its own pictures say of a body that all cameras track together.

Every camera's pictures say where the body was when they were taken. Over all frames the poses and the cameras' lags are
found together: a lag s moves the body in that camera's pictures by s times its velocity. Arrays only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.geometry.robust import covariance_of_sum

Array = NDArray[np.floating]

_TOGETHER = 2  # frames so near share their errors
_GAIN = 1.6  # a first step is about this much too short, as those of the poses are
_MOST_GAIN = 6.0
_MOST_PASSES = 8
_SETTLED_S = 2e-5
_SETTLED_SDS = 0.1


@dataclass(frozen=True, slots=True, eq=False)
class Sightings:
    """What the cameras say of a body tracked at n moments."""

    time_s: Array  # (n,)
    velocity: Array  # (n, 6) [m/s, rad/s]
    curvature: Array  # (n, c, 6, 6) of each camera's log-likelihood at the pose found together; zero: nothing seen
    slope: Array  # (n, c, 6)


@dataclass(frozen=True, slots=True, eq=False)
class Lags:
    """By how much each camera is later than its times say; the first one seen keeps its lag. NaN where unknown."""

    lag_s: Array  # (c,)
    sd_s: Array  # (c,)
    drift: Array  # (c,) [s/s]; the lag holds at time 0
    drift_sd: Array  # (c,)


def find_lags(look: Callable[[Array, Array], Sightings], lag_s: Array, *, with_drift: bool = False) -> Lags:
    """Track again and again, `look(lag_s, drift)`, with the lags (c,) found so far, until they stay.

    Steps of single passes are too short; how much too short shows from the second pass on, and widens the sds too.
    """
    n = len(lag_s)
    x = np.concatenate([lag_s, np.zeros(n)])
    gain = np.full(2 * n, _GAIN)
    last: tuple[Array, Array] | None = None
    for _ in range(_MOST_PASSES):
        step, sd = solve_lags(look(x[:n], x[n:]), with_drift=with_drift)
        step = np.nan_to_num(step)
        if last is not None:
            moved, change = x - last[0], last[1] - step
            with np.errstate(divide="ignore", invalid="ignore"):
                seen = np.where(np.abs(moved) > 3 * _SETTLED_S, moved / change, gain)
            gain = np.clip(np.where(np.isfinite(seen) & (seen > 0), seen, gain), 1.0, _MOST_GAIN)
        last = x, step
        x = x + gain * step
        if np.all(np.abs(step[:n]) < np.maximum(_SETTLED_S, _SETTLED_SDS * np.nan_to_num(sd[:n]))):
            break
    x, sd = np.where(np.isnan(sd), np.nan, x), gain * sd
    return Lags(x[:n], sd[:n], x[n:], sd[n:])


def solve_lags(seen: Sightings, *, with_drift: bool = False) -> tuple[Array, Array]:
    """Find the lags at time 0, then the drifts, by least squares, the poses' own corrections eliminated: (2 c,), sds.

    The sds are those of the sandwich of what single frames say, so that they hold however the pictures' noise is
    shared. NaN where a camera saw nothing move; drifts are zero without `with_drift`.
    """
    n, c = seen.slope.shape[:2]
    pull = np.einsum("kcij,kj->kci", seen.curvature, seen.velocity)
    together = np.linalg.pinv(seen.curvature.sum(axis=1), hermitian=True)
    own = np.einsum("kci,ki->kc", pull, seen.velocity)[:, :, None] * np.eye(c)
    H = own - np.einsum("kci,kij,kdj->kcd", pull, together, pull)
    r = np.einsum("kci,ki->kc", seen.slope, seen.velocity)
    r = r - np.einsum("kci,kij,kj->kc", pull, together, seen.slope.sum(axis=1))
    basis = np.stack([np.ones(n), seen.time_s], axis=1)[:, : 2 if with_drift else 1]
    m = basis.shape[1]
    H = np.einsum("kcd,ka,kb->kacbd", H, basis, basis).reshape(n, m * c, m * c)
    r = np.einsum("kc,ka->kac", r, basis).reshape(n, m * c)
    is_seen = np.diag(H.sum(axis=0)) > 0
    is_free = np.tile(np.arange(c) != np.argmax(is_seen[:c]), m)
    index = np.flatnonzero(is_free & is_seen)
    inverse = np.linalg.inv(H.sum(axis=0)[np.ix_(index, index)])
    found = inverse @ r.sum(axis=0)[index]
    left = r[:, index] - H[:, index][:, :, index] @ found
    step, sd = np.zeros(2 * c), np.zeros(2 * c)
    unseen = np.flatnonzero(is_free & ~is_seen)
    step[unseen] = sd[unseen] = np.nan
    covariance = inverse @ covariance_of_sum(left, _TOGETHER) @ inverse
    step[index], sd[index] = found, np.sqrt(np.maximum(np.diag(covariance), 0))
    return step, sd
