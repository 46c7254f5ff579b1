"""Free fall of a path: where it is, and what it tells of a spinning body's centre of mass. Arrays in, arrays out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.constants import GRAVITY_M_S2
from airborne.motion.free_fall import GENERIC_NOISE, noise_covariance
from airborne.types import Array

_WINDOW_S = 0.16  # of the parabolas that measure the acceleration
_FREE_M_S2, _MOST_M_S2 = 2.5, 5.5  # deviation from free fall: of any flight, and with noise
UNKNOWN_SD_M = 0.02  # of a height without a covariance
SUPPORTED_M_S2 = -5.0  # a body that falls clearly slower is supported
_MOST_OFF_M_S2 = 1.0  # of a fall's gravity: five times the sd of the worst of eleven synthetic people's
SPAN_S, FEWEST_OF_SPAN = 0.4, 8  # of a flight from which the centre of mass is found; frames in it
# sd of a person's centre of mass in the root's frame, along each axis: of 10, 15 and 20 mm the best on eleven
# synthetic people, lengths 4 % and girths 12 % off
_OFFSET_SD_M = 0.01
_LEAST_NOISE_M = 1e-4  # of a path; an exact one would leave the prior no weight
_ROUNDS = 4  # of estimating the noise
_MOST_CORRELATED = 0.99  # of consecutive residuals: more would leave less than one of 200 independent


class Fall(NamedTuple):
    """A path's free fall, and by what its centre of mass lies beside it, fixed to the body."""

    offset_m: Array  # (3,) body's frame
    offset_covariance: Array  # (3, 3)
    gravity_m_s2: float
    gravity_sd_m_s2: float

    @property
    def is_free(self) -> bool:
        """Whether it falls as bodies do in flight."""
        return abs(self.gravity_m_s2 - GRAVITY_M_S2) < _MOST_OFF_M_S2


def fit_fall(time_s: Array, path: Array, R: Array) -> Fall:
    """Fit path + R offset = start + speed t - gravity t2 / 2, upward; path (n, 3) [m], R (n, 3, 3), n of 4 or more.

    A fit by least squares, the offset's sd 10 mm beforehand. The residuals are taken for a first-order autoregressive
    process (Bartlett 1935): where each is r times the one before, n of them say as much as n (1 - r) / (1 + r)
    independent ones. They tell the noise; of gravity, those of the heights alone, too.
    """
    t, n = time_s - time_s.mean(), len(time_s)
    line = np.kron(np.stack([np.ones(n), t], axis=1), np.eye(3))
    falls = np.kron(-(t**2) / 2, [0.0, 0.0, 1.0])[:, None]
    design = np.hstack([line, falls, -R.reshape(-1, 3)])
    target, noise = np.concatenate([path.ravel(), np.zeros(3)]), _OFFSET_SD_M
    for _ in range(_ROUNDS):
        prior = np.hstack([np.zeros((3, 7)), noise / _OFFSET_SD_M * np.eye(3)])
        terms = np.vstack([design, prior])
        solution = np.linalg.lstsq(terms, target, rcond=None)[0]
        residual = (path.ravel() - design @ solution).reshape(-1, 3)
        noise = max(_noise(residual, 3 * n - 7), _LEAST_NOISE_M)
    inverse = np.linalg.inv(terms.T @ terms)
    gravity_sd = max(_noise(residual[:, 2:], n - 3), noise) * np.sqrt(inverse[6, 6])
    return Fall(solution[7:], noise**2 * inverse[7:, 7:], float(solution[6]), float(gravity_sd))


def _noise(residual: Array, freedom: int) -> float:
    """Return the sd that independent residuals would have which say as much as these (n, axes)."""
    squares = float(np.sum(residual**2))
    r = float(np.clip(np.sum(residual[1:] * residual[:-1]) / max(squares, 1e-30), 0, _MOST_CORRELATED))
    return float(np.sqrt(squares / freedom * (1 + r) / (1 - r)))


def flight_rows(time_s: Array, height_m: Array, variance: Array) -> NDArray[np.intp]:
    """Return the longest run of rows in which a path's heights (n,) [m] do not clearly fall slower than in flight.

    None where it is shorter than 0.4 s.
    """
    acceleration, sd = local_accelerations(time_s, height_m, variance)
    rows = np.flatnonzero(~(acceleration - 2 * sd > SUPPORTED_M_S2))
    runs = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
    longest = max(runs, key=len)
    is_enough = len(longest) >= FEWEST_OF_SPAN and np.ptp(time_s[longest]) >= 0.9 * SPAN_S
    return longest if is_enough else longest[:0]


def is_free_fall(acceleration: Array, sd: Array) -> NDArray[np.bool_]:
    """Whether accelerations [m/s2] with these sds may be those of free fall."""
    return np.abs(acceleration + GRAVITY_M_S2) <= np.minimum(_FREE_M_S2 + 2 * sd, _MOST_M_S2)


def local_accelerations(time_s: Array, height_m: Array, variance: Array) -> tuple[Array, Array]:
    """Return the acceleration of the best parabola about each time [m/s2] and its sd; NaN near ends and gaps."""
    acceleration, sd = np.full((2, len(time_s)), np.nan)
    period = float(np.median(np.diff(time_s)))
    for k, at in enumerate(time_s):
        rows = np.flatnonzero(np.abs(time_s - at) <= _WINDOW_S / 2 + 1e-9)
        u = time_s[rows] - at
        if len(rows) < 5 or u[0] > -_WINDOW_S / 2 + period or u[-1] < _WINDOW_S / 2 - period:
            continue
        hat = np.linalg.pinv(np.vander(u, 3))[0]
        acceleration[k] = 2 * hat @ height_m[rows]
        sd[k] = 2 * np.sqrt(hat @ noise_covariance(u, variance[rows], noise=GENERIC_NOISE) @ hat)
    return acceleration, sd
