"""Swing and twist of rotations: R = S T, T about z, S about an axis across it.

The coordinates are (x, y) of the swing's rotation vector and the twist's angle [rad]. They are singular only where z is
turned right round, a swing of 180 degrees.
"""

from __future__ import annotations

import math

import numpy as np

from airborne.kernels import kernel
from airborne.types import Array

_SMALL = 1e-6  # sine of the swing below which its rotation vector is taken as its sine


def swing_twist_from_matrix(R: Array) -> Array:
    """Read the coordinates (..., 3) [rad] off rotations (..., 3, 3)."""
    R = np.ascontiguousarray(R, float)
    out = np.empty(R.shape[:-1])
    _fill_coordinates(R.reshape(-1, 3, 3), out.reshape(-1, 3))
    return out


@kernel(is_inner=True)
def _swing(R):
    """Return the sine of the swing's angle, and the angle over it."""
    sine = math.hypot(R[0, 2], R[1, 2])
    return sine, 1.0 if sine < _SMALL else math.atan2(sine, R[2, 2]) / sine


@kernel
def _fill_coordinates(R, out):
    for n in range(len(R)):
        fill_swing_twist(R[n], out[n])


@kernel(is_inner=True)
def fill_swing_twist(R, out):
    """Fill in the coordinates (3,) [rad] of a rotation (3, 3)."""
    _, scale = _swing(R)
    out[0], out[1] = -scale * R[1, 2], scale * R[0, 2]
    out[2] = math.atan2(R[1, 0] - R[0, 1], R[0, 0] + R[1, 1])


def rotation_of(coordinates: Array) -> Array:
    """Build the rotations (..., 3, 3) of coordinates (..., 3) [rad]."""
    a, b, twist = np.moveaxis(np.asarray(coordinates, float), -1, 0)
    angle = np.hypot(a, b)
    share = np.sinc(angle / np.pi)  # sin(angle) / angle
    x, y, z = share * b, -share * a, np.cos(angle)
    k = np.where(z > 0, 1 / (1 + np.maximum(z, 0)), (1 - z) / np.maximum(x * x + y * y, _SMALL**2))
    c, s = np.cos(twist), np.sin(twist)
    swing = np.stack(
        [np.stack([1 - k * x * x, -k * x * y, x], -1), np.stack([-k * x * y, 1 - k * y * y, y], -1)], axis=-2
    )
    swing = np.concatenate([swing, np.stack([-x, -y, z], -1)[..., None, :]], axis=-2)
    zero, one = np.zeros_like(c), np.ones_like(c)
    rows = [[c, -s, zero], [s, c, zero], [zero, zero, one]]
    return swing @ np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def swing_twist_jacobian(R: Array) -> Array:
    """Differentiate the coordinates by a rotation vector in the rotated axes, R exp(v): (..., 3, 3)."""
    R = np.ascontiguousarray(R, float)
    out = np.empty(R.shape)
    _fill_jacobian(R.reshape(-1, 3, 3), out.reshape(-1, 3, 3))
    return out


@kernel
def _fill_jacobian(R, out):
    for n in range(len(R)):
        x, y, z = R[n, 0, 2], R[n, 1, 2], R[n, 2, 2]
        sine, scale = _swing(R[n])
        a, b = R[n, 1, 0] - R[n, 0, 1], R[n, 0, 0] + R[n, 1, 1]
        size2 = max(a * a + b * b, _SMALL**2)
        for k in range(3):  # by v, of R e_z, of the swing's angle, of a and b
            by_x = -R[n, 0, 1] if k == 0 else (R[n, 0, 0] if k == 1 else 0.0)
            by_y = -R[n, 1, 1] if k == 0 else (R[n, 1, 0] if k == 1 else 0.0)
            by_z = -R[n, 2, 1] if k == 0 else (R[n, 2, 0] if k == 1 else 0.0)
            by_scale = 0.0
            if sine >= _SMALL:
                by_sine = (x * by_x + y * by_y) / sine
                by_scale = (z * by_sine - sine * by_z - scale * by_sine) / sine
            by_a = -R[n, 0, 2] if k == 0 else (-R[n, 1, 2] if k == 1 else b)
            by_b = R[n, 1, 2] if k == 0 else (-R[n, 0, 2] if k == 1 else -a)
            out[n, 0, k] = -scale * by_y - y * by_scale
            out[n, 1, k] = scale * by_x + x * by_scale
            out[n, 2, k] = (b * by_a - a * by_b) / size2
