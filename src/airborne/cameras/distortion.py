"""Brown lens distortion on normalised image coordinates (OpenCV's k1, k2, p1, p2, k3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]


def distort(xy: Array, coefficients: Array) -> Array:
    """Move ideal normalised points (..., 2) to where the lens puts them: (..., 2)."""
    k1, k2, p1, p2, k3 = np.pad(coefficients, (0, 5 - len(coefficients)))
    x, y = xy[..., 0], xy[..., 1]
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return np.stack(
        [
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
        ],
        axis=-1,
    )
