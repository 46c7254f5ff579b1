"""Model error of a person: segments are not the ellipsoids that are rendered, so their images lie a little beside."""

from __future__ import annotations

import numpy as np

from airborne.body import PosedBody
from airborne.tracking.model_based.pose_descent import PoseEquations
from airborne.tracking.model_based.render_model import ViewBuffers
from airborne.types import Array

# how far a person's segment lies from the ellipsoid that fits its image, along each axis: chosen on eleven synthetic
# people with a smooth skin, lengths 4 % and girths 12 % off
SHAPE_SD_M = 0.007
_SHAPE_WIDTH_M = 0.075  # along which that error is the same; chosen on synthetic somersaults


def shape_error_gradients(A: Array) -> Array:
    """Return the gradients' error because a person's segments are not ellipsoids: (3 segments, segments, 6).

    A (segments, 6, 6): curvature of the segments' twists, summed over the views. Each segment may lie beside the drawn
    one by SHAPE_SD_M along each axis, in all views alike: more cameras do not show it better.
    """
    n = len(A)
    rows = np.zeros((n, 3, n, 6))
    rows[np.arange(n), :, np.arange(n)] = SHAPE_SD_M * A[:, :3]
    return rows.reshape(3 * n, n, 6)


def shape_gradients(equations: PoseEquations, posed: PosedBody) -> Array:
    """Return the same of a body whose joints move, along the segments' own axes, mapped to the pose: (3 segments, d).

    Along its own axes a segment's error is the same in every pose.
    """
    n = len(posed.R)
    by_twist = equations.shifted[-1].reshape(n, 3, n, 6)
    own = np.einsum("sik,sitp->sktp", posed.R, by_twist)
    return np.einsum("sktp,tpd->skd", own, equations.J).reshape(3 * n, -1)


def shape_error_px(view: ViewBuffers, posed: PosedBody) -> float:
    """Return how many pixels of a view have their shape error in common."""
    depth_m = max(float(posed.t[0] @ view.packed_view[6:9] + view.packed_view[11]), 0.1)
    return float(view.K[0, 0] * view.K[1, 1]) * (_SHAPE_WIDTH_M / depth_m) ** 2
