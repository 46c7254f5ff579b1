"""Model error of a person: segments are not the ellipsoids that are rendered, so their images lie a little beside."""

from __future__ import annotations

import numpy as np

from airborne.body import PosedBody
from airborne.tracking.model_based.render_model import ViewBuffers
from airborne.types import Array

SHAPE_SD_M = 0.007  # how far a person's segment lies from the ellipsoid that fits its image
_SHAPE_WIDTH_M = 0.075  # along which that error is the same; chosen on synthetic somersaults


def shape_error_gradients(B: Array, posed: PosedBody, view: ViewBuffers) -> Array:
    """Return the gradients' error because a person's segments are not ellipsoids: (2 segments, segments, 6).

    Each segment's image may lie beside the rendered one by SHAPE_SD_M, right or down, in each view independently.
    """
    n = len(B)
    depth_m = posed.t @ view.packed_view[6:9] + view.packed_view[11]
    sd_px = SHAPE_SD_M * np.array([view.K[0, 0], view.K[1, 1]]) / np.maximum(depth_m, 0.1)[:, None]  # (segments, 2)
    rows = np.zeros((n, 2, n, 6))
    rows[np.arange(n), :, np.arange(n)] = np.swapaxes(B[..., :2], 1, 2) * sd_px[..., None]
    return rows.reshape(2 * n, n, 6)


def shape_error_px(view: ViewBuffers, posed: PosedBody) -> float:
    """Return how many pixels of a view have their shape error in common."""
    depth_m = max(float(posed.t[0] @ view.packed_view[6:9] + view.packed_view[11]), 0.1)
    return float(view.K[0, 0] * view.K[1, 1]) * (_SHAPE_WIDTH_M / depth_m) ** 2
