"""Arrays in kernels: what NumPy has a word for, but takes longer to compile than most kernels do.

An assignment to a slice compiles the text of its errors, of shapes that do not agree, into each kernel; a solution of
linear equations copies its arguments for LAPACK, and looks for what may be wrong with them.
"""

from __future__ import annotations

import numpy as np

from airborne.kernels.compiling import kernel


@kernel(is_inner=True)
def assign(out, values):
    """Copy the values of an array of the same shape."""
    for index in np.ndindex(out.shape):
        out[index] = values[index]


@kernel(is_inner=True)
def add(out, values):
    """Add the values of an array of the same shape."""
    for index in np.ndindex(out.shape):
        out[index] += values[index]


@kernel(fastmath=True, is_inner=True)
def solve_positive(A, b):
    """Overwrite b (n,) with the solution of A x = b, and A (n, n) too: by Cholesky.

    A is positive definite, given by its lower triangle.
    """
    n = len(b)
    for j in range(n):
        for k in range(j):
            A[j, j] -= A[j, k] * A[j, k]
        A[j, j] = np.sqrt(A[j, j])
        for i in range(j + 1, n):
            for k in range(j):
                A[i, j] -= A[i, k] * A[j, k]
            A[i, j] /= A[j, j]
    for i in range(n):
        for k in range(i):
            b[i] -= A[i, k] * b[k]
        b[i] /= A[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            b[i] -= A[k, i] * b[k]
        b[i] /= A[i, i]
