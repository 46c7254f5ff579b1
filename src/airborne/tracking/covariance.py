"""From the curvature of a score to a covariance that says what the images do not show."""

from __future__ import annotations

import numpy as np

from airborne.kernels import kernel
from airborne.types import Array

SHIFT_SD_PX = 0.12  # of a full frame: light and edges that are not quite as modelled may displace an image by this
_LEVER_M = 0.3  # the length that makes metres and radians comparable
_JOINT_RANGE_RAD = 1.0  # sd of a joint's rotation that images do not show: that of a range of +-100 degrees
_MOST_SWEEPS = 30  # of the iteration
_NO_ANGLE = 1e-34  # squared tangent of a rotation that changes no digit
_UNOBSERVED_SD_M = 0.15  # a direction with a larger sd than this, at the lever's length, counts as unobserved


def covariance_of(curvature: Array, *, noise: float, score_covariance: Array | None = None) -> Array:
    """Return the covariance (d, d) of a position (3,) [m] and rotation vectors [rad].

    curvature (d, d): half the Hessian of the summed squares; noise: their variance, already multiplied by how many
    pixels share it. `score_covariance` (d, d) is the sum of g g' over image patches, g the gradient: along each
    principal direction the larger of two variances holds, that of independent noise and that of the patches (the
    sandwich estimate), which also counts wrong light and wrong shape. A direction with an sd above 0.15 m, or above
    0.5 rad, counts as unobserved: what it touches has an infinite variance, if it moves the root. One of joints alone
    has the variance of a joint's range, so that what hardly depends on it, as an ankle on a straight leg's spin, keeps
    its own.
    """
    scale = np.where(np.arange(len(curvature)) < 3, 1, 1 / _LEVER_M)
    steepness, directions = eigen_decomposition(curvature * np.outer(scale, scale))
    steepness = np.maximum(steepness, 1e-12 * max(steepness.max(), 1e-12))
    variance = noise / steepness
    if score_covariance is not None:
        forms = _quadratic_forms(directions, score_covariance * np.outer(scale, scale))
        variance = np.maximum(variance, forms / steepness**2)
    observed = variance < _UNOBSERVED_SD_M**2
    is_of_joints = ~observed & ~np.any(np.abs(directions[:6]) > 0.1, axis=0)
    variance = np.where(is_of_joints, (_JOINT_RANGE_RAD * _LEVER_M) ** 2, variance)
    observed |= is_of_joints
    covariance = _compose(directions, np.where(observed, variance, 0.0)) * np.outer(scale, scale)
    unobserved = np.any(np.abs(directions[:, ~observed]) > 0.1, axis=1)
    covariance[unobserved] = covariance[:, unobserved] = 0
    covariance[unobserved, unobserved] = np.inf
    return (covariance + covariance.T) / 2


@kernel
def eigen_decomposition(matrix):
    """Return the eigenvalues (d,) and the eigenvectors (d, d), as columns, of a symmetric matrix, in no order.

    By Jacobi's rotations: for matrices of this size as fast as LAPACK, and the same to the last bit in every process,
    however many threads a linear algebra library may run.
    """
    A, V = matrix.copy(), np.eye(len(matrix))  # V: an eigenvector a row, so that rows alone are rotated
    d = len(A)
    for _ in range(_MOST_SWEEPS):
        off, on = 0.0, 0.0
        for i in range(d):
            on += A[i, i] * A[i, i]
            for j in range(i):
                off += A[i, j] * A[i, j]
        if off <= 1e-30 * on:
            break
        for p in range(d - 1):
            for q in range(p + 1, d):
                if A[p, q] * A[p, q] <= _NO_ANGLE * abs(A[p, p] * A[q, q]):
                    continue
                theta = (A[q, q] - A[p, p]) / (2 * A[p, q])
                t = 1 / (abs(theta) + np.sqrt(theta * theta + 1))
                t = t if theta >= 0 else -t
                c = 1 / np.sqrt(t * t + 1)
                s = t * c
                first, second, of_first, of_second = A[p], A[q], V[p], V[q]
                for k in range(d):
                    first[k], second[k] = c * first[k] - s * second[k], s * first[k] + c * second[k]
                for k in range(d):
                    of_first[k], of_second[k] = c * of_first[k] - s * of_second[k], s * of_first[k] + c * of_second[k]
                on_p, on_q = c * first[p] - s * first[q], s * second[p] + c * second[q]
                for k in range(d):
                    A[k, p], A[k, q] = first[k], second[k]
                A[p, p], A[q, q], A[p, q], A[q, p] = on_p, on_q, 0.0, 0.0
    return np.diag(A).copy(), V.T.copy()


@kernel
def _quadratic_forms(directions, matrix):
    """Return v' M v of a symmetric matrix M (d, d) for each direction v, a column of (d, d): (d,)."""
    d = len(matrix)
    out = np.zeros(d)
    for j in range(d):
        for i in range(d):
            for k in range(d):
                out[j] += directions[i, j] * matrix[i, k] * directions[k, j]
    return out


@kernel
def _compose(directions, values):
    """Return the matrix (d, d) with these eigenvectors, as columns, and eigenvalues (d,)."""
    d = len(values)
    out = np.zeros((d, d))
    for i in range(d):
        for j in range(i + 1):
            total = 0.0
            for k in range(d):
                total += directions[i, k] * values[k] * directions[j, k]
            out[i, j] = out[j, i] = total
    return out
