"""Model error of a person: segments are not the ellipsoids that are rendered, so their images lie a little beside."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from airborne.body import BodyModel, PosedBody
from airborne.body.model import Mesh, Shape
from airborne.tracking.model_based.pose_descent import PoseEquations
from airborne.tracking.model_based.render_model import ViewBuffers
from airborne.types import Array

# how far a person's segment lies from the surface that fits its image along each axis, and is turned from it about its
# middle: chosen, of 2.5, 4 and 6 deg the least with which two sds hold 88 % of the joints' rotations of four synthetic
# people whose joints lie elsewhere; with 7 mm and no turn they hold 85 %, and the positions alike
SHAPE_SD_M, SHAPE_TURN_SD_RAD = 0.005, np.radians(4.0)
# the turn of the head, which is round, and of the pelvis, which flesh and clothes hide, all run long: chosen, two sds
# hold 92 % of the turns of those people's heads, with 4 deg 86 %, and of two quick people's pelvises 85 %, not 80. In a
# frame by itself as well, fewer joints of legs would be tracked
SOFT_TURN_SD_RAD = np.radians(8.0)
_SOFT = ("head", "pelvis")
_SHAPE_WIDTH_M = 0.075  # along which that error is the same; chosen on synthetic somersaults


def shape_error_gradients(A: Array, posed: PosedBody) -> Array:
    """Return the gradients' error because a person's segments are not ellipsoids: (6 segments, segments, 6).

    A (segments, 6, 6): curvature of the segments' twists about the root's origin, summed over the views. Each segment
    may lie beside the drawn one by SHAPE_SD_M along each axis, and turned about its middle by SHAPE_TURN_SD_RAD, in all
    views alike: more cameras do not show it better.
    """
    n = len(A)
    arms = posed.t + np.einsum("sij,sj->si", posed.R, _middles_m(posed.model)) - posed.t[0]
    moved = np.cross(arms[:, None], np.eye(3))  # (s, 3, 3): of the origin, as a segment turns about its middle
    by_turn = np.einsum("ski,sit->skt", moved, A[:, :3]) + A[:, 3:]
    rows = np.zeros((n, 6, n, 6))
    rows[np.arange(n), :3, np.arange(n)] = SHAPE_SD_M * A[:, :3]
    rows[np.arange(n), 3:, np.arange(n)] = SHAPE_TURN_SD_RAD * by_turn
    return rows.reshape(6 * n, n, 6)


def shape_gradients(equations: PoseEquations, posed: PosedBody) -> Array:
    """Return the same of a body whose joints move, about the segments' own axes, mapped to the pose: (6 segments, d).

    About its own axes a segment's error is the same in every pose. Head and pelvis are turned by SOFT_TURN_SD_RAD.
    """
    n = len(posed.R)
    by_twist = equations.shifted[-1].reshape(n, 2, 3, n, 6).copy()
    is_soft = [segment.name in _SOFT for segment in posed.model.segments]
    by_twist[is_soft, 1] *= SOFT_TURN_SD_RAD / SHAPE_TURN_SD_RAD
    own = np.einsum("sik,sjitp->sjktp", posed.R, by_twist)
    return np.einsum("sjktp,tpd->sjkd", own, equations.J).reshape(6 * n, -1)


@lru_cache(maxsize=16)
def _middles_m(model: BodyModel) -> Array:
    """Return the middles of the segments' surfaces in their own frames: (segments, 3) [m]."""
    middles = np.zeros((len(model.segments), 3))
    for index, segment in enumerate(model.segments):
        if segment.parts:
            ends = [part.segment_from_part.apply(_middle_m(part.shape)) for part in segment.parts]
            middles[index] = np.mean(ends, axis=0)
    return middles


def _middle_m(shape: Shape) -> Array:
    if isinstance(shape, Mesh):
        return (shape.vertices_m.min(axis=0) + shape.vertices_m.max(axis=0)) / 2
    return np.zeros(3)


def shape_error_px(view: ViewBuffers, posed: PosedBody) -> float:
    """Return how many pixels of a view have their shape error in common."""
    depth_m = max(float(posed.t[0] @ view.packed_view[6:9] + view.packed_view[11]), 0.1)
    return float(view.K[0, 0] * view.K[1, 1]) * (_SHAPE_WIDTH_M / depth_m) ** 2
