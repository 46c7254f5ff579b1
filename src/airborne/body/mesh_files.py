"""Mesh files: OBJ, PLY or STL by what they hold, within limits; a few bad edges are taken with a note."""

from __future__ import annotations

import logging
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from airborne.body.model import LONGEST_M, Mesh
from airborne.errors import BodyError
from airborne.io.text import read_bytes
from airborne.types import Array

logging.getLogger("trimesh").addHandler(logging.NullHandler())  # it would print a traceback for a damaged file
_LARGEST_BYTES = 50_000_000  # larger files are refused
_MOST_FACES = 200_000  # of a part: every hypothesis draws them
_STL_HEAD, _STL_FACET = 84, 50  # bytes of a binary STL: the head with the number of facets, and a facet
_MOST_BAD_EDGES = 0.02  # of a mesh's edges; with more, inside and outside cannot be told
_MOST_PLACES = 3  # of bad edges that a note names


def read_mesh(path: Path, scale: float) -> Mesh:
    """Read a mesh, lengths times scale [m]; raises BodyError for another kind of file, and for no closed surface."""
    import trimesh

    if not path.is_file():
        raise BodyError(f"mesh file {path.name} not found beside the body file")
    try:
        data = read_bytes(path, _LARGEST_BYTES)
    except ValueError:
        size_mb, most_mb = path.stat().st_size / 1e6, _LARGEST_BYTES / 1e6
        raise BodyError(f"{path.name}: {size_mb:.0f} MB, expected {most_mb:.0f} at most; reduce it") from None
    kind = _kind_of(data)
    if kind is None:
        raise BodyError(f"{path.name}: not an OBJ, PLY or STL mesh; convert it to one of them")
    _check_size(path, _count_faces(kind, data))
    try:
        with np.errstate(all="ignore"):
            mesh: Any = trimesh.load_mesh(BytesIO(data), file_type=kind, skip_materials=True)
            bad, volume = _bad_edges(mesh), mesh.volume
            vertices, faces = np.asarray(mesh.vertices, float) * scale, np.asarray(mesh.faces, np.int64)
    except Exception as error:  # trimesh raises whatever its parsers raise
        raise BodyError(f"{path.name}: not a readable {kind[:3].upper()} mesh; export it again") from error
    _check_size(path, len(faces))
    if not len(faces) or not np.all(np.isfinite(vertices)):
        raise BodyError(f"{path.name}: the mesh has no faces, or corners that are not numbers")
    n_edges = len(mesh.edges_unique)
    if len(bad) > _MOST_BAD_EDGES * n_edges:
        raise BodyError(
            f"{path.name}: the mesh is not closed, {len(bad)} of its {n_edges} edges do not have two faces; fill its "
            "holes, so that inside and outside can be told"
        )
    if (long_m := float(np.ptp(vertices, axis=0).max())) > LONGEST_M:
        units = {"millimetres": 0.001, "centimetres": 0.01, "inches": 0.0254}
        ways = ", or ".join(f"{scale} if it is in {unit} ({scale * long_m:.2g} m)" for unit, scale in units.items())
        raise BodyError(f"{path.name}: the mesh is {long_m:.3g} m long, over {LONGEST_M:.0f} m; give scale = {ways}")
    note = _bad_edges_note(path.name, vertices[bad].mean(axis=1), n_edges) if len(bad) else ""
    return Mesh(vertices, faces if volume >= 0 else faces[:, ::-1], note=note)


def _bad_edges(mesh: Any) -> NDArray[np.integer]:
    """Return the edges (n, 2), rows of the vertices, without exactly two faces; `mesh` is a `trimesh.Trimesh`."""
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


def _check_size(path: Path, n_faces: int) -> None:
    if n_faces > _MOST_FACES:
        raise BodyError(f"{path.name}: the mesh has {n_faces} faces, expected {_MOST_FACES} at most; reduce it")


def _kind_of(data: bytes) -> str | None:
    """Recognise a mesh by its bytes; None for any other file."""
    if data.startswith((b"ply\n", b"ply\r")):
        return "ply"
    if len(data) >= _STL_HEAD and len(data) == _STL_HEAD + _STL_FACET * _n_facets(data):
        return "stl"
    if data.lstrip().startswith(b"solid") and b"facet" in data:
        return "stl_ascii"
    words = {line.split(None, 1)[0] for line in data.splitlines() if line.strip()} if b"\0" not in data else set()
    return "obj" if {b"v", b"f"} <= words else None


def _n_facets(data: bytes) -> int:
    return int.from_bytes(data[80:84], "little")


def _count_faces(kind: str, data: bytes) -> int:
    """Return how many faces a file has, or declares, before it is parsed."""
    if kind == "stl":
        return _n_facets(data)
    if kind == "stl_ascii":
        return data.count(b"endfacet")
    if kind == "obj":
        return data.count(b"\nf ") + data.startswith(b"f ")
    declared = [line.split() for line in data[:10_000].splitlines() if line.startswith(b"element")]
    return max((int(words[2][:12]) for words in declared if len(words) == 3 and words[2].isdigit()), default=0)
