"""The parts of bodies as triangles: for model files and animations."""

from __future__ import annotations

import numpy as np
import trimesh

from airborne.body import Box, Ellipsoid, Mesh, Part
from airborne.body.splitting import faces_between, split_at
from airborne.types import Array

_AROUND, _ALONG = 48, 32  # facets of an ellipsoid
_UNSAMPLED = np.full(3, 128.0)  # sRGB, stands in for a colour not yet sampled


def part_mesh(part: Part) -> Mesh:
    """Tessellate a part, cut to its slab, in the part's own frame; smooth shapes come with normals."""
    if isinstance(part.shape, Mesh):
        return part.shape
    if isinstance(part.shape, Box):
        box = trimesh.creation.box(extents=part.shape.size_m)
        return Mesh(np.asarray(box.vertices), np.asarray(box.faces))
    mesh = _ellipsoid_mesh(part.shape)
    for border in part.slab_m:
        if np.isfinite(border):
            mesh = split_at(mesh, mesh.vertices_m[:, 2] - border)
    return faces_between(mesh, mesh.vertices_m[:, 2], *part.slab_m)


def _ellipsoid_mesh(shape: Ellipsoid) -> Mesh:
    sphere = trimesh.creation.uv_sphere(count=(_ALONG, _AROUND))
    unit, faces = np.asarray(sphere.vertices), np.asarray(sphere.faces)
    normals = unit / shape.semi_axes_m
    return Mesh(unit * shape.semi_axes_m, faces, normals / np.linalg.norm(normals, axis=1, keepdims=True))


def segment_mesh(part: Part) -> trimesh.Trimesh:
    """Return a part's mesh in its segment's frame; each face of a flat part has its own corners, for sharp edges."""
    mesh, segment_from_part = part_mesh(part), part.segment_from_part
    if mesh.normals is None:
        vertices, faces = mesh.vertices_m[mesh.faces].reshape(-1, 3), np.arange(mesh.faces.size).reshape(-1, 3)
        return trimesh.Trimesh(segment_from_part.apply(vertices), faces, process=False)
    normals = segment_from_part.rotation.apply(mesh.normals)
    return trimesh.Trimesh(segment_from_part.apply(mesh.vertices_m), mesh.faces, vertex_normals=normals, process=False)


def part_colour(part: Part) -> Array:
    """Return a part's colour, sRGB 0..255; grey where it is still to be sampled."""
    return _UNSAMPLED if part.colour is None else part.colour
