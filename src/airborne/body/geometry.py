"""A body's surface as flat arrays, in segment frames: what the renderer reads. Built once per body."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray

from airborne.body.model import BodyModel, Box, Ellipsoid, Mesh, Shape

Array = NDArray[np.floating]
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
_FLAT_RAD, _SHARP_RAD = 0.01, 0.5  # neighbouring faces turned by less are one side; by more, their edge is seen
_UNSAMPLED = np.full(3, 128.0)  # stands in for a colour not yet sampled


class Geometry(NamedTuple):
    """Ellipsoids and plane convex polygons, in the frames of their segments.

    Polygon p has the corners `corners[start[p]:start[p + 1]]`, counter-clockwise from outside.
    """

    ellipsoid_segment: Indices  # (e,)
    ellipsoid_part: Indices  # (e,) index into BodyModel.parts
    ellipsoid_centre: Array  # (e, 3) [m]
    ellipsoid_axes: Array  # (e, 3, 3) columns: unit axes
    ellipsoid_semi_axes: Array  # (e, 3) [m]
    polygon_segment: Indices  # (p,)
    polygon_part: Indices  # (p,)
    start: Indices  # (p + 1,)
    corners: Array  # (c, 3) [m]
    normals: Array  # (p, 3) outward unit normals
    colours: Array  # (parts, 3) sRGB 0..255


def geometry(model: BodyModel) -> Geometry:
    """Flatten a body's parts: boxes become six rectangles, meshes their triangles."""
    ellipsoids: list[tuple] = []
    polygons: list[tuple] = []
    part_index = 0
    for segment_index, segment in enumerate(model.segments):
        for part in segment.parts:
            place = part.segment_from_part
            ids = (segment_index, part_index)
            if isinstance(part.shape, Ellipsoid):
                ellipsoids.append((*ids, place.translation, place.rotation.as_matrix(), part.shape.semi_axes_m))
            else:
                polygons += [(*ids, place.apply(loop)) for loop in _loops(part.shape)]
            part_index += 1
    loops = [p[2] for p in polygons]
    return Geometry(
        ellipsoid_segment=np.array([e[0] for e in ellipsoids], np.int64),
        ellipsoid_part=np.array([e[1] for e in ellipsoids], np.int64),
        ellipsoid_centre=np.array([e[2] for e in ellipsoids], float).reshape(-1, 3),
        ellipsoid_axes=np.array([e[3] for e in ellipsoids], float).reshape(-1, 3, 3),
        ellipsoid_semi_axes=np.array([e[4] for e in ellipsoids], float).reshape(-1, 3),
        polygon_segment=np.array([p[0] for p in polygons], np.int64),
        polygon_part=np.array([p[1] for p in polygons], np.int64),
        start=np.cumsum([0] + [len(loop) for loop in loops], dtype=np.int64),
        corners=np.concatenate(loops) if loops else np.zeros((0, 3)),
        normals=np.array([_normal(loop) for loop in loops], float).reshape(-1, 3),
        colours=np.array([_UNSAMPLED if p.colour is None else p.colour for p in model.parts], float),
    )


def has_flat_sides(shape: Shape) -> bool:
    """Say whether the edges between a shape's sides can be seen: boxes, and meshes without a gently curved part."""
    if not isinstance(shape, Mesh):
        return isinstance(shape, Box)
    angles = trimesh.Trimesh(shape.vertices_m, shape.faces).face_adjacency_angles
    bends = angles[angles > _FLAT_RAD]
    return bool(len(bends) and np.all(bends > _SHARP_RAD))


def _loops(shape: Box | Mesh) -> list[Array]:
    if isinstance(shape, Box):
        corners = _BOX_CORNERS * shape.size_m
        return [corners[list(face)] for face in _BOX_FACES]
    triangles = shape.vertices_m[shape.faces]
    area = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
    return list(triangles[area > 0])


def _normal(loop: Array) -> Array:
    normal = np.cross(loop[1] - loop[0], loop[2] - loop[1])
    return normal / np.linalg.norm(normal)
