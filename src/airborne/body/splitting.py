"""Cutting triangle meshes along planes, so that each side can have its own colour."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from airborne.body.model import Mesh
from airborne.types import Array

_ON_CUT_M = 1e-9  # rounding: vertices this near to the cut lie on it


def split_at(mesh: Mesh, heights_m: Array) -> Mesh:
    """Cut the faces where a height passes zero: (v,), one a vertex, linear between [m].

    The vertices are the old ones and those on the cut edges, so that a closed mesh stays closed; faces turn as before.
    Vertices within a nanometre of zero lie on the cut.
    """
    sides = np.sign(np.where(np.abs(heights_m) < _ON_CUT_M, 0, heights_m)).astype(int)[mesh.faces]
    is_cut = (sides.min(axis=1) < 0) & (sides.max(axis=1) > 0)
    if not is_cut.any():
        return mesh
    crossed, sides = mesh.faces[is_cut], sides[is_cut]
    is_lone = sides * np.sign(sides.sum(axis=1, keepdims=True)) < 0  # the one corner on its side
    is_lone = np.where((sides == 0).any(axis=1, keepdims=True), sides > 0, is_lone)
    order = (np.argmax(is_lone, axis=1)[:, None] + np.arange(3)) % 3
    lone, second, third = np.take_along_axis(crossed, order, axis=1).T
    is_on_cut = np.take_along_axis(sides == 0, order, axis=1)
    pairs = np.concatenate([np.stack([lone, second], axis=1), np.stack([lone, third], axis=1)])
    edges, which = np.unique(np.sort(pairs, axis=1), axis=0, return_inverse=True)
    low, high = heights_m[edges].T
    share = (low / (low - high))[:, None]
    at_second, at_third = (len(mesh.vertices_m) + which.ravel()).reshape(2, -1)
    at_second, at_third = np.where(is_on_cut[:, 1], second, at_second), np.where(is_on_cut[:, 2], third, at_third)
    pieces = [
        np.stack([lone, at_second, at_third], axis=1),
        np.stack([at_second, second, at_third], axis=1)[~is_on_cut[:, 1]],
        np.stack([second, third, at_third], axis=1)[~is_on_cut[:, 2]],
    ]
    normals = mesh.normals
    if normals is not None:
        between_ends = _along(normals, edges, share)
        normals = np.concatenate([normals, between_ends / np.linalg.norm(between_ends, axis=1, keepdims=True)])
    vertices = np.concatenate([mesh.vertices_m, _along(mesh.vertices_m, edges, share)])
    return Mesh(vertices, np.concatenate([mesh.faces[~is_cut], *pieces]), normals)


def faces_between(mesh: Mesh, heights_m: Array, low_m: float, high_m: float) -> Mesh:
    """Keep the faces whose middle lies at a height of `low_m` to `high_m`, and the vertices they need."""
    middle = heights_m[mesh.faces].mean(axis=1)
    vertices, faces = np.unique(mesh.faces[(middle >= low_m) & (middle <= high_m)], return_inverse=True)
    normals = None if mesh.normals is None else mesh.normals[vertices]
    return replace(mesh, vertices_m=mesh.vertices_m[vertices], faces=faces.reshape(-1, 3), normals=normals)


def _along(values: Array, edges: NDArray[np.integer], share: Array) -> Array:
    return values[edges[:, 0]] + share * (values[edges[:, 1]] - values[edges[:, 0]])
