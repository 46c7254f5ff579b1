"""A stick figure with joint angles from a player's joints: as much of a pose as joint centres alone determine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Ellipsoid, Landmark, Part, Segment
from airborne.body.legs import LEG_POINTS
from airborne.body.limits import JointLimits
from airborne.errors import ResultError
from airborne.geometry.rotations import angles_from_matrix, matrix_from_angles
from airborne.types import Array

ROOT = "hips"
_UP, _DOWN, _AHEAD = (0, 0, 1), (0, 0, -1), (0, -1, 0)  # directions at rest, in the segment's frame
# blue and vermilion of Okabe and Ito; grey
_LEFT_SRGB, _RIGHT_SRGB, _MIDDLE_SRGB = (0, 114, 178), (213, 94, 0), (150, 150, 150)
_HIPS_RADIUS_M = 0.07  # of the ellipsoid drawn between the hips


class _Stick(NamedTuple):
    parent: str
    start: str  # joint; "" is the middle of the hips
    end: str  # joint
    rest: tuple[int, int, int]  # its direction at rest, in its own axes
    radius_m: float
    colour_srgb: tuple[int, int, int]


_STICKS = {"torso": _Stick(ROOT, "", "torso", _UP, 0.1, _MIDDLE_SRGB)} | {
    f"{part}_{side}": _Stick(f"{parent}_{side}" if parent else ROOT, f"{start}_{side}", f"{end}_{side}", rest, r, rgb)
    for side, rgb in (("left", _LEFT_SRGB), ("right", _RIGHT_SRGB))
    for part, parent, start, end, rest, r in (
        ("thigh", "", "hip", "knee", _DOWN, 0.075),
        ("shank", "thigh", "knee", "ankle", _DOWN, 0.055),
        ("foot", "shank", "ankle", "foot", _AHEAD, 0.04),
    )
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StickFigure:
    """A body of sticks and its pose over time; NaN where a joint that it needs is missing."""

    model: BodyModel
    position: Array  # (n, 3) the middle of the hips, world [m]
    root_angles: Array  # (n, 3) somersault, tilt, twist of the hips [rad]
    joint_angles: Array  # (n, segments - 1, 3) [rad]


def fit_stick_figure(points: Array, joints: tuple[str, ...]) -> StickFigure:
    """Fit a stick figure to joints (n, joints, 3) [m], world; every length is the median over time.

    The root's x axis is the line of the hips, to the left; its z axis is as vertical as that allows, since joint
    centres do not determine the tilt of the pelvis about that line. A stick has the two angles that its direction
    determines, about x and y (thighs, shanks, torso; at rest vertical) or x and z (feet; at rest straight ahead); its
    axial rotation is locked at 0. The torso's point is no landmark of the figure: it is the middle of a flexible trunk.
    Raises ResultError where a hip, knee or ankle is missing.
    """
    at = {name: points[:, k] for k, name in enumerate(joints) if np.isfinite(points[:, k]).any()}
    missing = [name for name in LEG_POINTS if name not in at]
    if missing:
        raise ResultError(f"a figure needs {', '.join(LEG_POINTS)}; a player has no {', '.join(missing)}; track again")
    at[""] = (at["hip_left"] + at["hip_right"]) / 2
    half_m = _median_length(at["hip_left"] - at["hip_right"]) / 2
    segments, marks = [_hips_segment(half_m)], []
    offsets = {"": np.zeros(3), "hip_left": np.array([half_m, 0, 0]), "hip_right": np.array([-half_m, 0, 0])}
    R = {ROOT: _hips_rotation(at["hip_left"] - at["hip_right"])}
    angles = []
    for name, stick in _STICKS.items():
        if stick.end not in at:
            continue
        vector, rest = at[stick.end] - at[stick.start], np.array(stick.rest, float)
        xyz = _direction_angles(np.einsum("nji,nj->ni", R[stick.parent], vector), stick.rest)
        R[name] = R[stick.parent] @ matrix_from_angles(xyz)
        offsets[stick.end] = rest * _median_length(vector)
        segments.append(_segment(name, stick, offsets[stick.start], offsets[stick.end]))
        angles.append(xyz)
        if name != "torso":
            marks += [Landmark(stick.start, name, np.zeros(3))] if stick.parent == ROOT else []
            marks.append(Landmark(stick.end, name, offsets[stick.end]))
    return StickFigure(
        model=BodyModel("stick figure", tuple(segments), tuple(marks)),
        position=at[""],
        root_angles=angles_from_matrix(R[ROOT]),
        joint_angles=np.stack(angles, axis=1),
    )


def _hips_rotation(across: Array) -> Array:
    """Return rotations (n, 3, 3), world from hips, from the line of the hips to the left (n, 3)."""
    x = across / np.linalg.norm(across, axis=1, keepdims=True)
    z = np.array(_UP) - x * x[:, 2:]
    z = z / np.linalg.norm(z, axis=1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=-1)


def _direction_angles(vector: Array, rest: tuple[int, int, int]) -> Array:
    """Find x-y-z angles (n, 3) [rad] that rotate the direction of rest into that of vectors (n, 3)."""
    u = vector / np.linalg.norm(vector, axis=1, keepdims=True)
    side, none = np.arcsin(np.clip(u[:, 0], -1, 1)), 0 * u[:, 0]
    if rest == _AHEAD:
        return np.stack([np.arctan2(-u[:, 2], -u[:, 1]), none, side], axis=1)
    sign = rest[2]
    return np.stack([np.arctan2(-sign * u[:, 1], sign * u[:, 2]), sign * side, none], axis=1)


def _median_length(vector: Array) -> float:
    lengths = np.linalg.norm(vector, axis=1)
    positive = lengths[lengths > 0]
    if not len(positive):
        raise ResultError("two joints of a player never differ, so that a limb has no length; track again")
    return float(np.median(positive))


def _hips_segment(half_m: float) -> Segment:
    shape = Ellipsoid(np.array([half_m + _HIPS_RADIUS_M, _HIPS_RADIUS_M, _HIPS_RADIUS_M]))
    part = Part("hips", shape, RigidTransform.identity(), np.array(_MIDDLE_SRGB, float))
    return Segment(ROOT, None, np.zeros(3), (part,))


def _segment(name: str, stick: _Stick, joint_m: Array, end_m: Array) -> Segment:
    """Return a stick's segment: an ellipsoid from joint to joint, its axial rotation locked."""
    radii = np.where(end_m != 0, np.abs(end_m) / 2 + stick.radius_m / 2, stick.radius_m)
    segment_from_part = RigidTransform.from_components(end_m / 2, Rotation.identity())
    half_rad = np.full(3, np.pi)
    half_rad[1 if stick.rest == _AHEAD else 2] = 0
    part = Part(name, Ellipsoid(radii), segment_from_part, np.array(stick.colour_srgb, float))
    return Segment(name, stick.parent, joint_m, (part,), JointLimits(np.eye(3), half_rad, np.asarray(False)))
