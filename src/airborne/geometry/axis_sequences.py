"""Angles of a rotation about a sequence of three axes of the moving frame: R = R1(a) R2(b) R3(c).

`axes` (3, 3) holds the axes as rows, unit vectors, each at right angles to the next. The third is the first again (a
proper Euler sequence, as the ISB's Y-X-Y; b in [-pi, 0], as it tells elevation), or at right angles to it (Cardan, as
Z-X-Y; b in [-pi/2, pi/2]). Where b makes the outer axes parallel, a and c are one rotation.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airborne.geometry.rotations import angles_from_matrix
from airborne.types import Array

_SINGULAR_MARGIN_RAD = np.deg2rad(5.0)  # the same as of somersault, tilt and twist


def sequence_angles(R: Array, axes: Array) -> Array:
    """Read the angles (..., 3) [rad] off rotation matrices (..., 3, 3); where singular, too, they give R back."""
    basis = np.stack([axes[0], axes[1], np.cross(axes[0], axes[1])], axis=1)
    Q = basis.T @ np.asarray(R, float) @ basis
    if not _is_proper(axes):
        return angles_from_matrix(Q) * [1, 1, np.sign(np.linalg.det(axes))]
    a = np.arctan2(-Q[..., 1, 0], Q[..., 2, 0])
    b = -np.arctan2(np.hypot(Q[..., 0, 1], Q[..., 0, 2]), Q[..., 0, 0])
    cos, sin = np.cos(a), np.sin(a)
    c = np.arctan2(-cos * Q[..., 1, 2] - sin * Q[..., 2, 2], cos * Q[..., 1, 1] + sin * Q[..., 2, 1])
    return np.stack([a, b, c], axis=-1)


def continue_angles(angles: Array, axes: Array) -> Array:
    """Return angles (n, 3) [rad], each row on the branch nearest to the last known row before it; NaN rows stay NaN."""
    result = np.array(angles, float)
    for before, row in pairwise(np.flatnonzero(np.isfinite(result).all(axis=-1))):
        a, b, c = result[row]
        both = np.array([[a, b, c], [a + np.pi, -b if _is_proper(axes) else np.pi - b, c + np.pi]])
        both += 2 * np.pi * np.round((result[before] - both) / (2 * np.pi))
        result[row] = both[np.argmin(np.sum((both - result[before]) ** 2, axis=1))]
    return result


def is_singular(angles: Array, axes: Array) -> NDArray[np.bool_]:
    """Say where the outer axes are within 5 degrees of parallel, where a and c are hardly told apart: (...)."""
    b = np.asarray(angles, float)[..., 1]
    return np.abs(np.sin(b) if _is_proper(axes) else np.cos(b)) < np.sin(_SINGULAR_MARGIN_RAD)


def angles_from_rotation(angles: Array, axes: Array) -> Array:
    """Differentiate angles (n, 3) by a small rotation vector in the segment's axes: (n, 3, 3); NaN where singular."""
    jacobian = np.full((len(angles), 3, 3), np.nan)
    usable = np.isfinite(angles).all(axis=1) & ~is_singular(angles, axes)
    last = Rotation.from_rotvec(angles[usable, 2:] * axes[2])
    both = Rotation.from_rotvec(angles[usable, 1:2] * axes[1]) * last
    third = np.broadcast_to(axes[2], (int(usable.sum()), 3))
    turned = [both.inv().apply(axes[0]), last.inv().apply(axes[1]), third]
    jacobian[usable] = np.linalg.inv(np.stack(turned, axis=-1))
    return jacobian


def _is_proper(axes: Array) -> bool:
    return bool(axes[0] @ axes[2] > 0.5)
