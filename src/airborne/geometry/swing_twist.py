"""Swing and twist of rotations: R = S T, T about z, S about an axis across it.

The coordinates are (x, y) of the swing's rotation vector and the twist's angle [rad]. They are singular only where z is
turned right round, a swing of 180 degrees.
"""

from __future__ import annotations

import numpy as np

from airborne.types import Array

_SMALL = 1e-6  # sine of the swing below which its rotation vector is taken as its sine


def swing_twist_from_matrix(R: Array) -> Array:
    """Read the coordinates (..., 3) [rad] off rotations (..., 3, 3)."""
    x, y, z = R[..., 0, 2], R[..., 1, 2], R[..., 2, 2]
    sine = np.hypot(x, y)
    scale = np.where(sine < _SMALL, 1.0, np.arctan2(sine, z) / np.maximum(sine, _SMALL))
    twist = np.arctan2(R[..., 1, 0] - R[..., 0, 1], R[..., 0, 0] + R[..., 1, 1])
    return np.stack([-scale * y, scale * x, twist], axis=-1)


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
    x, y, z = R[..., 0, 2], R[..., 1, 2], R[..., 2, 2]
    sine = np.hypot(x, y)
    is_small = sine < _SMALL
    safe = np.where(is_small, 1.0, sine)
    scale = np.where(is_small, 1.0, np.arctan2(sine, z) / safe)
    zero = np.zeros(R.shape[:-1])
    direction = np.stack([-R[..., :, 1], R[..., :, 0], zero], axis=-1)  # of R e_z, by v: (..., 3, 3)
    by_sine = (x[..., None] * direction[..., 0, :] + y[..., None] * direction[..., 1, :]) / safe[..., None]
    by_angle = z[..., None] * by_sine - sine[..., None] * direction[..., 2, :]
    by_scale = np.where(is_small[..., None], 0.0, (by_angle - scale[..., None] * by_sine) / safe[..., None])
    a, b = R[..., 1, 0] - R[..., 0, 1], R[..., 0, 0] + R[..., 1, 1]
    first = np.stack([-R[..., 0, 2], -R[..., 1, 2], b], axis=-1)  # of a, by v
    second = np.stack([R[..., 1, 2], -R[..., 0, 2], -a], axis=-1)  # of b
    twist = (b[..., None] * first - a[..., None] * second) / np.maximum(a * a + b * b, _SMALL**2)[..., None]
    return np.stack(
        [
            -scale[..., None] * direction[..., 1, :] - y[..., None] * by_scale,
            scale[..., None] * direction[..., 0, :] + x[..., None] * by_scale,
            twist,
        ],
        axis=-2,
    )
