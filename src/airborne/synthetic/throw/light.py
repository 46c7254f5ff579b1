"""Spot lights and their irradiance on surfaces, in linear light, where 1 is the brightest that a camera records."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.body import Box, Ellipsoid, Part, PosedBody
from airborne.kernels import kernel
from airborne.types import Array

_CLEARANCE_M = 1e-3  # a surface does not occlude itself
_CORE = 0.93  # share of an ellipsoid's size that blocks light: a smooth skin lies partly inside its ellipsoid
_NOTHING = np.zeros((0, 3, 4))  # no body that could occlude


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Spot:
    """A spot light; its light falls off with the square of the distance, and softly at the edge of its cone."""

    position: Array  # (3,) world [m]
    target: Array  # (3,) world, a point that it is aimed at [m]
    light_at_1m: Array  # (3,) linear RGB on a white surface that faces it at 1 m
    cone_rad: float  # half angle of the cone's dark edge; full light within 0.7 of it


@dataclass(frozen=True, slots=True, eq=False)
class Ambient:
    """Ambient light: surfaces facing up get `from_above`, those facing down `from_below`, upright ones the mean."""

    from_above: Array  # (3,) linear RGB
    from_below: Array  # (3,) linear RGB

    def irradiance(self, normals: Array) -> Array:
        """Return the irradiance of surfaces with the world normals (n, 3): (n, 3)."""
        upward = (1 + normals[:, 2:]) / 2
        return upward * self.from_above + (1 - upward) * self.from_below


NO_AMBIENT = Ambient(np.zeros(3), np.zeros(3))


def spot_irradiance(spot: Spot, points: Array, normals: Array) -> Array:
    """Return the irradiance (n, 3) of an unoccluded spot on matt surfaces at the world points (n, 3) [m]."""
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
        for part, rotation, position in _parts_in_world(posed):
            if isinstance(part.shape, Box):
                maps.append(_to_unit(2 * rotation.T / part.shape.size_m[:, None], position))
    return np.array(maps).reshape(-1, 3, 4)


def ellipsoids_of(*bodies: PosedBody) -> Array:
    """Return the cores of bodies' ellipsoids, 0.93 of their size, as maps (e, 3, 4) from the world to the unit sphere.

    Cut ellipsoids count as whole ones.
    """
    maps = []
    for posed in bodies:
        for part, rotation, position in _parts_in_world(posed):
            if isinstance(part.shape, Ellipsoid):
                maps.append(_to_unit(rotation.T / (_CORE * part.shape.semi_axes_m[:, None]), position))
    return np.unique(np.array(maps).reshape(-1, 3, 4), axis=0)


def is_lit(
    points: Array, normals: Array, spot: Spot, boxes: Array, *, ellipsoids: Array = _NOTHING
) -> NDArray[np.bool_]:
    """Say which world points (n, 3) [m] are lit past the boxes of `boxes_of` and ellipsoids of `ellipsoids_of`: (n,).

    An ellipsoid does not shade points inside it.
    """
    out = np.empty(len(points), np.bool_)
    start, target = points + _CLEARANCE_M * normals, np.asarray(spot.position, float)
    _trace_boxes(start, target, boxes, out)
    if len(ellipsoids):
        _trace_ellipsoids(start, target, ellipsoids, out)
    return out


def _parts_in_world(posed: PosedBody) -> Iterator[tuple[Part, Array, Array]]:
    """Yield every part with its rotation (3, 3) and position (3,) [m] in the world."""
    for segment, R, t in zip(posed.model.segments, posed.R, posed.t, strict=True):
        for part in segment.parts:
            segment_from_part = part.segment_from_part
            rotation = R @ segment_from_part.rotation.as_matrix()
            yield part, rotation, R @ segment_from_part.translation + t


def _to_unit(unit_from_world: Array, position: Array) -> Array:
    return np.column_stack([unit_from_world, -unit_from_world @ position])


@kernel
def _trace_boxes(points, target, boxes, out):
    for i in range(len(points)):
        out[i] = True
        for b in range(len(boxes)):
            enter, leave = 0.0, 1.0  # the part of the ray from point to target that lies within all slabs so far
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


@kernel
def _trace_ellipsoids(points, target, ellipsoids, out):
    ends = np.empty((len(ellipsoids), 3))  # the target, in the frame of each ellipsoid
    for e in range(len(ellipsoids)):
        for k in range(3):
            ends[e, k] = ellipsoids[e, k, 3]
            for j in range(3):
                ends[e, k] += ellipsoids[e, k, j] * target[j]
    for i in range(len(points)):
        if not out[i]:
            continue
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        for e in range(len(ellipsoids)):
            inside, along, length2 = (
                -1.0,
                0.0,
                0.0,
            )  # |p|^2 - 1, p.d and |d|^2 of the point p and the ray d to the target
            for k in range(3):
                p = ellipsoids[e, k, 0] * x + ellipsoids[e, k, 1] * y + ellipsoids[e, k, 2] * z + ellipsoids[e, k, 3]
                d = ends[e, k] - p
                inside, along, length2 = inside + p * p, along + p * d, length2 + d * d
            if inside > 0 and along < 0 and -along < length2 and along * along > length2 * inside:
                out[i] = False
                break
