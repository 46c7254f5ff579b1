"""From the curvature of a score to a covariance that says what the pictures do not show."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airborne.kernels import kernel

Array = NDArray[np.floating]

SHIFT_SD_PX = 0.12  # of a full frame: light and edges that are not quite as modelled may displace a picture by this
LEVER_M = 0.3  # the length that makes metres and radians comparable
_MOST_SWEEPS = 30
_UNSEEN_SD_M = 0.15  # a direction known less well than this, at the lever's length, is not known


def covariance_of(curvature: Array, *, noise: float, spread: Array | None = None) -> Array:
    """Return the covariance (d, d) of a position (3,) [m] and rotation vectors [rad].

    curvature (d, d): half the second derivative of the summed squares; noise: their variance, already multiplied by how
    many pixels share it. `spread` (d, d) is the sum of g g' over patches of the pictures, g the gradient: along each
    principal direction the larger of two variances holds, that of independent noise and that of the patches (the
    sandwich estimate), which also counts wrong light and wrong shape. A direction with an sd above 0.15 m, or above
    0.5 rad, counts as not seen: what it touches has an infinite variance.
    """
    scale = np.where(np.arange(len(curvature)) < 3, 1, 1 / LEVER_M)
    steepness, directions = principal(curvature * np.outer(scale, scale))
    steepness = np.maximum(steepness, 1e-12 * max(steepness.max(), 1e-12))
    variance = noise / steepness
    if spread is not None:
        variance = np.maximum(variance, _along(directions, spread * np.outer(scale, scale)) / steepness**2)
    seen = variance < _UNSEEN_SD_M**2
    covariance = _composed(directions, np.where(seen, variance, 0.0)) * np.outer(scale, scale)
    hidden = np.any(np.abs(directions[:, ~seen]) > 0.1, axis=1)
    covariance[hidden] = covariance[:, hidden] = 0
    covariance[hidden, hidden] = np.inf
    return (covariance + covariance.T) / 2


@kernel
def principal(matrix):
    """Return the eigenvalues (d,) and the eigenvectors (d, d), as columns, of a symmetric matrix, in no order.

    Jacobi's rotations: for matrices of this size as fast as LAPACK, and the same to the last bit in every process,
    however many threads a linear algebra library may run.
    """
    A, V = matrix.copy(), np.eye(len(matrix))
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
                if A[p, q] == 0:
                    continue
                theta = (A[q, q] - A[p, p]) / (2 * A[p, q])
                t = 1 / (abs(theta) + np.sqrt(theta * theta + 1))
                t = t if theta >= 0 else -t
                c = 1 / np.sqrt(t * t + 1)
                s = t * c
                for k in range(d):
                    A[k, p], A[k, q] = c * A[k, p] - s * A[k, q], s * A[k, p] + c * A[k, q]
                for k in range(d):
                    A[p, k], A[q, k] = c * A[p, k] - s * A[q, k], s * A[p, k] + c * A[q, k]
                    V[k, p], V[k, q] = c * V[k, p] - s * V[k, q], s * V[k, p] + c * V[k, q]
    return np.diag(A).copy(), V


@kernel
def _along(directions, matrix):
    """Return what a symmetric matrix (d, d) is along each direction, a column of (d, d): (d,)."""
    d = len(matrix)
    out = np.zeros(d)
    for j in range(d):
        for i in range(d):
            for k in range(d):
                out[j] += directions[i, j] * matrix[i, k] * directions[k, j]
    return out


@kernel
def _composed(directions, values):
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
