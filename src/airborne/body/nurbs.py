"""Rational B-spline surfaces (NURBS), closed around, and lofts through stadium sections (Yeadon 1990-II)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from airborne.body.model import Mesh
from airborne.errors import BodyError
from airborne.types import Array

# a stadium from the middle of its lower straight side, counter-clockwise, as multiples of (half flat, radius)
_FLAT = np.array([0, 0.5, 1, 1, 1, 1, 1, 0, -1, -1, -1, -1, -1, -0.5, 0])
# see above: multiples of the radius, along the straight sides
_ACROSS = np.array([0, 0, 0, 1, 1, 1, 0, 0, 0, -1, -1, -1, 0, 0, 0])
# see above: multiples of the radius, across them
_DEEP = np.array([-1, -1, -1, -1, 0, 1, 1, 1, 1, 1, 0, -1, -1, -1, -1])
_STADIUM_WEIGHTS = np.where((_ACROSS != 0) & (_DEEP != 0), np.sqrt(0.5), 1.0)  # corners of quarter circles
_LEAST_FLAT, _LEAST_SPAN = 1e-6, 1e-3  # of the radius: a circle's straight sides, so that it has normals all around
_POINT_M = 1e-9  # [m] points closer than this are one
_OFF_POLE = 1e-6  # of the range of v


@dataclass(frozen=True, slots=True, eq=False)
class RationalSurface:
    """A rational B-spline surface S(u, v), u around it and v along it; `S_u x S_v` points outward.

    S = sum B_i(u) B_j(v) w_ij P_ij / sum B_i(u) B_j(v) w_ij. The first and the last control points around are the same.
    """

    degrees: tuple[int, int]
    knots: tuple[Array, Array]  # around (nu + degree + 1,), along (nv + degree + 1,)
    points_m: Array  # (nu, nv, 3) control points [m]
    weights: Array  # (nu, nv), above zero

    def __post_init__(self) -> None:
        around, along = self.weights.shape
        for name, knots, count, degree in zip(("u", "v"), self.knots, (around, along), self.degrees, strict=True):
            if len(knots) != count + degree + 1 or np.any(np.diff(knots) < 0):
                raise BodyError(
                    f"{len(knots)} knots in {name} for {count} control points of degree {degree}; expected "
                    f"{count + degree + 1}, none smaller than the one before"
                )
        if self.points_m.shape != (around, along, 3) or np.any(self.weights <= 0):
            raise BodyError(f"control points {self.points_m.shape}; expected {(around, along, 3)}, weights above zero")
        if not np.allclose(self.points_m[0], self.points_m[-1], rtol=0, atol=_POINT_M):
            raise BodyError("the first and last control points around differ; a surface must close around")

    def points(self, u: Array, v: Array) -> Array:
        """Return the points (len(u), len(v), 3) [m] over the grid of u and v."""
        homogeneous = self._homogeneous(u, v)
        return homogeneous[..., :3] / homogeneous[..., 3:]

    def normals(self, u: Array, v: Array) -> Array:
        """Return the outward unit normals (len(u), len(v), 3); where an end is a point, those close to it."""
        low, high = self.knots[1][self.degrees[1]], self.knots[1][-self.degrees[1] - 1]
        inside = np.clip(v, low + _OFF_POLE * (high - low), high - _OFF_POLE * (high - low))
        value = self._homogeneous(u, inside)
        points, weight = value[..., :3] / value[..., 3:], value[..., 3:]
        along_u, along_v = self._homogeneous(u, inside, (1, 0)), self._homogeneous(u, inside, (0, 1))
        tangent_u = (along_u[..., :3] - along_u[..., 3:] * points) / weight
        tangent_v = (along_v[..., :3] - along_v[..., 3:] * points) / weight
        normal = np.cross(tangent_u, tangent_v)
        return normal / np.linalg.norm(normal, axis=-1, keepdims=True)

    def mesh(self, n_around: int, n_along: int) -> Mesh:
        """Tessellate to a closed mesh of n_around x n_along points, shaded as smoothly as the surface is.

        Raises BodyError where an end is not a point.
        """
        u = np.linspace(self.knots[0][0], self.knots[0][-1], n_around, endpoint=False)
        v = np.linspace(self.knots[1][0], self.knots[1][-1], n_along)
        grid = self.points(u, v)
        for end in (grid[:, 0], grid[:, -1]):
            if np.ptp(end, axis=0).max() > _POINT_M:
                raise BodyError(f"an end of the surface is {np.ptp(end, axis=0).max():.3g} m wide; close it to a point")
        normals = self.normals(u, v)
        normals[:, [0, -1]] = normals[:, [0, -1]].mean(axis=0)  # at the tips, from all around
        vertices, normals = (
            np.concatenate([each[:1, 0], each[:, 1:-1].transpose(1, 0, 2).reshape(-1, 3), each[:1, -1]])
            for each in (grid, normals)
        )
        ring = 1 + np.arange(n_around * (n_along - 2)).reshape(n_along - 2, n_around)
        after = np.roll(ring, -1, axis=1)
        top = np.full(n_around, len(vertices) - 1)
        faces = [
            (np.zeros(n_around, int), after[0], ring[0]),
            (ring[:-1], after[:-1], after[1:]),
            (ring[:-1], after[1:], ring[1:]),
            (ring[-1], after[-1], top),
        ]
        faces = np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in faces])
        return Mesh(vertices, faces, normals / np.linalg.norm(normals, axis=1, keepdims=True))

    def _homogeneous(self, u: Array, v: Array, derivative: tuple[int, int] = (0, 0)) -> Array:
        """Return the derivative of (w x, w y, w z, w) over the grid: (len(u), len(v), 4)."""
        control = np.concatenate([self.points_m * self.weights[..., None], self.weights[..., None]], axis=-1)
        curves = BSpline(self.knots[0], control, self.degrees[0], axis=0)(u, nu=derivative[0])
        return BSpline(self.knots[1], curves, self.degrees[1], axis=1)(v, nu=derivative[1])


def stadium_loft(stations: Array) -> RationalSurface:
    """Loft a surface through stadium sections, exact at each: quadratic around, cubic along, by chord length.

    stations (n, 5), n >= 4 [m]: position along z, half the straight side (along x), radius (along y), the section's
    centre in x and y. A stadium is two half circles joined by straight lines; the section has width
    2 (half side + radius) and depth 2 radius. A section of radius 0 is a point.
    """
    stations = np.asarray(stations, float)
    along, flat, radius, x, y = stations.T
    if len(stations) < 4 or np.any(np.diff(along) <= 0) or np.any(stations[:, 1:3] < 0):
        raise BodyError("a loft needs four sections or more, one after the other, none of negative size")
    flat = np.maximum(flat, _LEAST_FLAT * radius)
    points = np.stack(
        [
            np.outer(_FLAT, flat) + np.outer(_ACROSS, radius) + x,
            np.outer(_DEEP, radius) + y,
            np.broadcast_to(along, (len(_FLAT), len(along))),
        ],
        axis=-1,
    )
    size = flat + radius
    chord = np.hypot(np.diff(along), np.diff(size))
    spline = make_interp_spline(np.concatenate([[0.0], np.cumsum(chord)]) / chord.sum(), points, k=3, axis=1)
    return RationalSurface(
        (2, 3),
        (_stadium_knots(flat.mean(), radius.mean()), spline.t),
        np.moveaxis(spline.c, 0, 1),
        np.repeat(_STADIUM_WEIGHTS[:, None], len(along), axis=1),
    )


def _stadium_knots(flat: float, radius: float) -> Array:
    """Return knots in proportion to the lengths of the straight sides and quarter circles."""
    flat, quarter = max(flat, _LEAST_SPAN * radius), np.pi * radius / 2
    breaks = np.cumsum([flat, quarter, quarter, 2 * flat, quarter, quarter, flat])
    inner = np.repeat(breaks[:-1] / breaks[-1], 2)
    return np.concatenate([np.zeros(3), inner, np.ones(3)])
