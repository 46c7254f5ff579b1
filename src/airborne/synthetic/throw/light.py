"""Spot lights, and what they give to a surface: linear light, where 1 is the brightest that a camera records."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.body import Box, Ellipsoid, Part, PosedBody
from airborne.kernels import kernel

Array = NDArray[np.floating]

_CLEARANCE_M = 1e-3  # a surface is no obstacle to itself
_CORE = (
    0.93  # share of an ellipsoid's size that blocks light: a smooth skin lies partly inside the ellipsoid it is over
)
_NOTHING = np.zeros((0, 3, 4))


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


DARK = Ambient(np.zeros(3), np.zeros(3))


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
        for part, turn, place in _placed(posed):
            if isinstance(part.shape, Box):
                maps.append(_to_unit(2 * turn.T / part.shape.size_m[:, None], place))
    return np.array(maps).reshape(-1, 3, 4)


def balls_of(*bodies: PosedBody) -> Array:
    """Return the cores of bodies' ellipsoids, 0.93 of their size, as maps (e, 3, 4) from the world to the unit ball.

    Ellipsoids that are cut count as whole ones.
    """
    maps = []
    for posed in bodies:
        for part, turn, place in _placed(posed):
            if isinstance(part.shape, Ellipsoid):
                maps.append(_to_unit(turn.T / (_CORE * part.shape.semi_axes_m[:, None]), place))
    return np.unique(np.array(maps).reshape(-1, 3, 4), axis=0)


def is_lit(points: Array, normals: Array, spot: Spot, boxes: Array, balls: Array = _NOTHING) -> NDArray[np.bool_]:
    """Say which world points (n, 3) [m] see the spot past the boxes of `boxes_of` and balls of `balls_of`: (n,).

    A ball does not darken points inside it.
    """
    out = np.empty(len(points), np.bool_)
    start, target = points + _CLEARANCE_M * normals, np.asarray(spot.position, float)
    _see(start, target, boxes, out)
    if len(balls):
        _see_past_balls(start, target, balls, out)
    return out


def _placed(posed: PosedBody) -> Iterator[tuple[Part, Array, Array]]:
    """Give every part with its turn (3, 3) and place (3,) [m] in the world."""
    for segment, R, t in zip(posed.model.segments, posed.R, posed.t, strict=True):
        for part in segment.parts:
            place = part.segment_from_part
            yield part, R @ place.rotation.as_matrix(), R @ place.translation + t


def _to_unit(unit_from_world: Array, place: Array) -> Array:
    return np.column_stack([unit_from_world, -unit_from_world @ place])


@kernel
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


@kernel
def _see_past_balls(points, target, balls, out):
    ends = np.empty((len(balls), 3))  # the target, as each ball sees it
    for e in range(len(balls)):
        for k in range(3):
            ends[e, k] = balls[e, k, 3]
            for j in range(3):
                ends[e, k] += balls[e, k, j] * target[j]
    for i in range(len(points)):
        if not out[i]:
            continue
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        for e in range(len(balls)):
            inside, along, way = -1.0, 0.0, 0.0  # |p|^2 - 1, p.d and |d|^2 of the point p and the way d to the target
            for k in range(3):
                p = balls[e, k, 0] * x + balls[e, k, 1] * y + balls[e, k, 2] * z + balls[e, k, 3]
                d = ends[e, k] - p
                inside, along, way = inside + p * p, along + p * d, way + d * d
            if inside > 0 and along < 0 and -along < way and along * along > way * inside:
                out[i] = False
                break
