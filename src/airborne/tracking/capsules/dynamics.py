"""How a jumper moves between frames: a Kalman filter over pose, clothing and velocity.

The filtered state x (40,) is the pose (18,), what slides as the body moves (4,: waist, ends of shorts and socks,
trunk) and the pose's velocity (18,).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airborne.constants import GRAVITY_M_S2
from airborne.tracking.capsules.jumper import N_DOF, SHORTS_END, SOCK_END, TRUNK, WAIST
from airborne.types import Array

N_SLIDING = 4  # lengths of clothes: they slide on the body
N_FREE = N_DOF + N_SLIDING
N_FILTERED = N_FREE + N_DOF
assert {WAIST, SHORTS_END, SOCK_END, TRUNK} == set(range(N_SLIDING)), "the sliding lengths come first"

_CORRELATION = 2.0  # accelerations previous several frames n: white noise of sqrt(n) times their sd disperses as far
_ACCELERATION_SD = _CORRELATION * np.array(  # [m/s2], [rad/s2]
    [30.0] * 3 + [150.0] * 3 + [80.0, 60.0] + [150.0, 80.0, 80.0, 200.0, 200.0] * 2
)
# of the hips in the air, about free fall: the limbs move about the centre of mass
_AIRBORNE_SD = _CORRELATION * 8.0
FIRST_SPEED_SD = np.array([1.0] * 3 + [2.0] * 15)  # [m/s], [rad/s]
# chosen by hand; at a hundredth of it the joints err by 24.3 mm, not 20.9: blocker_variants.csv, clothes that stay
_SLIDING_SD = np.array([0.02, 0.20, 0.03, 0.05])  # per sqrt(s): [m], shares, shares, [m]
_SLIDING_RETURN_RATE = 1.2  # [1/s] decay to the first frame's values


@dataclass(frozen=True, slots=True, eq=False)
class GaussianState:
    """A Gaussian over x."""

    mean: Array  # (40,)
    covariance: Array  # (40, 40)

    @property
    def free(self) -> Array:
        """Pose and sliding lengths: (22,)."""
        return self.mean[:N_FREE]

    @property
    def hips_velocity_m_s(self) -> Array:
        """The hips' velocity: (3,) [m/s]."""
        return self.mean[N_FREE : N_FREE + 3]


def state_at_rest(free: Array, covariance: Array) -> GaussianState:
    """Return a state at rest: free (22,), covariance (22, 22)."""
    full_covariance = np.zeros((N_FILTERED, N_FILTERED))
    full_covariance[:N_FREE, :N_FREE] = covariance
    full_covariance[N_FREE:, N_FREE:] = np.diag(FIRST_SPEED_SD**2)
    return GaussianState(np.concatenate([free, np.zeros(N_DOF)]), full_covariance)


def predict_mean(previous: GaussianState, dt_s: float, sliding: Array, *, is_airborne: bool) -> Array:
    """Return the mean (40,) of what `predict` expects, alone."""
    mean, decay = previous.mean.copy(), _decay(dt_s)
    mean[:N_DOF] += dt_s * mean[N_FREE:]
    mean[N_DOF:N_FREE] = decay * mean[N_DOF:N_FREE] + (1 - decay) * sliding
    if is_airborne:
        mean[2] -= 0.5 * GRAVITY_M_S2 * dt_s**2
        mean[N_FREE + 2] -= GRAVITY_M_S2 * dt_s
    return mean


def predict(previous: GaussianState, dt_s: float, sliding: Array, *, is_airborne: bool) -> GaussianState:
    """Predict dt_s [s] ahead; sliding (4,) are the lengths that clothes return to; airborne hips fall freely."""
    F = np.eye(N_FILTERED)
    F[:N_DOF, N_FREE:] = dt_s * np.eye(N_DOF)
    F[N_DOF:N_FREE, N_DOF:N_FREE] *= _decay(dt_s)
    mean = predict_mean(previous, dt_s, sliding, is_airborne=is_airborne)
    sd = _ACCELERATION_SD.copy()
    if is_airborne:
        sd[:3] = _AIRBORNE_SD
    covariance = F @ previous.covariance @ F.T
    position, velocity = np.arange(N_DOF), N_FREE + np.arange(N_DOF)
    covariance[position, position] += sd**2 * dt_s**4 / 4
    covariance[velocity, velocity] += sd**2 * dt_s**2
    covariance[position, velocity] += sd**2 * dt_s**3 / 2
    covariance[velocity, position] += sd**2 * dt_s**3 / 2
    slide = N_DOF + np.arange(N_SLIDING)
    covariance[slide, slide] += _SLIDING_SD**2 * dt_s
    return GaussianState(mean, covariance)


def _decay(dt_s: float) -> float:
    """Return by how much clothes still differ from where they return to."""
    return float(np.exp(-_SLIDING_RETURN_RATE * dt_s))


def update(expected: GaussianState, free: Array, covariance: Array) -> GaussianState:
    """Update by a posterior of pose and sliding lengths: free (22,), covariance (22, 22), prediction included."""
    before = expected.covariance[:N_FREE, :N_FREE]
    gain = np.linalg.solve(before, expected.covariance[:N_FREE]).T
    mean = expected.mean + gain @ (free - expected.free)
    after = expected.covariance - gain @ (before - covariance) @ gain.T
    return GaussianState(mean, (after + after.T) / 2)
