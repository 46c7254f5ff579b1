"""Somersault, tilt and twist: R = Rx(somersault) Ry(tilt) Rz(twist), body to world; angles are stacked in that order.

Source: paper B, "Method" (successive rotations about a lateral, a frontal and a longitudinal axis). The angles lose
their meaning where tilt nears +-90 degrees: `is_near_singular` says where. NaN rows in give NaN rows out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airborne.types import Array

_SINGULAR_MARGIN_RAD = np.deg2rad(5.0)  # closer to +-90 degrees of tilt, errors grow over elevenfold
_RATE_ROWS = 5  # rows before a gap whose mean angular rate is carried across it


def matrix_from_angles(angles: Array) -> Array:
    """Build rotation matrices (..., 3, 3), body to world, from somersault, tilt, twist (..., 3) [rad]."""
    c, s = np.cos(angles), np.sin(angles)
    cx, cy, cz, sx, sy, sz = c[..., 0], c[..., 1], c[..., 2], s[..., 0], s[..., 1], s[..., 2]
    R = np.empty((*cx.shape, 3, 3))  # filled: stacking takes up to twice as long
    R[..., 0, 0], R[..., 0, 1], R[..., 0, 2] = cy * cz, -cy * sz, sy
    R[..., 1, 0], R[..., 1, 1], R[..., 1, 2] = cx * sz + sx * sy * cz, cx * cz - sx * sy * sz, -sx * cy
    R[..., 2, 0], R[..., 2, 1], R[..., 2, 2] = sx * sz - cx * sy * cz, sx * cz + cx * sy * sz, cx * cy
    return R


def angles_from_matrix(R: Array) -> Array:
    """Read somersault, tilt, twist (..., 3) [rad] from rotation matrices (..., 3, 3); tilt lies in [-pi/2, pi/2].

    The twist is read after the somersault is undone, so the angles give R back even where tilt is +-90 degrees.
    """
    R = np.asarray(R, float)
    somersault = np.arctan2(-R[..., 1, 2], R[..., 2, 2])
    tilt = np.arctan2(R[..., 0, 2], np.hypot(R[..., 0, 0], R[..., 0, 1]))
    c, s = np.cos(somersault), np.sin(somersault)
    twist = np.arctan2(c * R[..., 1, 0] + s * R[..., 2, 0], c * R[..., 1, 1] + s * R[..., 2, 1])
    return np.stack([somersault, tilt, twist], axis=-1)


def is_near_singular(angles: Array) -> NDArray[np.bool_]:
    """Say where tilt is within 5 degrees of +-90 (gimbal lock), where somersault and twist are one rotation: (...)."""
    return np.abs(np.asarray(angles, float)[..., 1]) > np.pi / 2 - _SINGULAR_MARGIN_RAD


def unwrap(angles: Array, time_s: Array) -> Array:
    """Add whole revolutions to somersault and twist (n, 3) [rad] so that they are continuous over time (n,) [s].

    Each row lands within half a revolution of the row before; after a gap (NaN rows), within half a revolution of the
    angle extrapolated at the mean rate of the last rows before the gap.
    """
    result = np.array(angles, float)
    valid = np.flatnonzero(np.isfinite(result).all(axis=-1))
    for k in range(1, len(valid)):
        row, before = valid[k], valid[max(k - _RATE_ROWS, 0) : k]
        guess = result[before[-1]]
        if row > before[-1] + 1 and len(before) > 1:
            step = (time_s[row] - time_s[before[-1]]) / (time_s[before[-1]] - time_s[before[0]])
            guess = guess + step * (guess - result[before[0]])
        result[row, ::2] += 2 * np.pi * np.round((guess - result[row]) / (2 * np.pi))[::2]
    return result


def angles_from_world_rotation(angles: Array) -> Array:
    """Differentiate the angles by a small world rotation vector: (..., 3, 3), rows somersault, tilt, twist.

    From w = som' e_x + tilt' Rx e_y + twist' Rx Ry e_z. NaN where `is_near_singular`.
    """
    angles = np.asarray(angles, float)
    somersault, tilt = angles[..., 0], angles[..., 1]
    c, s = np.cos(somersault), np.sin(somersault)
    cos_tilt = np.where(is_near_singular(angles), np.nan, np.cos(tilt))
    zero, one = np.zeros_like(tilt), np.ones_like(tilt)
    twist_row = np.stack([zero, -s, c], axis=-1) / cos_tilt[..., None]
    somersault_row = np.stack([one, zero, zero], axis=-1) - np.sin(tilt)[..., None] * twist_row
    return np.stack([somersault_row, np.stack([zero, c, s], axis=-1), twist_row], axis=-2)


def shortest_rotations(before: Array, after: Array) -> Array:
    """Return the shortest rotations (n, 3, 3) that turn vectors (n, 3) to the directions of others (n, 3).

    Vectors of no length, and opposite ones, whose shortest rotation is not one alone, are not turned.
    """
    a, b = (each / np.maximum(np.linalg.norm(each, axis=-1, keepdims=True), 1e-300) for each in (before, after))
    across, cosine = np.cross(a, b), np.sum(a * b, axis=-1)
    x = np.cross(across[:, None], np.eye(3)).swapaxes(-1, -2)  # v -> across x v
    is_opposite = cosine <= -1 + 1e-12
    return np.eye(3) + np.where(is_opposite[:, None, None], 0, x + x @ x / np.maximum(1 + cosine, 1e-12)[:, None, None])


def geodesic(A: Array, B: Array) -> Array:
    """Return the angle of the rotation between A and B, rotation matrices (..., 3, 3): (...) [rad], 0..pi."""
    relative = np.swapaxes(A, -1, -2) @ B
    axis = relative[..., (2, 0, 1), (1, 2, 0)] - relative[..., (1, 2, 0), (2, 0, 1)]  # 2 sin(angle) times the axis
    return np.arctan2(np.linalg.norm(axis, axis=-1), np.trace(relative, axis1=-2, axis2=-1) - 1)


def wrap(angle: Array) -> Array:
    """Wrap angles to [-pi, pi) [rad]."""
    return np.remainder(np.asarray(angle, float) + np.pi, 2 * np.pi) - np.pi


def super_fibonacci(n: int) -> Array:
    """Return n orientations (n, 3, 3) spread evenly over all (Alexa, Super-Fibonacci Spirals, CVPR 2022)."""
    s = np.arange(n) + 0.5
    first, second = 2 * np.pi * s / np.sqrt(2), 2 * np.pi * s / 1.533751168755204288118041
    r, R = np.sqrt(s / n), np.sqrt(1 - s / n)
    quaternions = np.stack([r * np.sin(first), r * np.cos(first), R * np.sin(second), R * np.cos(second)], axis=1)
    return Rotation.from_quat(quaternions).as_matrix()
