"""When a path leaves free fall: the likelihood of take-off and landing times, and of the parabola between them.

Arrays in, arrays out. In flight the height is a parabola of -9.81 m/s2; in contact the floor pushes, so that it bends
away upward. How it bends is left open: a push of 20 +- 10 m/s2 above free fall that changes within some 40 ms and dies
away at the event, integrated twice, is a Gaussian process that is zero in flight.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

GRAVITY_M_S2 = 9.81
SWAY_M, SWAY_S = 0.005, 0.15  # of a centre of mass that is made of the tracked joints alone, and how long it lasts
_PUSH_M_S2, _PUSH_SD_M_S2 = 20.0, 10.0  # mean force of a push-off about three body weights, as force plates show
_PUSH_CHANGE_S, _PUSH_FADE_S = 0.04, 0.02
_LONGEST_CONTACT_S = 0.6
_STEP_S = 1 / 1200


class Noise(NamedTuple):
    """How a tracker errs: trackers err alike in frames near by."""

    white_share: float  # of the variance
    fading_s: float  # time over which the rest fades


OF_ANYTHING = Noise(0.5, 0.1)  # joints, bodies, detections from anywhere
# trackers of players change their errors by 1 to 2 % of the variance in a frame at 60 a second, by 11 to 14 % in five,
# by 53 to 61 % in twenty: less white than this, and lasting longer; there is room for videos that jitter more
OF_PLAYERS = Noise(0.1, 0.3)


@dataclass(frozen=True, slots=True)
class Side:
    """What one side of a flight says of the parabola (height, speed at the origin) for each time of its event.

    In information form: log-likelihood = constant + information' x - x' precision x / 2.
    """

    constant: Array  # (times,)
    information: Array  # (times, 2)
    precision: Array  # (times, 2, 2)


def noise_covariance(time_s: Array, variance: Array, *, noise: Noise = OF_PLAYERS, sway_m: float = 0.0) -> Array:
    """Return covariances (..., n, n) of values tracked at times (..., n), of variances (..., n), as `noise` says.

    `sway_m` adds an error common to neighbouring times, of what the values stand for.
    """
    apart = np.abs(time_s[..., :, None] - time_s[..., None, :])
    sd = np.sqrt(variance)
    alike = (1 - noise.white_share) * np.exp(-apart / noise.fading_s) + noise.white_share * np.eye(time_s.shape[-1])
    found = sd[..., :, None] * sd[..., None, :] * alike
    return found + sway_m**2 * np.exp(-apart / SWAY_S) if sway_m else found


def fallen(time_s: Array) -> Array:
    """Return the height (n,) [m] that free fall takes from a body at rest at time 0."""
    return -GRAVITY_M_S2 / 2 * time_s**2


def side(time_s: Array, height_m: Array, covariance: Array, events_s: Array, *, is_takeoff: bool) -> Side:
    """Weigh the parabola against the heights on one side of a flight, for every candidate time of its event.

    `time_s` (n,) and `events_s` (times,) count from the parabola's origin; heights (n,) and their covariance (n, n).
    """
    into_contact = (events_s[:, None] - time_s) if is_takeoff else (time_s - events_s[:, None])
    bend, bases = _pushes(np.maximum(into_contact, 0.0))
    L = np.linalg.cholesky(covariance + _PUSH_SD_M_S2**2 * bases @ np.swapaxes(bases, -1, -2))
    line = np.broadcast_to(np.stack([np.ones_like(time_s), time_s], axis=-1), (len(events_s), len(time_s), 2))
    rest = (height_m - fallen(time_s) - bend)[..., None]
    white_line, white_rest = np.linalg.solve(L, line), np.linalg.solve(L, rest)
    log_det = 2 * np.log(np.diagonal(L, axis1=-2, axis2=-1)).sum(axis=-1)
    return Side(
        constant=-0.5 * (log_det + (white_rest[..., 0] ** 2).sum(axis=-1)),
        information=(np.swapaxes(white_line, -1, -2) @ white_rest)[..., 0],
        precision=np.swapaxes(white_line, -1, -2) @ white_line,
    )


def joined(first: Side, second: Side) -> tuple[Array, Array, Array]:
    """Join both sides: log-likelihood of (take-off, landing) (i, j), the parabola's mean (i, j, 2), covariance."""
    information = first.information[:, None] + second.information
    precision = first.precision[:, None] + second.precision
    covariance = np.linalg.inv(precision)
    mean = (covariance @ information[..., None])[..., 0]
    fit = 0.5 * (information * mean).sum(axis=-1) - 0.5 * np.linalg.slogdet(precision)[1]
    return first.constant[:, None] + second.constant + fit, mean, covariance


def _pushes(into_contact_s: Array) -> tuple[Array, Array]:
    """Return how far contact bends the path up (...) [m], on the mean and by each unit of its bases (..., k)."""
    grid = np.arange(0.0, _LONGEST_CONTACT_S, _STEP_S)
    fade = 1 - np.exp(-grid / _PUSH_FADE_S)
    centres = np.arange(0.0, _LONGEST_CONTACT_S, _PUSH_CHANGE_S)
    bumps = np.exp(-0.5 * ((grid - centres[:, None]) / _PUSH_CHANGE_S) ** 2)
    bumps /= np.sqrt((bumps**2).sum(axis=0).mean())  # the push then has the stated deviation
    paths = _twice_integrated(np.vstack([_PUSH_M_S2 * fade, fade * bumps]))
    at = np.minimum(into_contact_s, grid[-1])
    found = np.stack([np.interp(at, grid, path) for path in paths])
    return found[0], np.moveaxis(found[1:], 0, -1)


def _twice_integrated(force: Array) -> Array:
    for _ in range(2):
        trapezia = (force[..., 1:] + force[..., :-1]) / 2 * _STEP_S
        force = np.concatenate([np.zeros((len(force), 1)), np.cumsum(trapezia, axis=-1)], axis=-1)
    return force
