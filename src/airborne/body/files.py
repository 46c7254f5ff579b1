"""Body files: TOML with segments, joints and coloured parts; meshes beside it as OBJ, PLY or STL."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import trimesh
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body.model import LONGEST_M, BodyModel, Box, Ellipsoid, Mesh, Part, Segment, Shape
from airborne.errors import BodyError, one_line

Vector = Annotated[list[float], Field(min_length=3, max_length=3)]
Channel = Annotated[float, Field(ge=0, le=255)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class _PartTable(_Strict):
    name: str
    shape: Literal["box", "ellipsoid", "mesh"]
    size_m: Vector | None = None
    semi_axes_m: Vector | None = None
    file: str | None = None
    scale: float = Field(1.0, gt=0)  # metres per unit of the mesh file
    centre_m: Vector = [0.0, 0.0, 0.0]
    rotation_deg: Vector = [0.0, 0.0, 0.0]  # about the segment's x, then the new y, then the new z
    colour_srgb: Annotated[list[Channel], Field(min_length=3, max_length=3)] | None = None
    colour: Literal["sample"] | None = None


class _SegmentTable(_Strict):
    name: str
    parent: str | None = None
    joint_m: Vector = [0.0, 0.0, 0.0]
    part: list[_PartTable] = []


class _BodyTable(_Strict):
    name: str
    segment: Annotated[list[_SegmentTable], Field(min_length=1)]


def read_body(path: Path) -> BodyModel:
    """Read a body file; raises BodyError, naming the file and what is wrong, for anything unusable."""
    try:
        table = _BodyTable.model_validate(tomllib.loads(path.read_text(encoding="utf-8-sig")))
    except OSError as error:
        raise BodyError(f"{path.name}: cannot be read ({error.strerror})") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise BodyError(f"{path.name}: not a TOML file: {error}") from error
    except ValidationError as error:
        raise BodyError(f"{path.name}: {one_line(error)}") from error
    segments = tuple(_segment(segment, path) for segment in table.segment)
    try:
        return BodyModel(table.name, segments)
    except BodyError as error:
        raise BodyError(f"{path.name}: {error}") from error


def _segment(table: _SegmentTable, path: Path) -> Segment:
    parts = tuple(_part(part, path) for part in table.part)
    return Segment(table.name, table.parent, np.array(table.joint_m), parts)


def _part(table: _PartTable, path: Path) -> Part:
    if (table.colour_srgb is None) == (table.colour is None):
        raise BodyError(
            f"{path.name}: part '{table.name}' needs colour_srgb = [r, g, b] or colour = \"sample\", one of them"
        )
    place = RigidTransform.from_components(table.centre_m, Rotation.from_euler("XYZ", table.rotation_deg, degrees=True))
    colour = None if table.colour_srgb is None else np.array(table.colour_srgb)
    return Part(table.name, _shape(table, path), place, colour)


def _shape(table: _PartTable, path: Path) -> Shape:
    key = {"box": "size_m", "ellipsoid": "semi_axes_m", "mesh": "file"}[table.shape]
    value = getattr(table, key)
    if value is None:
        raise BodyError(f"{path.name}: part '{table.name}' is a {table.shape} and needs {key}")
    for other in {"size_m", "semi_axes_m", "file"} - {key}:
        if getattr(table, other) is not None:
            raise BodyError(f"{path.name}: part '{table.name}' is a {table.shape}; {other} does not belong to it")
    try:
        if table.shape == "box":
            return Box(np.array(value))
        if table.shape == "ellipsoid":
            return Ellipsoid(np.array(value))
    except BodyError as error:
        raise BodyError(f"{path.name}: part '{table.name}': {error}") from error
    if Path(value).is_absolute() or ".." in Path(value).parts:
        raise BodyError(
            f"{path.name}: part '{table.name}': mesh file {value} must lie beside the body file or below it"
        )
    return _mesh(path.parent / value, table.scale)


def _mesh(path: Path, scale: float) -> Mesh:
    if not path.is_file():
        raise BodyError(f"mesh file {path.name} not found beside the body file")
    try:
        mesh = trimesh.load_mesh(path)
        vertices, faces = np.asarray(mesh.vertices, float) * scale, np.asarray(mesh.faces, np.int64)
    except Exception as error:  # trimesh raises whatever its parsers raise
        raise BodyError(f"{path.name}: not a readable OBJ, PLY or STL mesh ({error})") from error
    if not len(faces) or not np.all(np.isfinite(vertices)):
        raise BodyError(f"{path.name}: the mesh has no faces, or corners that are not numbers")
    if not mesh.is_watertight:
        raise BodyError(f"{path.name}: the mesh is not closed; fill its holes, so that inside and outside can be told")
    if np.ptp(vertices, axis=0).max() > LONGEST_M:
        raise BodyError(
            f"{path.name}: the mesh is over {LONGEST_M:.0f} m long; give scale = 0.001 if it is in millimetres"
        )
    return Mesh(vertices, faces if mesh.volume >= 0 else faces[:, ::-1])


def mesh_files(path: Path) -> list[str]:
    """Return the mesh files that a readable body file names, relative to it."""
    table = _BodyTable.model_validate(tomllib.loads(path.read_text(encoding="utf-8-sig")))
    return [part.file for segment in table.segment for part in segment.part if part.file is not None]
