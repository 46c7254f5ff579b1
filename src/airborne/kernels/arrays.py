"""Filling arrays in kernels: an assignment to a slice would compile the text of its errors into each kernel.

That text, of shapes that do not agree, takes more time to compile than most kernels do.
"""

from __future__ import annotations

import numpy as np

from airborne.kernels.compiling import kernel


@kernel
def assign(out, values):
    """Copy the values of an array of the same shape."""
    for index in np.ndindex(out.shape):
        out[index] = values[index]


@kernel
def add(out, values):
    """Add the values of an array of the same shape."""
    for index in np.ndindex(out.shape):
        out[index] += values[index]
