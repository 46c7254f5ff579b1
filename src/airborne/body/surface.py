"""A body's surface as flat arrays, in segment frames: what the renderer reads. Built once per body."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.body.model import BodyModel, Box, Ellipsoid, Mesh, Shape
from airborne.types import Array

Indices = NDArray[np.int64]

_BOX_CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
_BOX_FACES = [  # corners of each side, counter-clockwise from outside
    (0, 1, 3, 2),
    (4, 6, 7, 5),
    (0, 4, 5, 1),
    (2, 3, 7, 6),
    (0, 2, 6, 4),
    (1, 5, 7, 3),
]
_FLAT_RAD, _SHARP_RAD = 0.01, 0.5  # faces at a smaller angle are one side; at a larger one, their edge is visible
_NO_AREA = 1e-12  # twice a triangle's area over its longest side squared
_UNSAMPLED = np.full(3, 128.0)  # stands in for a colour not yet sampled


class SurfaceArrays(NamedTuple):
    """Ellipsoids, some cut to a slab, and plane convex polygons, in the frames of their segments.

    Polygon p has the corners `corners[start[p]:start[p + 1]]`, counter-clockwise from outside.
    """

    ellipsoid_segment: Indices  # (e,)
    ellipsoid_part: Indices  # (e,) index into BodyModel.parts
    ellipsoid_centre: Array  # (e, 3) [m]
    ellipsoid_axes: Array  # (e, 3, 3) columns: unit axes
    ellipsoid_semi_axes: Array  # (e, 3) [m]
    ellipsoid_slab: Array  # (e, 2) least and greatest height along the third axis [m], infinite where not cut
    polygon_segment: Indices  # (p,)
    polygon_part: Indices  # (p,)
    start: Indices  # (p + 1,)
    corners: Array  # (c, 3) [m]
    normals: Array  # (p, 3) outward unit normals
    is_smooth: NDArray[np.bool_]  # (p,) triangles whose shading is interpolated between corners
    corner_normals: Array  # (c, 3) outward unit normals there, of smooth triangles; zero elsewhere
    colours: Array  # (parts, 3) sRGB 0..255


def surface_arrays(model: BodyModel) -> SurfaceArrays:
    """Flatten a body's parts: boxes become six rectangles, meshes their triangles."""
    ellipsoids: list[tuple] = []
    polygons: list[tuple[int, int, Array, Array | None]] = []  # segment, part, corners and normals (p, k, 3)
    part_index = 0
    for segment_index, segment in enumerate(model.segments):
        for part in segment.parts:
            matrix = part.segment_from_part.as_matrix()
            axes, ids = matrix[:3, :3], (segment_index, part_index)
            if isinstance(part.shape, Ellipsoid):
                ellipsoids.append((*ids, matrix[:3, 3], axes, part.shape.semi_axes_m, part.slab_m))
            else:
                loops, normals = _polygons(part.shape)
                loops = part.segment_from_part.apply(loops.reshape(-1, 3)).reshape(loops.shape)
                polygons.append((*ids, loops, None if normals is None else normals @ axes.T))
            part_index += 1
    counts = [len(p[2]) for p in polygons]
    sizes = np.repeat([p[2].shape[1] for p in polygons], counts).astype(np.int64)
    return SurfaceArrays(
        ellipsoid_segment=np.array([e[0] for e in ellipsoids], np.int64),
        ellipsoid_part=np.array([e[1] for e in ellipsoids], np.int64),
        ellipsoid_centre=np.array([e[2] for e in ellipsoids], float).reshape(-1, 3),
        ellipsoid_axes=np.array([e[3] for e in ellipsoids], float).reshape(-1, 3, 3),
        ellipsoid_semi_axes=np.array([e[4] for e in ellipsoids], float).reshape(-1, 3),
        ellipsoid_slab=np.array([e[5] for e in ellipsoids], float).reshape(-1, 2),
        polygon_segment=np.repeat([p[0] for p in polygons], counts).astype(np.int64),
        polygon_part=np.repeat([p[1] for p in polygons], counts).astype(np.int64),
        start=np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
        corners=np.concatenate([np.zeros((0, 3)), *(p[2].reshape(-1, 3) for p in polygons)]),
        normals=np.concatenate([np.zeros((0, 3)), *(_normals(p[2]) for p in polygons)]),
        is_smooth=np.repeat([p[3] is not None for p in polygons], counts).astype(bool),
        corner_normals=np.concatenate(
            [np.zeros((0, 3)), *((np.zeros_like(p[2]) if p[3] is None else p[3]).reshape(-1, 3) for p in polygons)]
        ),
        colours=np.array([_UNSAMPLED if p.colour is None else p.colour for p in model.parts], float),
    )


def surface_of_segments(surface: SurfaceArrays, is_kept: NDArray[np.bool_]) -> SurfaceArrays:
    """Return what some segments show of a body's surface, is_kept (s,), numbered as before."""
    e, p = is_kept[surface.ellipsoid_segment], is_kept[surface.polygon_segment]
    sizes = np.diff(surface.start)
    c = np.repeat(p, sizes)
    ellipsoids = {name: getattr(surface, name)[e] for name in SurfaceArrays._fields if name.startswith("ellipsoid")}
    polygons = {name: getattr(surface, name)[p] for name in ("polygon_segment", "polygon_part", "normals", "is_smooth")}
    corners = {name: getattr(surface, name)[c] for name in ("corners", "corner_normals")}
    start = np.concatenate([[0], np.cumsum(sizes[p])]).astype(np.int64)
    return surface._replace(**ellipsoids, **polygons, **corners, start=start)


def has_flat_sides(shape: Shape) -> bool:
    """Say whether a shape's edges are visible: boxes, and meshes without a gently curved part."""
    if not isinstance(shape, Mesh):
        return isinstance(shape, Box)
    import trimesh  # here, as only meshes need it

    mesh: Any = trimesh.Trimesh(shape.vertices_m, shape.faces)  # its cached properties have no types
    angles = mesh.face_adjacency_angles
    angles_at_edges = angles[angles > _FLAT_RAD]
    return bool(len(angles_at_edges) and np.all(angles_at_edges > _SHARP_RAD))


def _polygons(shape: Box | Mesh) -> tuple[Array, Array | None]:
    """Return the polygons of a box or a mesh, (p, corners of each, 3) [m], and normals at their corners, if it has any.

    Triangles without area are left out.
    """
    if isinstance(shape, Box):
        return (_BOX_CORNERS * shape.size_m)[np.array(_BOX_FACES)], None
    triangles = shape.vertices_m[shape.faces]
    longest = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max(axis=1)
    has_area = np.linalg.norm(_crosses(triangles), axis=1) > _NO_AREA * longest**2
    return triangles[has_area], None if shape.normals is None else shape.normals[shape.faces[has_area]]


def _crosses(loops: Array) -> Array:
    return np.cross(loops[:, 1] - loops[:, 0], loops[:, 2] - loops[:, 1])


def _normals(loops: Array) -> Array:
    crosses = _crosses(loops)
    return crosses / np.linalg.norm(crosses, axis=1, keepdims=True)
