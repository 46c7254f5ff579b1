"""Mesh files: OBJ, PLY, STL; a few bad edges are taken with a note."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from airborne.body.model import LONGEST_M, Mesh
from airborne.errors import BodyError
from airborne.types import Array

_MOST_BAD_EDGES = 0.02  # of a mesh's edges; with more, inside and outside cannot be told
_MOST_PLACES = 3  # of bad edges that a note names


def read_mesh(path: Path, scale: float) -> Mesh:
    """Read a mesh, lengths times scale [m]; raises BodyError for one that is no closed surface."""
    if not path.is_file():
        raise BodyError(f"mesh file {path.name} not found beside the body file")
    try:
        with np.errstate(all="ignore"):
            mesh = trimesh.load_mesh(path)
            bad, volume = _bad_edges(mesh), mesh.volume
            vertices, faces = np.asarray(mesh.vertices, float) * scale, np.asarray(mesh.faces, np.int64)
    except Exception as error:  # trimesh raises whatever its parsers raise
        raise BodyError(f"{path.name}: not a readable OBJ, PLY or STL mesh ({error})") from error
    if not len(faces) or not np.all(np.isfinite(vertices)):
        raise BodyError(f"{path.name}: the mesh has no faces, or corners that are not numbers")
    n_edges = len(mesh.edges_unique)
    if len(bad) > _MOST_BAD_EDGES * n_edges:
        raise BodyError(
            f"{path.name}: the mesh is not closed, {len(bad)} of its {n_edges} edges do not have two faces; fill its "
            "holes, so that inside and outside can be told"
        )
    if np.ptp(vertices, axis=0).max() > LONGEST_M:
        raise BodyError(
            f"{path.name}: the mesh is over {LONGEST_M:.0f} m long; give scale = 0.001 if it is in millimetres"
        )
    note = _bad_edges_note(path.name, vertices[bad].mean(axis=1), n_edges) if len(bad) else ""
    return Mesh(vertices, faces if volume >= 0 else faces[:, ::-1], note=note)


def _bad_edges(mesh: trimesh.Trimesh) -> NDArray[np.integer]:
    """Return the edges (n, 2), rows of the vertices, that do not have exactly two faces."""
    counts = np.bincount(mesh.edges_unique_inverse, minlength=len(mesh.edges_unique))
    return mesh.edges_unique[counts != 2]


def _bad_edges_note(name: str, middles_m: Array, n_edges: int) -> str:
    """Say how many edges (n, 3) [m] are bad, and where some of them are."""
    places = [f"({x:.3f}, {y:.3f}, {z:.3f})" for x, y, z in middles_m[:_MOST_PLACES]]
    more = ", ..." if len(middles_m) > _MOST_PLACES else ""
    return (
        f"{name}: {len(middles_m)} of {n_edges} edges do not have two faces, at {', '.join(places)}{more} m; the mesh "
        "is taken as it is, with small holes there"
    )
