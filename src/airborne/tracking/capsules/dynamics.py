"""How a jumper moves between frames: a Kalman filter over pose, clothing and velocity.

The filtered state x (40,) is the pose (18,), what slides while the body moves (4,: waist, ends of shorts and socks,
trunk) and the pose's velocity (18,).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.tracking.capsules.jumper import N_DOF, SHORTS_END, SOCK_END, TRUNK, WAIST

Array = NDArray[np.floating]

N_SLIDING = 4
N_FREE = N_DOF + N_SLIDING
N_FILTERED = N_FREE + N_DOF
assert {WAIST, SHORTS_END, SOCK_END, TRUNK} == set(range(N_SLIDING)), "what slides comes first among the lengths"

GRAVITY_M_S2 = 9.81
_LASTING = 2.0  # accelerations last some frames: white noise moves as far with the root of how many times their size
_ACCELERATION_SD = _LASTING * np.array(  # [m/s2], [rad/s2]
    [30.0] * 3 + [150.0] * 3 + [80.0, 60.0] + [150.0, 80.0, 80.0, 200.0, 200.0] * 2
)
# of the hips in the air, about free fall: legs and arms move about the centre of mass
_FLYING_SD = _LASTING * 8.0
_FIRST_SPEED_SD = np.array([1.0] * 3 + [2.0] * 15)  # [m/s], [rad/s]
_SLIDING_SD = np.array([0.02, 0.20, 0.03, 0.05])  # in a square root of a second: [m], shares, shares, [m]
_SLIDING_BACK = 1.2  # share of the way back to the first frame's values in a second


@dataclass(frozen=True, slots=True, eq=False)
class Filtered:
    """A Gaussian over x."""

    mean: Array  # (40,)
    covariance: Array  # (40, 40)

    @property
    def free(self) -> Array:
        """Pose and sliding lengths: (22,)."""
        return self.mean[:N_FREE]

    @property
    def hips_m_s(self) -> Array:
        """The hips' velocity: (3,) [m/s]."""
        return self.mean[N_FREE : N_FREE + 3]


def begun(free: Array, covariance: Array) -> Filtered:
    """Start at rest: free (22,), covariance (22, 22)."""
    whole = np.zeros((N_FILTERED, N_FILTERED))
    whole[:N_FREE, :N_FREE] = covariance
    whole[N_FREE:, N_FREE:] = np.diag(_FIRST_SPEED_SD**2)
    return Filtered(np.concatenate([free, np.zeros(N_DOF)]), whole)


def predicted(last: Filtered, gap_s: float, sliding: Array, *, is_flying: bool) -> Filtered:
    """Move on by gap_s [s]; sliding (4,) are the values that clothes slide back to; in the air the hips fall freely."""
    F = np.eye(N_FILTERED)
    F[:N_DOF, N_FREE:] = gap_s * np.eye(N_DOF)
    back = np.exp(-_SLIDING_BACK * gap_s)
    F[N_DOF:N_FREE, N_DOF:N_FREE] *= back
    mean = F @ last.mean
    mean[N_DOF:N_FREE] += (1 - back) * sliding
    sd = _ACCELERATION_SD.copy()
    if is_flying:
        sd[:3] = _FLYING_SD
        mean[2] -= 0.5 * GRAVITY_M_S2 * gap_s**2
        mean[N_FREE + 2] -= GRAVITY_M_S2 * gap_s
    covariance = F @ last.covariance @ F.T
    place, speed = np.arange(N_DOF), N_FREE + np.arange(N_DOF)
    covariance[place, place] += sd**2 * gap_s**4 / 4
    covariance[speed, speed] += sd**2 * gap_s**2
    covariance[place, speed] += sd**2 * gap_s**3 / 2
    covariance[speed, place] += sd**2 * gap_s**3 / 2
    slide = N_DOF + np.arange(N_SLIDING)
    covariance[slide, slide] += _SLIDING_SD**2 * gap_s
    return Filtered(mean, covariance)


def updated(expected: Filtered, free: Array, covariance: Array) -> Filtered:
    """Take in that pose and sliding lengths are free (22,), with covariance (22, 22), prediction included."""
    before = expected.covariance[:N_FREE, :N_FREE]
    gain = np.linalg.solve(before, expected.covariance[:N_FREE]).T
    mean = expected.mean + gain @ (free - expected.free)
    after = expected.covariance - gain @ (before - covariance) @ gain.T
    return Filtered(mean, (after + after.T) / 2)
