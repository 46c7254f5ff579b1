"""Scaling a body to a person: segments made longer or thicker, and all that they carry with them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import RigidTransform

from airborne.body.model import BodyModel, Box, Ellipsoid, Inertia, Mesh, Part, Segment, Shape
from airborne.errors import BodyError
from airborne.types import Array

_RANGE = (0.1, 10.0)  # a scale beyond these is a mistake
_ALIGNED = 1e-9  # rounding: axes this near to whole numbers are those of the segment


def with_segment_lengths(model: BodyModel, scales: Mapping[str, float]) -> BodyModel:
    """Return the body with segments stretched along their length axes, by factors.

    A name without its side ("thigh") stands for both. The joints and landmarks that a segment carries move with it; its
    parts, their slabs and its inertia stretch at constant density. Raises BodyError for an unknown segment, a factor
    out of range, or a part that is oblique in its segment.
    """
    return _scale(model, scales, along=True)


def with_girths(model: BodyModel, scales: Mapping[str, float | tuple[float, float]]) -> BodyModel:
    """Return the body with segments made thicker across their length axes, each part about its own centre, by factors.

    A pair scales the two axes across, in the order x, y, z: of the trunk its width and its depth. Names as in
    `with_segment_lengths`. Joints, landmarks and centres of mass stay. Raises BodyError likewise.
    """
    return _scale(model, scales, along=False)


def with_joint_widths(model: BodyModel, scales: Mapping[str, float]) -> BodyModel:
    """Return the body with the joints of segments' left and right children further apart, by factors.

    The segments' own surfaces stay. Raises BodyError for an unknown segment, or a factor out of range.
    """
    factors = _per_segment(model, scales)
    segments = tuple(
        replace(segment, joint_m=segment.joint_m * [float(factors[segment.parent]), 1, 1])
        if segment.parent in factors and segment.name.endswith(("_left", "_right"))
        else segment
        for segment in model.segments
    )
    return BodyModel(model.name, segments, model.landmarks)


def with_size(model: BodyModel, share: float) -> BodyModel:
    """Return the body made larger in all directions by a factor, at constant density; BodyError where out of range."""
    if not _RANGE[0] <= share <= _RANGE[1]:
        raise BodyError(f"size is {share:g} times the body's; expected a factor, {_RANGE[0]:g} to {_RANGE[1]:g}")
    factors = np.full(3, share)
    segments = tuple(
        _segment(replace(segment, joint_m=share * segment.joint_m), factors, factors) for segment in model.segments
    )
    landmarks = tuple(replace(mark, position_m=share * mark.position_m) for mark in model.landmarks)
    return BodyModel(model.name, segments, landmarks)


def total_mass_kg(model: BodyModel) -> float:
    """Return the mass of the segments whose masses are known [kg]."""
    return sum(segment.inertia.mass_kg for segment in model.segments if segment.inertia is not None)


def with_mass(model: BodyModel, mass_kg: float) -> BodyModel:
    """Return the body with a total mass [kg], distributed as before; BodyError where a segment's is not known."""
    if not 0 < mass_kg < np.inf:
        raise BodyError(f"mass_kg is {mass_kg:g}; expected a mass above zero, in kilograms")
    unknown = [segment.name for segment in model.segments if segment.inertia is None]
    if unknown:
        raise BodyError(f"body '{model.name}' has no inertia of {', '.join(unknown)}; give one, or no mass")
    scale = mass_kg / total_mass_kg(model)
    segments = tuple(
        replace(segment, inertia=Inertia(own.mass_kg * scale, own.centre_m, own.tensor_kg_m2 * scale))
        for segment in model.segments
        if (own := segment.inertia) is not None
    )
    return BodyModel(model.name, segments, model.landmarks)


def length_axis(model: BodyModel, segment: str) -> int:
    """Return which of a segment's axes (0, 1, 2) it extends along: toward its joints and landmarks, or its parts."""
    own = model.segments[model.index_of(segment)]
    ends = [child.joint_m for child in model.segments if child.parent == segment]
    ends += [landmark.position_m for landmark in model.landmarks if landmark.segment == segment]
    extent = np.abs(ends).sum(axis=0) if ends else np.zeros(3)
    if not extent.any():
        extent = np.sum([np.abs(part.segment_from_part.translation) for part in own.parts], axis=0) + np.zeros(3)
    return int(np.argmax(extent)) if extent.any() else 2


def half_size_m(part: Part) -> Array:
    """Return half the size of a part along its segment's axes: (3,) [m]."""
    shape = part.shape
    if isinstance(shape, Ellipsoid):
        half = shape.semi_axes_m
    else:
        half = shape.size_m / 2 if isinstance(shape, Box) else np.ptp(shape.vertices_m, axis=0) / 2
    return np.abs(part.segment_from_part.rotation.as_matrix()) @ half


def stretch_mesh(mesh: Mesh, factors: Array, axes: Array | None = None) -> Mesh:
    """Return a mesh stretched by factors (3,) along axes, rows of (3, 3) in its frame, by default the frame's own."""
    to = np.eye(3) if axes is None else axes
    normals = mesh.normals
    if normals is not None:
        normals = normals @ (to.T / factors) @ to
        normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return replace(mesh, vertices_m=mesh.vertices_m @ (to.T * factors) @ to, normals=normals)


def half_widths_m(model: BodyModel) -> Array:
    """Return half the mean width of each segment across its length: (segments,) [m]; 0 without parts."""
    half_widths = np.zeros(len(model.segments))
    for index, segment in enumerate(model.segments):
        if segment.parts:
            half = np.max([half_size_m(part) for part in segment.parts], axis=0)
            half_widths[index] = np.delete(half, length_axis(model, segment.name)).mean()
    return half_widths


def _scale(model: BodyModel, scales: Mapping[str, float | tuple[float, float]], *, along: bool) -> BodyModel:
    factors = _per_segment(model, scales)
    shape, position = {}, {}
    for name, scale in factors.items():
        on_axis = np.arange(3) == length_axis(model, name)
        shape[name] = np.ones(3)
        shape[name][on_axis == along] = scale
        position[name] = shape[name] if along else np.ones(3)
    segments = []
    for segment in model.segments:
        joint = segment.joint_m * position[segment.parent] if segment.parent in position else segment.joint_m
        changed = replace(segment, joint_m=joint)
        segments.append(
            _segment(changed, shape[segment.name], position[segment.name]) if segment.name in shape else changed
        )
    landmarks = tuple(
        replace(mark, position_m=mark.position_m * position[mark.segment]) if mark.segment in position else mark
        for mark in model.landmarks
    )
    return BodyModel(model.name, tuple(segments), landmarks)


def _per_segment(model: BodyModel, scales: Mapping[str, float | tuple[float, float]]) -> dict[str, Array]:
    """Resolve names without a side; a name with its side goes before one without."""
    factors: dict[str, Array] = {}
    names = {segment.name for segment in model.segments}
    for name, scale in sorted(scales.items(), key=lambda item: item[0] in names):
        for factor in np.atleast_1d(scale):
            if not _RANGE[0] <= factor <= _RANGE[1]:
                expected = f"expected a factor, {_RANGE[0]:g} to {_RANGE[1]:g}"
                raise BodyError(f"segment '{name}': scale is {factor:g}; {expected}")
        sides = [side for side in (f"{name}_left", f"{name}_right") if side in names]
        if name not in names and not sides:
            model.index_of(name)
        factors |= dict.fromkeys([name] if name in names else sides, np.asarray(scale, float))
    return factors


def _segment(segment: Segment, shape: Array, position: Array) -> Segment:
    parts = tuple(_part(part, shape, position) for part in segment.parts)
    inertia = segment.inertia
    if inertia is not None:
        tensor = inertia.tensor_kg_m2
        moments = np.trace(tensor) / 2 * np.eye(3) - tensor  # of x x' dm
        moments = moments * np.outer(shape, shape) * shape.prod()
        inertia = Inertia(
            inertia.mass_kg * float(shape.prod()), inertia.centre_m * position, np.trace(moments) * np.eye(3) - moments
        )
    return replace(segment, parts=parts, inertia=inertia)


def _part(part: Part, shape: Array, position: Array) -> Part:
    rotation = part.segment_from_part.rotation
    moved = RigidTransform.from_components(part.segment_from_part.translation * position, rotation)
    if isinstance(part.shape, Box | Ellipsoid):
        axes = np.eye(3) if np.ptp(shape) == 0 else np.abs(rotation.as_matrix())
        if np.abs(axes - axes.round()).max() > _ALIGNED:
            raise BodyError(
                f"part '{part.name}' is oblique in its segment, so that stretching would shear it; give it axes along "
                "the segment's, or make it a mesh"
            )
        own = axes.round().T @ shape  # along the part's own axes
        scaled: Shape = (
            Box(part.shape.size_m * own) if isinstance(part.shape, Box) else Ellipsoid(part.shape.semi_axes_m * own)
        )
        return replace(
            part, shape=scaled, segment_from_part=moved, slab_m=(part.slab_m[0] * own[2], part.slab_m[1] * own[2])
        )
    return replace(part, shape=stretch_mesh(part.shape, shape, rotation.as_matrix()), segment_from_part=moved)
