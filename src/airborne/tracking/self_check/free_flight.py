"""The fall of a body in free flight as a measurement of the world's size: it must be 9.81 m/s2, downward."""

from __future__ import annotations

import numpy as np

from airborne.constants import GRAVITY_M_S2
from airborne.types import Array

_LEAST_MOMENTS, _LEAST_S = 7, 0.25  # of a flight that is measured
_MOST_RMS_M = 0.008  # about the parabola: more is no free flight, or not of the centre of mass
_MOST_TILT = 0.15  # horizontal acceleration, as a share of the vertical one
_LEAST_M_S2, _MOST_M_S2 = 6.0, 15.0  # a fall that a wrong scale can explain
_LEAST_SD_M_S2 = 0.03  # air, and a centre of mass that is not quite where it is taken to be


def fall(time_s: Array, position: Array, R: Array) -> tuple[Array, float, float] | None:
    """Measure the vertical acceleration of a body that turns freely; None where it is not in free flight.

    time_s (n,), root's position (n, 3) [m], R (n, 3, 3) world from root. The centre of mass is fixed in the root, in an
    unknown place. Returns the weights (3 n,) of the positions in the acceleration, it itself and its sd [m/s2].
    """
    n, t = len(time_s), time_s - np.mean(time_s)
    if n < _LEAST_MOMENTS or np.ptp(time_s) < _LEAST_S:
        return None
    one = np.eye(3)
    rows = np.stack([np.hstack([one, one * s, one * s**2 / 2, -each]) for s, each in zip(t, R, strict=True)])
    design = rows.reshape(3 * n, 12)
    inverse = np.linalg.pinv(design, rcond=1e-4)
    solution = inverse @ position.ravel()
    residual = position.ravel() - design @ solution
    rms = float(np.sqrt(residual @ residual / max(3 * n - 12, 1)))
    g = solution[6:9]
    is_fall = _LEAST_M_S2 < -g[2] < _MOST_M_S2 and np.hypot(g[0], g[1]) < _MOST_TILT * -g[2] and rms < _MOST_RMS_M
    if not is_fall:
        return None
    weights = inverse[8]
    return weights, float(g[2]), float(np.hypot(_LEAST_SD_M_S2, 2 * rms * np.linalg.norm(weights)))


def excess(acceleration: float) -> float:
    """Return how much a body's vertical acceleration is above that of free fall [m/s2]."""
    return acceleration + GRAVITY_M_S2
