"""OpenSim models (.osim): a body as a chain of rigid bodies whose coordinates are our own angles.

OpenSim's ground has y up: its x, y, z are the world's y, z, x. Each body has x ahead, y toward the head and z to the
subject's right, as in OpenSim's own models. A CustomJoint
turns about three axes in succession, R = R1 R2 R3, as our angles do.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from airborne.body import BodyModel, Box, Ellipsoid, Part, Segment
from airborne.export.part_meshes import part_colour
from airborne.export.takes import plain_names
from airborne.geometry.rotations import angles_from_matrix

Array = NDArray[np.floating]

VERSION = "40000"  # of the file's layout: OpenSim 4.0 and later
GROUND_FROM_WORLD = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])
BODY_FROM_SEGMENT = np.array([[0.0, -1, 0], [0, 0, 1], [-1, 0, 0]])
_TURNS = ("somersault", "tilt", "twist")
_MOST_TURNS_RAD = 20 * np.pi  # range of the root's turns
_FAR_M = 50.0  # range of the root's slides


def write_osim(path: Path, model: BodyModel) -> None:
    """Write a body as an OpenSim model: segments with their masses and ellipsoids, joints, markers at the landmarks.

    The root has the coordinates somersault, tilt, twist and `<root>_tx`, `_ty`, `_tz`, every other segment
    `<segment>_x`, `_y`, `_z`: successive turns about our axes, to be filled by `write_mot`. A segment of unknown mass
    has mass 0, which does for kinematics. An angle whose least and greatest values agree is locked. Meshes are drawn
    as boxes around them.
    """
    document = ET.Element("OpenSimDocument", Version=VERSION)
    root = ET.SubElement(document, "Model", name=plain_names([model.name])[0])
    ET.SubElement(root, "length_units").text = "meters"
    ET.SubElement(root, "force_units").text = "N"
    ET.SubElement(root, "gravity").text = "0 -9.80665 0"
    names = plain_names([segment.name for segment in model.segments])
    bodies, joints, markers = (_set(root, kind) for kind in ("BodySet", "JointSet", "MarkerSet"))
    for segment, name, parent in zip(model.segments, names, model.parents, strict=True):
        bodies.append(_body(segment, name))
        joints.append(_root_joint(name) if parent < 0 else _joint(segment, name, names[parent]))
    marks = plain_names([landmark.name for landmark in model.landmarks])
    for landmark, name in zip(model.landmarks, marks, strict=True):
        marker = ET.SubElement(markers, "Marker", name=name)
        owner = names[model.index_of(landmark.segment)]
        ET.SubElement(marker, "socket_parent_frame").text = f"/bodyset/{owner}"
        ET.SubElement(marker, "location").text = _numbers(BODY_FROM_SEGMENT @ landmark.position_m)
        ET.SubElement(marker, "fixed").text = "true"
    ET.indent(document, "\t")
    path.write_bytes(ET.tostring(document, encoding="UTF-8", xml_declaration=True) + b"\n")


def coordinates_of(model: BodyModel) -> list[str]:
    """Name the model's coordinates: the root's turns and translations, then three angles a joint."""
    root, *others = plain_names([segment.name for segment in model.segments])
    return [*_TURNS, *(f"{root}_t{axis}" for axis in "xyz"), *(f"{name}_{axis}" for name in others for axis in "xyz")]


def _set(root: ET.Element, kind: str) -> ET.Element:
    return ET.SubElement(ET.SubElement(root, kind, name=kind.lower()), "objects")


def _body(segment: Segment, name: str) -> ET.Element:
    body, mass, centre, tensor = ET.Element("Body", name=name), 0.0, np.zeros(3), np.zeros((3, 3))
    components = ET.SubElement(body, "components")
    for k, part in enumerate(_shown(segment)):
        components.append(_geometry(part, f"{name}_part{k + 1}"))
    if segment.inertia is not None:
        mass, centre = segment.inertia.mass_kg, BODY_FROM_SEGMENT @ segment.inertia.centre_m
        tensor = BODY_FROM_SEGMENT @ segment.inertia.tensor_kg_m2 @ BODY_FROM_SEGMENT.T
    ET.SubElement(body, "mass").text = _numbers([mass])
    ET.SubElement(body, "mass_center").text = _numbers(centre)
    ET.SubElement(body, "inertia").text = _numbers([*np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2]])
    return body


def _shown(segment: Segment) -> list[Part]:
    """Return the parts to draw: of an ellipsoid that is cut into slabs of several colours, the longest."""
    best: dict[tuple, tuple[float, Part]] = {}
    for part in segment.parts:
        key, length_m = (id(part),), 0.0
        if isinstance(part.shape, Ellipsoid):
            place, half = part.segment_from_part, float(part.shape.semi_axes_m[2])
            key = tuple(np.round([*part.shape.semi_axes_m, *place.translation, *place.as_matrix()[:3, 0]], 9))
            length_m = min(part.slab_m[1], half) - max(part.slab_m[0], -half)
        if key not in best or length_m > best[key][0]:
            best[key] = (length_m, part)
    return [part for _, part in best.values()]


def _geometry(part: Part, name: str) -> ET.Element:
    shape, place = part.shape, part.segment_from_part
    centre = np.zeros(3)
    if isinstance(shape, Ellipsoid):
        kind, key, sizes = "Ellipsoid", "radii", shape.semi_axes_m
    elif isinstance(shape, Box):
        kind, key, sizes = "Brick", "half_lengths", shape.size_m / 2
    else:
        low, high = shape.vertices_m.min(axis=0), shape.vertices_m.max(axis=0)
        kind, key, sizes, centre = "Brick", "half_lengths", (high - low) / 2, (high + low) / 2
    frame = ET.Element("PhysicalOffsetFrame", name=name)
    drawn = ET.SubElement(ET.SubElement(frame, "attached_geometry"), kind, name=f"{name}_shape")
    ET.SubElement(drawn, "socket_frame").text = ".."
    colour = ET.SubElement(ET.SubElement(drawn, "Appearance"), "color")
    colour.text = _numbers(part_colour(part) / 255)
    ET.SubElement(drawn, key).text = _numbers(sizes)
    turn = BODY_FROM_SEGMENT @ place.rotation.as_matrix()  # the shape keeps its own axes
    _place(frame, "..", BODY_FROM_SEGMENT @ place.apply(centre), turn)
    return frame


def _place(frame: ET.Element, parent: str, translation_m: Array, turn: Array) -> None:
    """Fix a PhysicalOffsetFrame in its parent; OpenSim's orientation is a sequence about x, y and z."""
    ET.SubElement(frame, "socket_parent").text = parent
    ET.SubElement(frame, "translation").text = _numbers(translation_m)
    ET.SubElement(frame, "orientation").text = _numbers(angles_from_matrix(turn))


class _Freedom(NamedTuple):
    """A coordinate: what it turns about or goes along, in the parent's axes, and its range [rad or m]."""

    name: str
    axis: Array
    low: float
    high: float


def _root_joint(name: str) -> ET.Element:
    """Return the six freedoms of the root: R = Rx(somersault) Ry(tilt) Rz(twist) about the world's axes."""
    turns = [
        _Freedom(turn, axis, -_MOST_TURNS_RAD, _MOST_TURNS_RAD)
        for turn, axis in zip(_TURNS, GROUND_FROM_WORLD.T, strict=True)
    ]
    slides = [_Freedom(f"{name}_t{axis}", e, -_FAR_M, _FAR_M) for axis, e in zip("xyz", np.eye(3), strict=True)]
    joint, frames = _custom_joint(f"ground_{name}", [*turns, *slides])
    half_turn = BODY_FROM_SEGMENT @ GROUND_FROM_WORLD.T
    _place(frames[0], "/ground", np.zeros(3), np.eye(3))
    _place(frames[1], f"/bodyset/{name}", np.zeros(3), half_turn)
    return joint


def _joint(segment: Segment, name: str, parent: str) -> ET.Element:
    """Return a segment's joint: R = Rx Ry Rz about the parent's axes."""
    turns = [
        _Freedom(f"{name}_{letter}", axis, low, high)
        for letter, axis, (low, high) in zip("xyz", BODY_FROM_SEGMENT.T, segment.limits_rad, strict=True)
    ]
    joint, frames = _custom_joint(f"{name}_joint", turns)
    _place(frames[0], f"/bodyset/{parent}", BODY_FROM_SEGMENT @ segment.joint_m, np.eye(3))
    _place(frames[1], f"/bodyset/{name}", np.zeros(3), np.eye(3))
    return joint


def _custom_joint(name: str, freedoms: Sequence[_Freedom]) -> tuple[ET.Element, list[ET.Element]]:
    """Return a joint of three turns and maybe three slides, and its two frames, to be placed in parent and child."""
    joint = ET.Element("CustomJoint", name=name)
    ET.SubElement(joint, "socket_parent_frame").text = f"{name}_parent"
    ET.SubElement(joint, "socket_child_frame").text = f"{name}_child"
    coordinates = ET.SubElement(joint, "coordinates")
    for freedom in freedoms:
        coordinates.append(_coordinate(freedom))
    within = ET.SubElement(joint, "frames")
    frames = [ET.SubElement(within, "PhysicalOffsetFrame", name=f"{name}_{end}") for end in ("parent", "child")]
    transform = ET.SubElement(joint, "SpatialTransform")
    fixed = [_Freedom("", axis, 0, 0) for axis in np.eye(3)]
    for k, freedom in enumerate([*freedoms, *fixed][:6]):
        axis = ET.SubElement(transform, "TransformAxis", name=f"{'rotation' if k < 3 else 'translation'}{k % 3 + 1}")
        ET.SubElement(axis, "coordinates").text = freedom.name
        ET.SubElement(axis, "axis").text = _numbers(freedom.axis)
        if freedom.name:
            function = ET.SubElement(axis, "LinearFunction", name="function")
            ET.SubElement(function, "coefficients").text = "1 0"
        else:
            ET.SubElement(ET.SubElement(axis, "Constant", name="function"), "value").text = "0"
    return joint, frames


def _coordinate(freedom: _Freedom) -> ET.Element:
    """Return a coordinate that may leave its range; one whose range is a single value is locked there."""
    is_locked = freedom.low == freedom.high
    low, high = (-np.pi, np.pi) if is_locked else (freedom.low, freedom.high)
    coordinate = ET.Element("Coordinate", name=freedom.name)
    ET.SubElement(coordinate, "default_value").text = _numbers([freedom.low if is_locked else 0.0])
    ET.SubElement(coordinate, "range").text = _numbers(np.clip([low, high], -_MOST_TURNS_RAD, _MOST_TURNS_RAD))
    ET.SubElement(coordinate, "clamped").text = "false"
    ET.SubElement(coordinate, "locked").text = "true" if is_locked else "false"
    return coordinate


def _numbers(values: ArrayLike) -> str:
    return " ".join(repr(float(value) + 0.0) for value in np.asarray(values))
