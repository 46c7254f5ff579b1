"""Spot lights, and what they give to a surface: linear light, where 1 is the brightest that a camera records."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from airborne.body import Box, PosedBody

Array = NDArray[np.floating]

_CLEARANCE_M = 1e-3  # a surface is no obstacle to itself


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Spot:
    """A spot light; its light falls off with the square of the distance, and softly at the edge of its cone."""

    position: Array  # (3,) world [m]
    target: Array  # (3,) world, a point that it is aimed at [m]
    light_at_1m: Array  # (3,) linear RGB on a white surface that faces it at 1 m
    cone_rad: float  # half angle of the cone's dark edge; full light within 0.7 of it


@dataclass(frozen=True, slots=True, eq=False)
class Ambient:
    """Light from everywhere: surfaces facing up get the one, those facing down the other, upright ones the mean."""

    from_above: Array  # (3,) linear RGB
    from_below: Array  # (3,) linear RGB

    def on(self, normals: Array) -> Array:
        """Return the light on surfaces with the world normals (n, 3): (n, 3)."""
        upward = (1 + normals[:, 2:]) / 2
        return upward * self.from_above + (1 - upward) * self.from_below


def spot_light(spot: Spot, points: Array, normals: Array) -> Array:
    """Return the light (n, 3) of a spot that nothing blocks, on matt surfaces at the world points (n, 3) [m]."""
    ray = spot.position - points
    distance = np.linalg.norm(ray, axis=1)
    axis = spot.target - spot.position
    inward = np.clip(-ray @ axis / (np.linalg.norm(axis) * distance), -1, 1)
    edge, full = np.cos(spot.cone_rad), np.cos(0.7 * spot.cone_rad)
    s = np.clip((inward - edge) / (full - edge), 0, 1)
    facing = np.maximum(np.einsum("ni,ni->n", ray, normals), 0) / distance**3
    return (facing * s * s * (3 - 2 * s))[:, None] * spot.light_at_1m


def boxes_of(*bodies: PosedBody) -> Array:
    """Return the boxes of bodies as maps (b, 3, 4) from the world to a cube from -1 to 1; no other shapes."""
    maps = []
    for posed in bodies:
        for segment, R, t in zip(posed.model.segments, posed.R, posed.t, strict=True):
            for part in segment.parts:
                if isinstance(part.shape, Box):
                    turn = R @ part.segment_from_part.rotation.as_matrix()
                    place = R @ part.segment_from_part.translation + t
                    unit_from_world = 2 * turn.T / part.shape.size_m[:, None]
                    maps.append(np.column_stack([unit_from_world, -unit_from_world @ place]))
    return np.array(maps).reshape(-1, 3, 4)


def is_lit(points: Array, normals: Array, spot: Spot, boxes: Array) -> NDArray[np.bool_]:
    """Say which world points (n, 3) [m] see the spot light past the boxes (b, 3, 4) of `boxes_of`: (n,)."""
    out = np.empty(len(points), np.bool_)
    _see(points + _CLEARANCE_M * normals, np.asarray(spot.position, float), boxes, out)
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _see(points, target, boxes, out):
    for i in range(len(points)):
        out[i] = True
        for b in range(len(boxes)):
            enter, leave = 0.0, 1.0  # the part of the way from point to target that lies within all slabs so far
            for k in range(3):
                from_, to = boxes[b, k, 3], boxes[b, k, 3]
                for j in range(3):
                    from_ += boxes[b, k, j] * points[i, j]
                    to += boxes[b, k, j] * target[j]
                way = to - from_
                if way == 0:
                    if abs(from_) > 1:
                        leave = -1.0
                else:
                    s0, s1 = (-1 - from_) / way, (1 - from_) / way
                    enter, leave = max(enter, min(s0, s1)), min(leave, max(s0, s1))
                if enter >= leave:
                    break
            if enter < leave:
                out[i] = False
                break
