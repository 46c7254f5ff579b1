"""Kernels on SO(3): compose rotations with rotation vectors, and the inverse, for a body's root and for many joints.

SciPy's rotations are for tables: of a single matrix they take a hundred times as long.
"""

from __future__ import annotations

import math

import numpy as np

from airborne.kernels import kernel

_GIMBAL_LOCK = 1e-8  # cosine of the middle angle below which the other two are one angle
_SMALL = 1e-8  # of an angle or its sine


@kernel
def move_matrix(matrix, translation, rotation_vector):
    """Return a rigid map (4, 4) translated by (3,) and rotated about its own origin by (3,) [rad], in outer axes.

    The result is brought back to a rotation, so that rounding does not grow from frame to frame.
    """
    T, R, moved = np.empty((3, 3)), np.empty((3, 3)), np.zeros((4, 4))
    moved[3, 3] = 1.0
    fill_exponential(rotation_vector, T)
    for a in range(3):
        moved[a, 3] = matrix[a, 3] + translation[a]
        for b in range(3):
            R[a, b] = T[a, 0] * matrix[0, b] + T[a, 1] * matrix[1, b] + T[a, 2] * matrix[2, b]
    for a in range(3):
        for b in range(3):
            total = 1.5 * R[a, b]  # a Newton step to the nearest rotation: R (3 - R' R) / 2
            for c in range(3):
                total -= 0.5 * R[a, c] * (R[0, c] * R[0, b] + R[1, c] * R[1, b] + R[2, c] * R[2, b])
            moved[a, b] = total
    return moved


@kernel
def motion_between(earlier, later):
    """Return the translation and rotation vector (6,) from one rigid map (4, 4) to another; inverts `move_matrix`."""
    motion, R = np.empty(6), np.empty((3, 3))
    for a in range(3):
        motion[a] = later[a, 3] - earlier[a, 3]
        for b in range(3):
            R[a, b] = later[a, 0] * earlier[b, 0] + later[a, 1] * earlier[b, 1] + later[a, 2] * earlier[b, 2]
    _logarithm(R, motion[3:])
    return motion


@kernel
def rotations_of(angles):
    """Return the rotations Rx Ry Rz (n, 3, 3) of angles (n, 3) [rad]."""
    R = np.empty((len(angles), 3, 3))
    for j in range(len(angles)):
        fill_rotation(angles[j], R[j])
    return R


@kernel
def compose_rotation_vectors(angles, rotation_vectors):
    """Return the angles (n, 3) [rad] of Rx Ry Rz exp(v), on the branch near the old angles (n, 3).

    rotation_vectors (n, 3) [rad] are given in the joint's own, rotated axes.
    """
    out, R, T, product = np.empty_like(angles), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    for j in range(len(angles)):
        fill_rotation(angles[j], R)
        fill_exponential(rotation_vectors[j], T)
        for a in range(3):
            for b in range(3):
                product[a, b] = R[a, 0] * T[0, b] + R[a, 1] * T[1, b] + R[a, 2] * T[2, b]
        _angles_near(product, angles[j], out[j])
    return out


@kernel
def rotation_vectors_between(earlier, later):
    """Return the rotation vectors (n, 3) [rad] from angles earlier to later (n, 3).

    The inverse of `compose_rotation_vectors`.
    """
    out, A, B, product = np.empty_like(earlier), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    for j in range(len(earlier)):
        fill_rotation(earlier[j], A)
        fill_rotation(later[j], B)
        for a in range(3):
            for b in range(3):
                product[a, b] = A[0, a] * B[0, b] + A[1, a] * B[1, b] + A[2, a] * B[2, b]
        _logarithm(product, out[j])
    return out


@kernel(is_inner=True)
def fill_rotation(angles, R):
    """Fill in the rotation Rx Ry Rz (3, 3) of angles (3,) [rad]."""
    cx, sx = math.cos(angles[0]), math.sin(angles[0])
    cy, sy = math.cos(angles[1]), math.sin(angles[1])
    cz, sz = math.cos(angles[2]), math.sin(angles[2])
    R[0, 0], R[0, 1], R[0, 2] = cy * cz, -cy * sz, sy
    R[1, 0], R[1, 1], R[1, 2] = cx * sz + sx * sy * cz, cx * cz - sx * sy * sz, -sx * cy
    R[2, 0], R[2, 1], R[2, 2] = sx * sz - cx * sy * cz, sx * cz + cx * sy * sz, cx * cy


@kernel(is_inner=True)
def fill_exponential(vector, R):
    """Fill in the rotation (3, 3) of a rotation vector (3,) [rad]."""
    angle2 = vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2
    angle = math.sqrt(angle2)
    small = angle < _SMALL
    s = 1.0 if small else math.sin(angle) / angle
    c = 0.5 if small else (1 - math.cos(angle)) / angle2
    x, y, z = vector[0], vector[1], vector[2]
    R[0, 0], R[1, 1], R[2, 2] = 1 - c * (y * y + z * z), 1 - c * (x * x + z * z), 1 - c * (x * x + y * y)
    R[0, 1], R[1, 0] = c * x * y - s * z, c * x * y + s * z
    R[0, 2], R[2, 0] = c * x * z + s * y, c * x * z - s * y
    R[1, 2], R[2, 1] = c * y * z - s * x, c * y * z + s * x


@kernel(is_inner=True)
def _logarithm(R, vector):
    """Fill the rotation vector of R through its quaternion, whose largest component is found without cancellation."""
    w = 1 + R[0, 0] + R[1, 1] + R[2, 2]
    x = 1 + R[0, 0] - R[1, 1] - R[2, 2]
    y = 1 - R[0, 0] + R[1, 1] - R[2, 2]
    z = 1 - R[0, 0] - R[1, 1] + R[2, 2]
    largest = max(max(w, x), max(y, z))
    if largest == w:
        x, y, z = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    elif largest == x:
        w, y, z = R[2, 1] - R[1, 2], R[0, 1] + R[1, 0], R[0, 2] + R[2, 0]
    elif largest == y:
        w, x, z = R[0, 2] - R[2, 0], R[0, 1] + R[1, 0], R[1, 2] + R[2, 1]
    else:
        w, x, y = R[1, 0] - R[0, 1], R[0, 2] + R[2, 0], R[1, 2] + R[2, 1]
    sine = math.sqrt(x * x + y * y + z * z)
    if w < 0:
        w, x, y, z = -w, -x, -y, -z
    scale = 2 / w if sine < _SMALL * w else 2 * math.atan2(sine, w) / sine
    vector[0], vector[1], vector[2] = scale * x, scale * y, scale * z


@kernel(is_inner=True)
def _angles_near(R, near, out):
    """Fill the angles of R on the branch nearest to `near` (3,); where y is +-90 degrees, x keeps its value."""
    cosine = math.hypot(R[1, 2], R[2, 2])
    x = near[0] if cosine < _GIMBAL_LOCK else math.atan2(-R[1, 2], R[2, 2])
    y = math.atan2(R[0, 2], math.hypot(R[0, 0], R[0, 1]))
    c, s = math.cos(x), math.sin(x)
    z = math.atan2(c * R[1, 0] + s * R[2, 0], c * R[1, 1] + s * R[2, 1])
    one0, one1, one2 = _nearest_equivalent(x, near[0]), _nearest_equivalent(y, near[1]), _nearest_equivalent(z, near[2])
    two0, two1, two2 = (
        _nearest_equivalent(x + math.pi, near[0]),
        _nearest_equivalent(math.pi - y, near[1]),
        _nearest_equivalent(z + math.pi, near[2]),
    )
    first = (one0 - near[0]) ** 2 + (one1 - near[1]) ** 2 + (one2 - near[2]) ** 2
    second = (two0 - near[0]) ** 2 + (two1 - near[1]) ** 2 + (two2 - near[2]) ** 2
    if second < first:
        out[0], out[1], out[2] = two0, two1, two2
    else:
        out[0], out[1], out[2] = one0, one1, one2


@kernel(is_inner=True)
def _nearest_equivalent(angle, near):
    """Return the angle plus the whole revolutions that bring it nearest to another."""
    return angle + 2 * math.pi * round((near - angle) / (2 * math.pi))
