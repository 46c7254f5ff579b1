"""The fall of a body in free flight as a measurement of the world's size and axes: 9.81 m/s2, downward."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from airborne.constants import GRAVITY_M_S2
from airborne.tracking.self_check.path import alarm
from airborne.types import Array

_LEAST_MOMENTS, _LEAST_S = 7, 0.25  # of a flight that is measured
_MOST_RMS_M = 0.008  # about the parabola: more is no free flight, or not of the centre of mass
_LEAST_NOISE_M = 0.001  # chosen on three synthetic throws seen by one camera: noise beside the stated deviation
_MOST_TILT = 0.15  # horizontal acceleration, as a share of the vertical one
_LEAST_M_S2, _MOST_M_S2 = 6.0, 15.0  # a fall that a wrong scale can explain
# chosen: a fall that a wrong frame rate explains, a fifth to five times the right one
_SLOWEST_M_S2, _FASTEST_M_S2 = GRAVITY_M_S2 / 5**2, GRAVITY_M_S2 * 5**2
# chosen: of a long fall, as hands lead a thing on a short parabola, too: how far the path departs from its chord, as in
# free fall of 0.5 s; no wrong frame rate changes it
_LONG_M = GRAVITY_M_S2 * 0.5**2 / 8
_MOST_OFF = 0.1  # chosen: from gravity's size, of a fall in a wrong direction; a hand hardly leads a thing so
# chosen: of its direction from straight down, from which on it is said, also in standard deviations; of 19 throws with
# right files it was 0.3 degrees at most, of 14 with points or clocks wrong 2.0, at 1.4 of them
_LEAST_TILTED, _TILTED_SDS = np.radians(2.5), 4.0
_LEAST_SD_M_S2 = 0.03  # air, and a centre of mass that is not quite where it is taken to be


class WrongFall(NamedTuple):
    """A flight at another acceleration than gravity's: something in the files must be wrong."""

    gravity_m_s2: float
    gravity_sd_m_s2: float
    sentence: str

    def to_dict(self) -> dict[str, Any]:
        """Return what `self_check` in summary.json holds: an alarm, its value above 9.81 m/s2."""
        value, sd = self.gravity_m_s2 - GRAVITY_M_S2, self.gravity_sd_m_s2
        return alarm("fall", "gravity_m_s2", value=value, sd=sd, sentence=self.sentence)


class _Parabola(NamedTuple):
    """A path of constant acceleration, as bodies fly."""

    weights: Array  # (3 n,) of the positions in the vertical acceleration
    acceleration: Array  # (3,) [m/s2]
    sd_m_s2: float  # of the vertical one, by the residuals

    @property
    def is_vertical(self) -> bool:
        """Whether it falls along the world's z axis, downward."""
        return self.tilt < np.arctan(_MOST_TILT)

    @property
    def tilt(self) -> float:
        """How far its direction is from straight down [rad]."""
        x, y, z = self.acceleration
        return float(np.arctan2(np.hypot(x, y), -z))


def fall(time_s: Array, position: Array, R: Array, covariance: Array) -> tuple[Array, float, float] | None:
    """Measure the vertical acceleration of a body that turns freely; None where it is not in free flight.

    time_s (n,), root's position (n, 3) [m], R (n, 3, 3) world from root, covariance (n, 3, 3) of the positions [m2], as
    one camera hardly sees how far away a body is. The centre of mass is fixed in the root, in an unknown place. Returns
    the weights (3 n,) of the positions in the acceleration, it itself and its sd [m/s2].
    """
    found = _parabola(time_s, position, R, covariance)
    if found is None or not found.is_vertical or not _LEAST_M_S2 < -found.acceleration[2] < _MOST_M_S2:
        return None
    return found.weights, float(found.acceleration[2]), float(np.hypot(_LEAST_SD_M_S2, 2 * found.sd_m_s2))


def find_wrong_flight(time_s: Array, position: Array, R: Array, covariance: Array) -> WrongFall | None:
    """Find a body that falls so slowly or fast that no wrong size explains it, or not downward; None where it does not.

    The arrays are those of `fall`. Short flights do not count.
    """
    found = _parabola(time_s, position, R, covariance)
    if found is None or np.linalg.norm(found.acceleration) * np.ptp(time_s) ** 2 / 8 < _LONG_M:
        return None
    if not found.is_vertical:
        return _wrong_vertical(found)
    is_tilted = found.tilt > max(_LEAST_TILTED, _TILTED_SDS * found.sd_m_s2 / GRAVITY_M_S2)
    if is_tilted and (wrong := _wrong_vertical(found)) is not None:
        return wrong
    falls = float(-found.acceleration[2])
    if not _SLOWEST_M_S2 < falls < _FASTEST_M_S2 or _LEAST_M_S2 < falls < _MOST_M_S2:
        return None
    return WrongFall(
        falls,
        found.sd_m_s2,
        f"the body falls at {falls:.1f} m/s² instead of {GRAVITY_M_S2:.2f}: the stated frame rate seems to be "
        f"{np.sqrt(falls / GRAVITY_M_S2):.2f} times that at which it was filmed",
    )


def _wrong_vertical(found: _Parabola) -> WrongFall | None:
    """Find a fall at about 9.81 m/s2 that is not along the world's z axis: what looks like no flight may be one."""
    size = float(np.linalg.norm(found.acceleration))
    if abs(size / GRAVITY_M_S2 - 1) > _MOST_OFF:
        return None
    axis = int(np.argmax(np.abs(found.acceleration)))
    sign = "+" if found.acceleration[axis] > 0 else "−"
    return WrongFall(
        size,
        found.sd_m_s2,
        f"the body falls at {size:.1f} m/s² towards {sign}{'xyz'[axis]}, {np.degrees(found.tilt):.0f}° from straight "
        "down: the z axis of the world must point up; give the control points their heights as z, and calibrate again",
    )


def _parabola(time_s: Array, position: Array, R: Array, covariance: Array) -> _Parabola | None:
    """Fit free flight in any direction to the arrays of `fall`; None where the path is none.

    The residual that tells free flight weighs directions as the fit does; where all have equal noise it is the RMS.
    """
    n, t = len(time_s), time_s - np.mean(time_s)
    is_known = np.asarray(np.isfinite(covariance).all(axis=(1, 2)))
    if np.count_nonzero(is_known) < _LEAST_MOMENTS or np.ptp(time_s) < _LEAST_S:
        return None
    one = np.eye(3)
    rows = np.stack([np.hstack([one, one * s, one * s**2 / 2, -each]) for s, each in zip(t, R, strict=True)])
    finite = np.where(is_known[:, None, None], covariance, one) + _LEAST_NOISE_M**2 * one
    whiten = is_known[:, None, None] * np.linalg.inv(np.linalg.cholesky(finite))  # (n, 3, 3); 0: counts for nothing
    design, whitened = (whiten @ rows).reshape(3 * n, 12), (whiten @ position[..., None]).ravel()
    inverse = np.linalg.pinv(design, rcond=1e-4)
    solution = inverse @ whitened
    residual = whitened - design @ solution
    noise = float(np.sqrt(residual @ residual / max(3 * n - 12, 1)))  # in units of the covariances
    if noise * np.sqrt(3 * n / np.sum(whiten**2)) >= _MOST_RMS_M:
        return None
    weights = (inverse[8].reshape(n, 1, 3) @ whiten).ravel()
    return _Parabola(weights, solution[6:9], noise * float(np.linalg.norm(inverse[8])))


def excess(acceleration: float) -> float:
    """Return how much a body's vertical acceleration is above that of free fall [m/s2]."""
    return acceleration + GRAVITY_M_S2
