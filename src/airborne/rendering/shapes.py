"""Kernels that pose a body's shapes in the world and outline them in one view, in float64.

Every shape, ellipsoid or polygon, becomes one row of numbers for the same pixel loop (`rows.py`):

    w(u, v) = B (u, v, 1) + sqrt(alpha max(half(v)^2 - (u - mid(v))^2, 0))      inverse depth of the near surface
    n(u, v) = N (u, v, 1) - w g                                                outward normal, any positive length

For an ellipsoid (x - c)'M(x - c) = 1 in camera axes with g = M c and k = c'M c - 1: B = K^-T g / k, N = M K^-1, and the
outline is (u, v, 1) Q (u, v, 1)' >= 0 with Q = B B' - K^-T M K^-1 / k, alpha = -Q00. The near surface's height along
the ellipsoid's third axis a, as a share of that semi-axis, is a.K^-1 (u, v, 1) / w - a.c: `spans.py` cuts the rows of
an ellipsoid with a slab where it meets the slab's two heights. A polygon of the plane m.x = d has
B = K^-T m / d, alpha = 0, N = 0 and g = -m; where its shading is smooth, a triangle of corners X_i and normals n_i has
g = 0 and N = sum n_i (X_j x X_k)' K^-1 / det(X), the n_i weighted by nearness, times w. A row cuts a polygon between
its edges, each a half-plane of the image that the camera's centre and the edge span, so nothing has to be clipped where
corners lie behind the camera.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from airborne.body import SurfaceArrays
from airborne.kernels import kernel

_SEAM_PX = 1e-7  # polygons reach this far beyond their edges, so that no pixel falls between two of a mesh

# the 18 columns of a packed view: world to camera (R row by row, t), then the two rows of K^-1
_VIEW_T, VIEW_K = 9, 12
# columns of an outline (float64)
B_U, B_V, B_1, MID_V, MID_1, HALF_1, HALF_V, HALF_VV, NORMAL = 0, 1, 2, 3, 4, 5, 6, 7, 8
HEIGHT, CENTRE_HEIGHT, BEND, _OUTLINE_COLUMNS = 17, 20, 21, 22  # a.K^-1, a.c and alpha, for slabs
# columns of a surface (float32): what the pixel loop holds fixed along a span
ALPHA, W_STEP, N_STEP, G, COLOUR, ID, _SURFACE_COLUMNS = 0, 1, 2, 5, 8, 11, 12


class Shapes(NamedTuple):
    """One thread's workspace: e ellipsoids, then p polygons with c corners; s = e + p shapes."""

    centre: Any  # (e, 3) [m] world
    axes: Any  # (e, 3, 3) columns: world axes over semi-axes [1/m]
    corners: Any  # (c, 3) [m] world
    normals: Any  # (p, 3) world
    corner_normals: Any  # (c, 3) world, of smooth triangles
    outline: Any  # (s, _OUTLINE_COLUMNS)
    surface: Any  # (s, _SURFACE_COLUMNS) float32
    rows: Any  # (s, 2) first and last row covered, last < first where there is none
    slab: Any  # (e, 2) heights between which an ellipsoid exists, as shares of its third semi-axis
    is_cut: Any  # (e,) whether the slab leaves anything out
    edges: Any  # (c, 3) side (+1 lower bound, -1 upper bound, 0 a condition on the row), slope, offset


def new_shapes(geometry: SurfaceArrays) -> Shapes:
    """Allocate the workspace for a body and fill in what no pose changes."""
    e, p, c = len(geometry.ellipsoid_segment), len(geometry.polygon_segment), len(geometry.corners)
    surface = np.zeros((e + p, _SURFACE_COLUMNS), np.float32)
    parts = np.concatenate([geometry.ellipsoid_part, geometry.polygon_part])
    surface[:, COLOUR : COLOUR + 3] = geometry.colours[parts]
    surface[:, ID] = np.arange(e + p)
    slab = np.clip(geometry.ellipsoid_slab / geometry.ellipsoid_semi_axes[:, 2:], -2, 2)  # kernels know no infinity
    return Shapes(
        np.empty((e, 3)),
        np.empty((e, 3, 3)),
        np.empty((c, 3)),
        np.empty((p, 3)),
        np.empty((c, 3)),
        np.zeros((e + p, _OUTLINE_COLUMNS)),
        surface,
        np.empty((e + p, 2), np.int64),
        slab,
        (slab[:, 0] > -1) | (slab[:, 1] < 1),
        np.empty((c, 3)),
    )


@kernel(fastmath=True, is_inner=True)
def pose_shapes(shapes, geometry, R, t):
    """Pose the shapes in the world by the segments' R (s, 3, 3) and t (s, 3) [m]."""
    for e in range(len(geometry.ellipsoid_segment)):
        segment = geometry.ellipsoid_segment[e]
        for i in range(3):
            a, b, c = R[segment, i, 0], R[segment, i, 1], R[segment, i, 2]
            centre, axes = geometry.ellipsoid_centre[e], geometry.ellipsoid_axes[e]
            shapes.centre[e, i] = a * centre[0] + b * centre[1] + c * centre[2] + t[segment, i]
            for j in range(3):
                length = geometry.ellipsoid_semi_axes[e, j]
                shapes.axes[e, i, j] = (a * axes[0, j] + b * axes[1, j] + c * axes[2, j]) / length
    if len(geometry.corner_normals):
        _pose_corner_normals(shapes, geometry, R)
    for p in range(len(geometry.polygon_segment)):
        segment = geometry.polygon_segment[p]
        for i in range(3):
            a, b, c = R[segment, i, 0], R[segment, i, 1], R[segment, i, 2]
            normal = geometry.normals[p]
            shapes.normals[p, i] = a * normal[0] + b * normal[1] + c * normal[2]
            for k in range(geometry.start[p], geometry.start[p + 1]):
                corner = geometry.corners[k]
                shapes.corners[k, i] = a * corner[0] + b * corner[1] + c * corner[2] + t[segment, i]


@kernel(fastmath=True, is_inner=True)
def _pose_corner_normals(shapes, geometry, R):
    """Rotate the corner normals of smooth triangles to the world."""
    for p in range(len(geometry.is_smooth)):
        if geometry.is_smooth[p]:
            segment = geometry.polygon_segment[p]
            for k in range(geometry.start[p], geometry.start[p + 1]):
                x, y, z = geometry.corner_normals[k, 0], geometry.corner_normals[k, 1], geometry.corner_normals[k, 2]
                for i in range(3):
                    shapes.corner_normals[k, i] = R[segment, i, 0] * x + R[segment, i, 1] * y + R[segment, i, 2] * z


@kernel(fastmath=True, is_inner=True)
def outline_all(shapes, geometry, view, width, height):
    """Outline every posed shape in a view of `width` pixels a row and `height` rows."""
    n_ellipsoids = len(geometry.ellipsoid_segment)
    for s in range(len(shapes.rows)):
        if s < n_ellipsoids:
            is_visible = _outline_ellipsoid(
                shapes.centre[s], shapes.axes[s], shapes.outline[s], shapes.surface[s], shapes.rows[s], view, height
            )
        else:
            p = s - n_ellipsoids
            is_visible = _outline_polygon(shapes, s, p, geometry.start[p], geometry.start[p + 1], view, height)
        if not is_visible:
            shapes.rows[s, 0] = 0
            shapes.rows[s, 1] = -1
    if len(geometry.corner_normals):
        _shade_smoothly(shapes, geometry, view)


@kernel(fastmath=True, is_inner=True)
def _rotate(view, x, y, z):
    return (
        view[0] * x + view[1] * y + view[2] * z,
        view[3] * x + view[4] * y + view[5] * z,
        view[6] * x + view[7] * y + view[8] * z,
    )


@kernel(fastmath=True, is_inner=True)
def _outline_ellipsoid(centre, axes, outline, surface, rows, view, height):
    """Outline one ellipsoid; False where it reaches the camera's plane, or no row meets it."""
    m00 = m01 = m02 = m11 = m12 = m22 = a = b = c = 0.0
    for j in range(3):
        a, b, c = _rotate(view, axes[0, j], axes[1, j], axes[2, j])
        m00 += a * a
        m01 += a * b
        m02 += a * c
        m11 += b * b
        m12 += b * c
        m22 += c * c
    cx, cy, cz = _rotate(view, centre[0], centre[1], centre[2])
    cx, cy, cz = cx + view[_VIEW_T], cy + view[_VIEW_T + 1], cz + view[_VIEW_T + 2]
    g0, g1, g2 = m00 * cx + m01 * cy + m02 * cz, m01 * cx + m11 * cy + m12 * cz, m02 * cx + m12 * cy + m22 * cz
    k = g0 * cx + g1 * cy + g2 * cz - 1
    if k <= 0 or cz <= 0:
        return False
    k00, k01, k02 = view[VIEW_K], view[VIEW_K + 1], view[VIEW_K + 2]
    k10, k11, k12 = view[VIEW_K + 3], view[VIEW_K + 4], view[VIEW_K + 5]
    n00, n01, n02 = m00 * k00 + m01 * k10, m00 * k01 + m01 * k11, m00 * k02 + m01 * k12 + m02
    n10, n11, n12 = m01 * k00 + m11 * k10, m01 * k01 + m11 * k11, m01 * k02 + m11 * k12 + m12
    n20, n21, n22 = m02 * k00 + m12 * k10, m02 * k01 + m12 * k11, m02 * k02 + m12 * k12 + m22
    b0, b1, b2 = (k00 * g0 + k10 * g1) / k, (k01 * g0 + k11 * g1) / k, (k02 * g0 + k12 * g1 + g2) / k
    q00, q01 = b0 * b0 - (k00 * n00 + k10 * n10) / k, b0 * b1 - (k00 * n01 + k10 * n11) / k
    q02 = b0 * b2 - (k00 * n02 + k10 * n12) / k
    q11, q12 = b1 * b1 - (k01 * n01 + k11 * n11) / k, b1 * b2 - (k01 * n02 + k11 * n12) / k
    q22 = b2 * b2 - (k02 * n02 + k12 * n12 + n22) / k
    if q00 >= 0:
        return False
    mid_v, mid_1 = -q01 / q00, -q02 / q00
    half_vv, half_v, half_1 = -(q11 + q01 * mid_v) / q00, -2 * (q12 + q01 * mid_1) / q00, -(q22 + q02 * mid_1) / q00
    discriminant = half_v * half_v - 4 * half_vv * half_1
    if half_vv >= 0 or discriminant <= 0:
        return False
    root = math.sqrt(discriminant)
    rows[0] = math.ceil(min(max((-half_v + root) / (2 * half_vv), 0.0), float(height)))
    rows[1] = math.floor(max(min((-half_v - root) / (2 * half_vv), height - 1.0), -1.0))
    outline[B_U], outline[B_V], outline[B_1] = b0, b1, b2
    outline[MID_V], outline[MID_1] = mid_v, mid_1
    outline[HALF_1], outline[HALF_V], outline[HALF_VV] = half_1, half_v, half_vv
    outline[NORMAL], outline[NORMAL + 1], outline[NORMAL + 2] = n00, n01, n02
    outline[NORMAL + 3], outline[NORMAL + 4], outline[NORMAL + 5] = n10, n11, n12
    outline[NORMAL + 6], outline[NORMAL + 7], outline[NORMAL + 8] = n20, n21, n22
    outline[HEIGHT], outline[HEIGHT + 1] = k00 * a + k10 * b, k01 * a + k11 * b  # a, b, c: still the third axis
    outline[HEIGHT + 2], outline[CENTRE_HEIGHT] = k02 * a + k12 * b + c, a * cx + b * cy + c * cz
    outline[BEND] = -q00
    surface[ALPHA], surface[W_STEP] = -q00, b0
    surface[N_STEP], surface[N_STEP + 1], surface[N_STEP + 2] = n00, n10, n20
    surface[G], surface[G + 1], surface[G + 2] = g0, g1, g2
    return True


@kernel(fastmath=True, is_inner=True, inline="always")
def _outline_polygon(shapes, s, p, start, stop, view, height):
    """Outline one convex polygon; False where it faces away, or no row meets it."""
    m0, m1, m2 = _rotate(view, shapes.normals[p, 0], shapes.normals[p, 1], shapes.normals[p, 2])
    low, high, is_in_front, d = float(height), -1.0, True, 0.0
    for i in range(start, stop):
        x, y, z = _in_camera(view, shapes.corners[i])
        d += (m0 * x + m1 * y + m2 * z) / (stop - start)
        if z > 1e-9:
            v = _row_of(view, x / z, y / z)
            low, high = min(low, v), max(high, v)
        else:
            is_in_front = False
    if d >= -1e-12:
        return False
    if not is_in_front:
        low, high = 0.0, height - 1.0
    shapes.rows[s, 0] = math.ceil(max(low - _SEAM_PX, 0.0))
    shapes.rows[s, 1] = math.floor(min(high + _SEAM_PX, height - 1.0))
    k00, k01, k02 = view[VIEW_K], view[VIEW_K + 1], view[VIEW_K + 2]
    k10, k11, k12 = view[VIEW_K + 3], view[VIEW_K + 4], view[VIEW_K + 5]
    for i in range(start, stop):
        x, y, z = _in_camera(view, shapes.corners[i])
        x1, y1, z1 = _in_camera(view, shapes.corners[i + 1 if i + 1 < stop else start])
        x2, y2, z2 = _in_camera(view, shapes.corners[start + (i + 2 - start) % (stop - start)])
        e0, e1, e2 = y * z1 - z * y1, z * x1 - x * z1, x * y1 - y * x1
        side = math.copysign(1.0, e0 * x2 + e1 * y2 + e2 * z2)  # inside is where the next corner lies
        a, b, c = side * (k00 * e0 + k10 * e1), side * (k01 * e0 + k11 * e1), side * (k02 * e0 + k12 * e1 + e2)
        edge = shapes.edges[i]
        if a == 0:
            edge[0], edge[1], edge[2] = 0.0, b, c + _SEAM_PX * abs(b)
        else:
            edge[0], edge[1], edge[2] = math.copysign(1.0, a), -b / a, -c / a - math.copysign(_SEAM_PX, a)
    outline, surface = shapes.outline[s], shapes.surface[s]
    outline[B_U], outline[B_V] = (k00 * m0 + k10 * m1) / d, (k01 * m0 + k11 * m1) / d
    outline[B_1] = (k02 * m0 + k12 * m1 + m2) / d
    surface[W_STEP] = outline[B_U]
    surface[G], surface[G + 1], surface[G + 2] = -m0, -m1, -m2
    return True


@kernel(fastmath=True, is_inner=True)
def _shade_smoothly(shapes, geometry, view):
    """Let the normals of smooth triangles go over from corner to corner; one loop, for calls copy all of `shapes`."""
    n_ellipsoids, normals = len(geometry.ellipsoid_segment), shapes.corner_normals
    k00, k01, k02 = view[VIEW_K], view[VIEW_K + 1], view[VIEW_K + 2]
    k10, k11, k12 = view[VIEW_K + 3], view[VIEW_K + 4], view[VIEW_K + 5]
    for p in range(len(geometry.is_smooth)):
        s, start = n_ellipsoids + p, geometry.start[p]
        if not geometry.is_smooth[p] or shapes.rows[s, 1] < shapes.rows[s, 0]:
            continue
        outline, surface = shapes.outline[s], shapes.surface[s]
        for n in range(NORMAL, NORMAL + 9):
            outline[n] = 0.0
        for i in range(3):
            x, y, z = _in_camera(view, shapes.corners[start + (i + 1) % 3])
            x1, y1, z1 = _in_camera(view, shapes.corners[start + (i + 2) % 3])
            e0, e1, e2 = y * z1 - z * y1, z * x1 - x * z1, x * y1 - y * x1
            x, y, z = _in_camera(view, shapes.corners[start + i])
            det = e0 * x + e1 * y + e2 * z
            a, b, c = (k00 * e0 + k10 * e1) / det, (k01 * e0 + k11 * e1) / det, (k02 * e0 + k12 * e1 + e2) / det
            normal = _rotate(view, normals[start + i, 0], normals[start + i, 1], normals[start + i, 2])
            for j in range(3):
                outline[NORMAL + 3 * j] += normal[j] * a
                outline[NORMAL + 3 * j + 1] += normal[j] * b
                outline[NORMAL + 3 * j + 2] += normal[j] * c
        for j in range(3):
            surface[N_STEP + j], surface[G + j] = outline[NORMAL + 3 * j], 0.0


@kernel(fastmath=True, is_inner=True)
def _in_camera(view, point):
    x, y, z = _rotate(view, point[0], point[1], point[2])
    return x + view[_VIEW_T], y + view[_VIEW_T + 1], z + view[_VIEW_T + 2]


@kernel(fastmath=True, is_inner=True)
def _row_of(view, x, y):
    """Return the row v of the ray (x, y, 1): the second unknown of K^-1 (u, v, 1) = (x, y, 1)."""
    k00, k01, k10, k11 = view[VIEW_K], view[VIEW_K + 1], view[VIEW_K + 3], view[VIEW_K + 4]
    return (k00 * (y - view[VIEW_K + 5]) - k10 * (x - view[VIEW_K + 2])) / (k00 * k11 - k01 * k10)
