"""OpenSim models (.osim): a body as a chain of rigid bodies whose coordinates are our own angles.

OpenSim's ground has y up: its x, y, z are the world's y, z, x. Each body has x ahead, y toward the head and z to the
subject's right, as in OpenSim's own models. A CustomJoint
rotates about three axes in succession, R = R1 R2 R3, as our angles do.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from airborne.body import BodyModel, Box, Ellipsoid, Part, Segment
from airborne.constants import STANDARD_GRAVITY_M_S2
from airborne.export.part_meshes import part_colour
from airborne.export.takes import portable_names
from airborne.geometry.rotations import angles_from_matrix
from airborne.io.writing import replace_text
from airborne.types import Array

_DOCUMENT_VERSION = "40000"  # of the file format: OpenSim 4.0 and later
# OpenSim's ground: x along the world's y, y up, z along the world's x
GROUND_FROM_WORLD = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])
_BODY_FROM_SEGMENT = np.array([[0.0, -1, 0], [0, 0, 1], [-1, 0, 0]])  # its bodies: x ahead, y up, z to the right
_ROTATIONS = ("somersault", "tilt", "twist")
_ROTATION_RANGE_RAD = 20 * np.pi  # range of the root's rotations
_TRANSLATION_RANGE_M = 50.0  # range of the root's translations


def write_osim(path: Path, model: BodyModel) -> None:
    """Write a body as an OpenSim model: segments with their masses and ellipsoids, joints, markers at the landmarks.

    The root has the coordinates somersault, tilt, twist and `<root>_tx`, `_ty`, `_tz`, every other segment
    `<segment>_x`, `_y`, `_z`: successive rotations about our axes, filled by `write_mot`. A segment of unknown mass
    has mass 0, which does for kinematics. An angle whose least and greatest values agree is locked. Meshes are drawn
    as boxes around them.
    """
    document = ET.Element("OpenSimDocument", Version=_DOCUMENT_VERSION)
    root = ET.SubElement(document, "Model", name=portable_names([model.name])[0])
    ET.SubElement(root, "length_units").text = "meters"
    ET.SubElement(root, "force_units").text = "N"
    ET.SubElement(root, "gravity").text = f"0 {-STANDARD_GRAVITY_M_S2} 0"
    names = portable_names([segment.name for segment in model.segments])
    bodies, joints, markers = (_set(root, kind) for kind in ("BodySet", "JointSet", "MarkerSet"))
    for segment, name, parent in zip(model.segments, names, model.parents, strict=True):
        bodies.append(_body(segment, name))
        joints.append(_root_joint(name) if parent < 0 else _joint(segment, name, names[parent]))
    marks = portable_names([landmark.name for landmark in model.landmarks])
    for landmark, name in zip(model.landmarks, marks, strict=True):
        marker = ET.SubElement(markers, "Marker", name=name)
        owner = names[model.index_of(landmark.segment)]
        ET.SubElement(marker, "socket_parent_frame").text = f"/bodyset/{owner}"
        ET.SubElement(marker, "location").text = _numbers(_BODY_FROM_SEGMENT @ landmark.position_m)
        ET.SubElement(marker, "fixed").text = "true"
    ET.indent(document, "\t")
    text = ET.tostring(document, encoding="UTF-8", xml_declaration=True).decode()
    replace_text(path, f"{text}\n", is_durable=False)


def coordinate_names(model: BodyModel) -> list[str]:
    """Name the model's coordinates: the root's rotations and translations, then three angles a joint."""
    root, *others = portable_names([segment.name for segment in model.segments])
    return [
        *_ROTATIONS,
        *(f"{root}_t{axis}" for axis in "xyz"),
        *(f"{name}_{axis}" for name in others for axis in "xyz"),
    ]


def _set(root: ET.Element, kind: str) -> ET.Element:
    return ET.SubElement(ET.SubElement(root, kind, name=kind.lower()), "objects")


def _body(segment: Segment, name: str) -> ET.Element:
    body, mass, centre, tensor = ET.Element("Body", name=name), 0.0, np.zeros(3), np.zeros((3, 3))
    components = ET.SubElement(body, "components")
    for k, part in enumerate(_visible_parts(segment)):
        components.append(_geometry(part, f"{name}_part{k + 1}"))
    if segment.inertia is not None:
        mass, centre = segment.inertia.mass_kg, _BODY_FROM_SEGMENT @ segment.inertia.centre_m
        tensor = _BODY_FROM_SEGMENT @ segment.inertia.tensor_kg_m2 @ _BODY_FROM_SEGMENT.T
    ET.SubElement(body, "mass").text = _numbers([mass])
    ET.SubElement(body, "mass_center").text = _numbers(centre)
    ET.SubElement(body, "inertia").text = _numbers([*np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2]])
    return body


def _visible_parts(segment: Segment) -> list[Part]:
    """Return the parts to draw: of an ellipsoid cut into slabs of several colours, the longest slab."""
    best: dict[tuple, tuple[float, Part]] = {}
    for part in segment.parts:
        key, length_m = (id(part),), 0.0
        if isinstance(part.shape, Ellipsoid):
            segment_from_part, half = part.segment_from_part, float(part.shape.semi_axes_m[2])
            key = tuple(
                np.round(
                    [*part.shape.semi_axes_m, *segment_from_part.translation, *segment_from_part.as_matrix()[:3, 0]], 9
                )
            )
            length_m = min(part.slab_m[1], half) - max(part.slab_m[0], -half)
        if key not in best or length_m > best[key][0]:
            best[key] = (length_m, part)
    return [part for _, part in best.values()]


def _geometry(part: Part, name: str) -> ET.Element:
    shape, segment_from_part = part.shape, part.segment_from_part
    centre = np.zeros(3)
    if isinstance(shape, Ellipsoid):
        kind, key, sizes = "Ellipsoid", "radii", shape.semi_axes_m
    elif isinstance(shape, Box):
        kind, key, sizes = "Brick", "half_lengths", shape.size_m / 2
    else:
        low, high = shape.vertices_m.min(axis=0), shape.vertices_m.max(axis=0)
        kind, key, sizes, centre = "Brick", "half_lengths", (high - low) / 2, (high + low) / 2
    frame = ET.Element("PhysicalOffsetFrame", name=name)
    geometry = ET.SubElement(ET.SubElement(frame, "attached_geometry"), kind, name=f"{name}_shape")
    ET.SubElement(geometry, "socket_frame").text = ".."
    colour = ET.SubElement(ET.SubElement(geometry, "Appearance"), "color")
    colour.text = _numbers(part_colour(part) / 255)
    ET.SubElement(geometry, key).text = _numbers(sizes)
    rotation = _BODY_FROM_SEGMENT @ segment_from_part.rotation.as_matrix()  # the shape keeps its own axes
    _fix_frame(frame, "..", _BODY_FROM_SEGMENT @ segment_from_part.apply(centre), rotation)
    return frame


def _fix_frame(frame: ET.Element, parent: str, translation_m: Array, rotation: Array) -> None:
    """Fix a PhysicalOffsetFrame in its parent; OpenSim's orientation is a sequence about x, y and z."""
    ET.SubElement(frame, "socket_parent").text = parent
    ET.SubElement(frame, "translation").text = _numbers(translation_m)
    ET.SubElement(frame, "orientation").text = _numbers(angles_from_matrix(rotation))


class _Coordinate(NamedTuple):
    """A coordinate: its axis of rotation or translation, in the parent's axes, and its range [rad or m]."""

    name: str
    axis: Array
    low: float
    high: float


def _root_joint(name: str) -> ET.Element:
    """Return the joint of the root, with six degrees of freedom: R = Rx(somersault) Ry(tilt) Rz(twist), world axes."""
    rotations = [
        _Coordinate(angle, axis, -_ROTATION_RANGE_RAD, _ROTATION_RANGE_RAD)
        for angle, axis in zip(_ROTATIONS, GROUND_FROM_WORLD.T, strict=True)
    ]
    translations = [
        _Coordinate(f"{name}_t{axis}", e, -_TRANSLATION_RANGE_M, _TRANSLATION_RANGE_M)
        for axis, e in zip("xyz", np.eye(3), strict=True)
    ]
    joint, frames = _custom_joint(f"ground_{name}", [*rotations, *translations])
    half_turn = _BODY_FROM_SEGMENT @ GROUND_FROM_WORLD.T
    _fix_frame(frames[0], "/ground", np.zeros(3), np.eye(3))
    _fix_frame(frames[1], f"/bodyset/{name}", np.zeros(3), half_turn)
    return joint


def _joint(segment: Segment, name: str, parent: str) -> ET.Element:
    """Return a segment's joint: R = Rx Ry Rz about the parent's axes."""
    rotations = [
        _Coordinate(f"{name}_{letter}", axis, low, high)
        for letter, axis, (low, high) in zip("xyz", _BODY_FROM_SEGMENT.T, segment.limits.angle_ranges_rad, strict=True)
    ]
    joint, frames = _custom_joint(f"{name}_joint", rotations)
    _fix_frame(frames[0], f"/bodyset/{parent}", _BODY_FROM_SEGMENT @ segment.joint_m, np.eye(3))
    _fix_frame(frames[1], f"/bodyset/{name}", np.zeros(3), np.eye(3))
    return joint


def _custom_joint(name: str, dofs: Sequence[_Coordinate]) -> tuple[ET.Element, list[ET.Element]]:
    """Return a joint of three rotations and up to three translations, and its two frames, for parent and child."""
    joint = ET.Element("CustomJoint", name=name)
    ET.SubElement(joint, "socket_parent_frame").text = f"{name}_parent"
    ET.SubElement(joint, "socket_child_frame").text = f"{name}_child"
    coordinates = ET.SubElement(joint, "coordinates")
    for dof in dofs:
        coordinates.append(_coordinate_element(dof))
    within = ET.SubElement(joint, "frames")
    frames = [ET.SubElement(within, "PhysicalOffsetFrame", name=f"{name}_{end}") for end in ("parent", "child")]
    transform = ET.SubElement(joint, "SpatialTransform")
    fixed = [_Coordinate("", axis, 0, 0) for axis in np.eye(3)]
    for k, dof in enumerate([*dofs, *fixed][:6]):
        axis = ET.SubElement(transform, "TransformAxis", name=f"{'rotation' if k < 3 else 'translation'}{k % 3 + 1}")
        ET.SubElement(axis, "coordinates").text = dof.name
        ET.SubElement(axis, "axis").text = _numbers(dof.axis)
        if dof.name:
            function = ET.SubElement(axis, "LinearFunction", name="function")
            ET.SubElement(function, "coefficients").text = "1 0"
        else:
            ET.SubElement(ET.SubElement(axis, "Constant", name="function"), "value").text = "0"
    return joint, frames


def _coordinate_element(dof: _Coordinate) -> ET.Element:
    """Return a coordinate that may leave its range; one whose range is a single value is locked there."""
    is_locked = dof.low == dof.high
    low, high = (-np.pi, np.pi) if is_locked else (dof.low, dof.high)
    coordinate = ET.Element("Coordinate", name=dof.name)
    ET.SubElement(coordinate, "default_value").text = _numbers([dof.low if is_locked else 0.0])
    ET.SubElement(coordinate, "range").text = _numbers(np.clip([low, high], -_ROTATION_RANGE_RAD, _ROTATION_RANGE_RAD))
    ET.SubElement(coordinate, "clamped").text = "false"
    ET.SubElement(coordinate, "locked").text = "true" if is_locked else "false"
    return coordinate


def _numbers(values: ArrayLike) -> str:
    return " ".join(repr(float(value) + 0.0) for value in np.asarray(values))
