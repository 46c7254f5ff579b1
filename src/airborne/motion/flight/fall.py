"""Free fall of a path: where it is, and what it tells of a spinning body's centre of mass. Arrays in, arrays out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.constants import ALARM_SDS, GRAVITY_M_S2
from airborne.motion.free_fall import GENERIC_NOISE, noise_covariance
from airborne.tracking.self_check.free_flight import WrongFall
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
# shares of gravity, chosen: a synthetic person's worlds 10 % too large and too small left 0.06 to 0.10, the right one
# 0.004; half of it is no fall
_LEAST_WRONG, _MOST_WRONG = 0.03, 0.5
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
        solution = np.asarray(np.linalg.lstsq(terms, target, rcond=None)[0], float)
        residual = (path.ravel() - design @ solution).reshape(-1, 3)
        noise = max(_noise(residual, 3 * n - 7), _LEAST_NOISE_M)
    inverse = np.asarray(np.linalg.inv(terms.T @ terms), float)
    gravity_sd = max(_noise(residual[:, 2:], n - 3), noise) * np.sqrt(inverse[6, 6])
    return Fall(solution[7:], noise**2 * inverse[7:, 7:], float(solution[6]), float(gravity_sd))


def gravity_deviation(fall: Fall, time_s: Array) -> float:
    """Return the sd of a fall's gravity over times (n,) [m/s2] with that of how the centre of mass wanders in the body.

    As the body bends, whose masses are not quite the person's, by as much as it lies beside its place: a parabola of
    duration T sags by g T^2 / 8.
    """
    return float(np.hypot(fall.gravity_sd_m_s2, 8 * _OFFSET_SD_M / np.ptp(time_s) ** 2))


def find_wrong_fall(time_s: Array, path: Array, R: Array, variance: Array) -> WrongFall | None:
    """Find what a flight's gravity tells of wrong lengths or a wrong frame rate; None where it is 9.81 m/s2.

    path (n, 3) [m] of the centre of mass, R (n, 3, 3) world from root, variance (n,) of the heights.
    """
    rows = flight_rows(time_s, path[:, 2], variance)
    if len(rows):  # parabolas about the frames beside a stance hold some of it
        first, last = (time_s[row] for row in rows[[0, -1]])
        begins = first + (_WINDOW_S / 2 if rows[0] > 0 else 0)
        ends = last - (_WINDOW_S / 2 if rows[-1] < len(time_s) - 1 else 0)
        rows = rows[(time_s[rows] >= begins) & (time_s[rows] <= ends)]
    if len(rows) < FEWEST_OF_SPAN:
        return None
    fall = fit_fall(time_s[rows], path[rows], R[rows])
    sd_m_s2 = gravity_deviation(fall, time_s[rows])
    off = fall.gravity_m_s2 / GRAVITY_M_S2 - 1
    if not max(ALARM_SDS * sd_m_s2 / GRAVITY_M_S2, _LEAST_WRONG) < abs(off) < _MOST_WRONG:
        return None
    large, high = ("large", "high") if off > 0 else ("small", "low")
    of_rate = abs(np.sqrt(1 + off) - 1)
    return WrongFall(
        fall.gravity_m_s2,
        sd_m_s2,
        f"in flight the centre of mass falls at {fall.gravity_m_s2:.2f} ± {sd_m_s2:.2f} m/s², not at "
        f"{GRAVITY_M_S2:.2f}: the calibration's lengths are too {large}, by {100 * abs(off):.0f} % or more, or the "
        f"stated frame rate is too {high}, by {100 * of_rate:.0f} % or more",
    )


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


def may_fall(time_s: Array, height_m: Array, variance: Array) -> bool:
    """Whether heights (n,) [m] somewhere fall as fast as in flight, or none of their accelerations is known."""
    acceleration, sd = local_accelerations(time_s, height_m, variance)
    is_fast = is_free_fall(acceleration, sd) | (acceleration < -GRAVITY_M_S2)
    return bool(is_fast.any() or not np.isfinite(acceleration).any())


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
