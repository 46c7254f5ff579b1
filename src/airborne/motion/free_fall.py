"""Take-off and landing as the ends of free fall: likelihood of their times and of the parabola between them.

Arrays in, arrays out. In flight the height is a parabola of -9.81 m/s2; in contact the ground reaction force
curves it upward. The force is a Gaussian process, zero in flight: 20 +- 10 m/s2 above free fall, with a correlation
time of some 40 ms, fading at the event; integrated twice, it gives the height above the parabola.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from airborne.constants import GRAVITY_M_S2
from airborne.types import Array

SWAY_M, _SWAY_S = 0.005, 0.15  # of a centre of mass computed from the tracked joints alone, and its correlation time
_PUSH_M_S2, _PUSH_SD_M_S2 = 20.0, 10.0  # mean force of a push-off about three body weights, as force plates show
_PUSH_CHANGE_S, _PUSH_FADE_S = 0.04, 0.02  # time in which the force changes, and in which it ends at take-off
_LONGEST_CONTACT_S = 0.6  # contact before or after a flight that is modelled
_STEP_S = 1 / 1200  # of the integration


class CorrelatedNoise(NamedTuple):
    """A tracker's errors: part white, part an exponentially correlated (first-order Gauss-Markov) process."""

    white_share: float  # of the variance
    correlation_time_s: float  # of the remainder


GENERIC_NOISE = CorrelatedNoise(0.5, 0.1)  # of any joints, bodies, detections
# errors of the players' trackers change by 1 to 2 % of the variance from frame to frame at 60 fps, by 11 to 14 % over
# five frames, by 53 to 61 % over twenty: less white and longer-lived than this, which leaves room for noisier videos
PLAYER_NOISE = CorrelatedNoise(0.1, 0.3)


@dataclass(frozen=True, slots=True)
class SideLikelihood:
    """Likelihood of the parabola x (height, speed at the origin) from one side of a flight, per event time.

    In information form: log-likelihood = constant + information_vector' x - x' precision x / 2.
    """

    constant: Array  # (times,)
    information_vector: Array  # (times, 2)
    precision: Array  # (times, 2, 2)


def noise_covariance(
    time_s: Array, variance: Array, *, noise: CorrelatedNoise = PLAYER_NOISE, sway_m: float = 0.0
) -> Array:
    """Return covariances (..., n, n) of values tracked at times (..., n) with variances (..., n) under a noise model.

    `sway_m` [m] is the standard deviation of a further error, correlated over 0.15 s.
    """
    lag_s = np.abs(time_s[..., :, None] - time_s[..., None, :])
    sd = np.sqrt(variance)
    correlation = (1 - noise.white_share) * np.exp(-lag_s / noise.correlation_time_s) + noise.white_share * np.eye(
        time_s.shape[-1]
    )
    covariance = sd[..., :, None] * sd[..., None, :] * correlation
    return covariance + sway_m**2 * np.exp(-lag_s / _SWAY_S) if sway_m else covariance


def free_fall_height(time_s: Array) -> Array:
    """Return the height (n,) [m] of free fall from rest at height 0, time 0."""
    return -GRAVITY_M_S2 / 2 * time_s**2


def side_likelihood(
    time_s: Array, height_m: Array, covariance: Array, events_s: Array, *, is_takeoff: bool
) -> SideLikelihood:
    """Compute the parabola's likelihood from the heights on one side of a flight, per candidate event time.

    `time_s` (n,) and `events_s` (times,) are relative to the parabola's origin; heights (n,), covariance (n, n).
    """
    into_contact = (events_s[:, None] - time_s) if is_takeoff else (time_s - events_s[:, None])
    displacement, bases = _push_displacements(np.maximum(into_contact, 0.0))
    L = np.linalg.cholesky(covariance + _PUSH_SD_M_S2**2 * bases @ np.swapaxes(bases, -1, -2))
    line = np.broadcast_to(np.stack([np.ones_like(time_s), time_s], axis=-1), (len(events_s), len(time_s), 2))
    residual = (height_m - free_fall_height(time_s) - displacement)[..., None]
    white_line, white_residual = np.linalg.solve(L, line), np.linalg.solve(L, residual)
    log_det = 2 * np.log(np.diagonal(L, axis1=-2, axis2=-1)).sum(axis=-1)
    return SideLikelihood(
        constant=-0.5 * (log_det + (white_residual[..., 0] ** 2).sum(axis=-1)),
        information_vector=(np.swapaxes(white_line, -1, -2) @ white_residual)[..., 0],
        precision=np.swapaxes(white_line, -1, -2) @ white_line,
    )


def combine_sides(first: SideLikelihood, second: SideLikelihood) -> tuple[Array, Array, Array]:
    """Combine both sides: log-likelihood of (take-off, landing) (i, j), the parabola's mean (i, j, 2), covariance."""
    information_vector = first.information_vector[:, None] + second.information_vector
    precision = first.precision[:, None] + second.precision
    covariance = np.asarray(np.linalg.inv(precision), float)
    mean = (covariance @ information_vector[..., None])[..., 0]
    fit = 0.5 * (information_vector * mean).sum(axis=-1) - 0.5 * np.linalg.slogdet(precision)[1]
    return first.constant[:, None] + second.constant + fit, mean, covariance


def _push_displacements(into_contact_s: Array) -> tuple[Array, Array]:
    """Return the height that contact adds to free fall (...) [m]: its mean, and per unit basis force (..., k)."""
    grid = np.arange(0.0, _LONGEST_CONTACT_S, _STEP_S)
    fade = 1 - np.exp(-grid / _PUSH_FADE_S)
    centres = np.arange(0.0, _LONGEST_CONTACT_S, _PUSH_CHANGE_S)
    bumps = np.exp(-0.5 * ((grid - centres[:, None]) / _PUSH_CHANGE_S) ** 2)
    bumps /= np.sqrt((bumps**2).sum(axis=0).mean())  # the force then has the stated standard deviation
    paths = _integrate_twice(np.vstack([_PUSH_M_S2 * fade, fade * bumps]))
    at = np.minimum(into_contact_s, grid[-1])
    displacements = np.stack([np.interp(at, grid, path) for path in paths])
    return displacements[0], np.moveaxis(displacements[1:], 0, -1)


def _integrate_twice(force: Array) -> Array:
    for _ in range(2):
        trapezia = (force[..., 1:] + force[..., :-1]) / 2 * _STEP_S
        force = np.concatenate([np.zeros((len(force), 1)), np.cumsum(trapezia, axis=-1)], axis=-1)
    return force
