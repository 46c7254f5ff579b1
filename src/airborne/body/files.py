"""Body files: TOML with segments, joints, coloured parts, masses and landmarks; meshes beside it, OBJ, PLY or STL."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body.limits import FREE, JointLimits
from airborne.body.mesh_files import read_mesh
from airborne.body.model import WHOLE, BodyModel, Box, Ellipsoid, Inertia, Landmark, Mesh, Part, Segment, Shape
from airborne.errors import BodyError, one_line
from airborne.geometry.rotations import angles_from_matrix, matrix_from_angles
from airborne.io.names import CheckedPath
from airborne.io.text import list_keys, read_toml
from airborne.io.writing import write_text

_Vector = Annotated[list[float], Field(min_length=3, max_length=3)]
_Coordinate = Annotated[float, Field(ge=-1000, le=1000)]  # [m]: a typing error beyond it
_Position = Annotated[list[_Coordinate], Field(min_length=3, max_length=3)]
_Matrix = Annotated[list[_Vector], Field(min_length=3, max_length=3)]
_Bound = Annotated[float, Field(allow_inf_nan=True)]  # inf: no bound
_Range = Annotated[list[_Bound], Field(min_length=2, max_length=2)]
_HalfRange = Annotated[float, Field(ge=0, allow_inf_nan=True)]  # inf: no bound
_Channel = Annotated[float, Field(ge=0, le=255)]


_SAME_ROTATION = 1e-15  # rounding of a rotation matrix
_LARGEST_KG_M2 = 1e6  # of a moment of inertia: a typing error beyond it


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)


class _PartTable(_Strict):
    name: str
    shape: Literal["box", "ellipsoid", "mesh"]
    size_m: _Vector | None = None
    semi_axes_m: _Vector | None = None
    file: CheckedPath | None = None
    scale: float = Field(1.0, gt=0)  # metres per unit of the mesh file
    centre_m: _Position = [0.0, 0.0, 0.0]
    rotation_deg: _Vector = [0.0, 0.0, 0.0]  # about the segment's x, then the new y, then the new z
    colour_srgb: Annotated[list[_Channel], Field(min_length=3, max_length=3)] | None = None
    colour: Literal["sample"] | None = None
    slab_m: _Range | None = None  # along the part's own z


class _InertiaTable(_Strict):
    mass_kg: float = Field(gt=0)
    centre_m: _Position
    tensor_kg_m2: _Matrix


class _LandmarkTable(_Strict):
    name: str
    segment: str
    position_m: _Position = [0.0, 0.0, 0.0]
    is_joint: bool = False


class _LimitsTable(_Strict):
    swing: Literal["ellipse", "rectangle"]
    centre_deg: _Vector = [0.0, 0.0, 0.0]  # about x, then the new y, then the new z
    half_deg: Annotated[list[_HalfRange], Field(min_length=3, max_length=3)]  # swing about x and y, twist


class _SegmentTable(_Strict):
    name: str
    parent: str | None = None
    joint_m: _Position = [0.0, 0.0, 0.0]
    limits: _LimitsTable | None = None
    limits_deg: Annotated[list[_Range], Field(min_length=3, max_length=3)] | None = None  # x-y-z angles; older files
    part: list[_PartTable] = []
    inertia: _InertiaTable | None = None


class _BodyTable(_Strict):
    name: str
    segment: Annotated[list[_SegmentTable], Field(min_length=1)]
    landmark: list[_LandmarkTable] = []


def read_body(path: Path) -> BodyModel:
    """Read a body file; raises BodyError, naming the file and what is wrong, for anything unusable."""
    table = _read_table(path)
    segments = tuple(_segment(segment, path) for segment in table.segment)
    landmarks = tuple(
        Landmark(mark.name, mark.segment, np.array(mark.position_m), mark.is_joint) for mark in table.landmark
    )
    try:
        return BodyModel(table.name, segments, landmarks)
    except BodyError as error:
        raise BodyError(f"{path.name}: {error}") from error


def _read_table(path: Path) -> _BodyTable:
    try:
        document = read_toml(path)
        if "segment" not in document:
            raise BodyError(f"{path.name} is no body file: it has no [[segment]] (found {list_keys(document)})")
        return _BodyTable.model_validate(document)
    except OSError as error:
        raise BodyError(f"{path.name}: cannot be read ({error.strerror})") from error
    except tomllib.TOMLDecodeError as error:
        raise BodyError(f"{path.name}: not a TOML file: {error}; expected a body's [[segment]] tables") from error
    except ValidationError as error:
        raise BodyError(f"{path.name}: {one_line(error, document, _BodyTable)}") from error


def _segment(table: _SegmentTable, path: Path) -> Segment:
    parts = tuple(_part(part, path) for part in table.part)
    limits = _limits(table, f"{path.name}: segment '{table.name}'")
    inertia = None if table.inertia is None else _inertia(table.inertia, f"{path.name}: segment '{table.name}'")
    return Segment(table.name, table.parent, np.array(table.joint_m), parts, limits, inertia)


def _inertia(table: _InertiaTable, owner: str) -> Inertia:
    tensor = np.array(table.tensor_kg_m2)
    if np.abs(tensor).max() > _LARGEST_KG_M2:
        raise BodyError(f"{owner}: tensor_kg_m2 belongs to no body; expected kilograms times square metres")
    moments = np.linalg.eigvalsh((tensor + tensor.T) / 2)
    slack = 1e-6 * np.abs(tensor).max()
    if np.abs(tensor - tensor.T).max() > slack or moments[0] < -slack or moments[:2].sum() < moments[2] - slack:
        raise BodyError(
            f"{owner}: tensor_kg_m2 belongs to no solid; it must be symmetric, about the centre of mass, and no "
            "principal moment may exceed the sum of the other two"
        )
    return Inertia(table.mass_kg, np.array(table.centre_m), tensor)


def _limits(table: _SegmentTable, owner: str) -> JointLimits:
    if table.limits is not None and table.limits_deg is not None:
        raise BodyError(f"{owner}: limits and limits_deg say the same; leave limits_deg, the older one, out")
    if table.limits is not None:
        centre, half = np.radians(table.limits.centre_deg), np.radians(table.limits.half_deg)
        return JointLimits(matrix_from_angles(centre), half, np.asarray(table.limits.swing == "ellipse"))
    if table.limits_deg is None:
        return FREE
    ranges = np.radians(np.array(table.limits_deg))
    if not np.all(ranges[:, 0] <= ranges[:, 1]):
        raise BodyError(f"{owner}: each joint limit needs a least and a greatest angle")
    return JointLimits.from_angles(ranges)


def _part(table: _PartTable, path: Path) -> Part:
    if (table.colour_srgb is None) == (table.colour is None):
        raise BodyError(
            f"{path.name}: part '{table.name}' needs colour_srgb = [r, g, b] or colour = \"sample\", one of them"
        )
    segment_from_part = RigidTransform.from_components(
        table.centre_m, Rotation.from_euler("XYZ", table.rotation_deg, degrees=True)
    )
    colour = None if table.colour_srgb is None else np.array(table.colour_srgb)
    if colour is not None and np.max(colour) <= 1 and np.any(colour % 1):
        raise BodyError(f"{path.name}: part '{table.name}': colour_srgb looks like shares of 1; give 0 to 255")
    shape, slab = _shape(table, path), WHOLE if table.slab_m is None else (table.slab_m[0], table.slab_m[1])
    try:
        return Part(table.name, shape, segment_from_part, colour, slab)
    except BodyError as error:
        raise BodyError(f"{path.name}: {error}") from error


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
    return read_mesh(path.parent / value, table.scale)


def find_mesh_files(path: Path) -> list[str]:
    """Return the mesh files that a body file names, relative to it; raises BodyError for a file that cannot be read."""
    return [part.file for segment in _read_table(path).segment for part in segment.part if part.file is not None]


def write_body(path: Path, model: BodyModel) -> None:
    """Write a body file, and its meshes as OBJ beside it; `read_body` gives the same body back."""
    write_text(path, body_toml(model))
    for name, part in zip(_mesh_names(model), model.parts, strict=True):
        if isinstance(part.shape, Mesh):
            corners = [f"v {_join_numbers(corner)}" for corner in part.shape.vertices_m]
            faces = [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in part.shape.faces.tolist()]
            write_text(path.parent / name, "\n".join([*corners, *faces]) + "\n")


def body_toml(model: BodyModel) -> str:
    """Return the text of a body's file, numbers to the last digit; it names its meshes as `write_body` writes them."""
    lines = [f"name = {_text(model.name)}"]
    meshes = iter(_mesh_names(model))
    for segment in model.segments:
        lines += ["", "[[segment]]", f"name = {_text(segment.name)}"]
        if segment.parent is not None:
            lines += [f"parent = {_text(segment.parent)}", f"joint_m = {_numbers(segment.joint_m)}"]
        if segment.limits.is_limited:
            lines += ["", "[segment.limits]", *_limits_lines(segment.limits)]
        for part in segment.parts:
            lines += ["", "[[segment.part]]", f"name = {_text(part.name)}", *_part_lines(part, next(meshes))]
        if segment.inertia is not None:
            lines += [
                "",
                "[segment.inertia]",
                f"mass_kg = {float(segment.inertia.mass_kg)!r}",
                f"centre_m = {_numbers(segment.inertia.centre_m)}",
                f"tensor_kg_m2 = {_rows(segment.inertia.tensor_kg_m2)}",
            ]
    for mark in _own_landmarks(model):
        lines += ["", "[[landmark]]", f"name = {_text(mark.name)}", f"segment = {_text(mark.segment)}"]
        lines += [f"position_m = {_numbers(mark.position_m)}", *["is_joint = true"] * mark.is_joint]
    return "\n".join(lines) + "\n"


def _part_lines(part: Part, mesh_name: str) -> list[str]:
    if isinstance(part.shape, Box):
        lines = ['shape = "box"', f"size_m = {_numbers(part.shape.size_m)}"]
    elif isinstance(part.shape, Ellipsoid):
        lines = ['shape = "ellipsoid"', f"semi_axes_m = {_numbers(part.shape.semi_axes_m)}"]
    else:
        lines = ['shape = "mesh"', f"file = {_text(mesh_name)}"]
    segment_from_part = part.segment_from_part
    lines += [
        f"centre_m = {_numbers(segment_from_part.translation)}",
        *_rotation_lines(segment_from_part.rotation.as_matrix()),
    ]
    lines += ['colour = "sample"' if part.colour is None else f"colour_srgb = {_numbers(part.colour)}"]
    return lines + ([] if part.slab_m == WHOLE else [f"slab_m = {_numbers(part.slab_m)}"])


def _limits_lines(limits: JointLimits) -> list[str]:
    centre, half = (np.degrees(angles) for angles in (limits.centre_angles_rad, limits.half_rad))
    return [
        f'swing = "{"ellipse" if limits.is_ball else "rectangle"}"',
        f"centre_deg = {_numbers(_shortest(centre))}",
        f"half_deg = {_numbers(half.round(9))}",
    ]


def _rotation_lines(R: np.ndarray) -> list[str]:
    if np.array_equal(R, np.eye(3)):
        return []
    return [f"rotation_deg = {_numbers(_shortest(np.degrees(angles_from_matrix(R))))}"]


def _shortest(exact: np.ndarray) -> np.ndarray:
    """Return angles [deg] with nine decimals, where these give the same rotation."""
    short = exact.round(9) + 0.0  # no -0
    matrices = matrix_from_angles(np.radians([short, exact]))
    return short if np.abs(matrices[0] - matrices[1]).max() < _SAME_ROTATION else exact


def _mesh_names(model: BodyModel) -> list[str]:
    """Name a mesh file for every part, each its own: letters and digits of the part's name, and its index."""
    return [f"{re.sub(r'[^A-Za-z0-9]+', '_', part.name)[:40]}_{i}.obj" for i, part in enumerate(model.parts)]


def _own_landmarks(model: BodyModel) -> tuple[Landmark, ...]:
    """Return the landmarks; none where they are the segments' origins, the default of `BodyModel`."""
    origins = [(segment.name, segment.name, False) for segment in model.segments]
    own = [(mark.name, mark.segment, bool(np.any(mark.position_m))) for mark in model.landmarks]
    return () if own == origins else model.landmarks


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False)


def _numbers(values: ArrayLike) -> str:
    return "[" + ", ".join(repr(float(value)) for value in np.asarray(values)) + "]"


def _rows(values: Iterable[ArrayLike]) -> str:
    return "[" + ", ".join(map(_numbers, values)) + "]"


def _join_numbers(values: np.ndarray) -> str:
    return " ".join(repr(float(value)) for value in values)
