"""Rotational symmetries of a rigid body: rotations that no camera can detect."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.spatial import KDTree
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body.model import BodyModel, Box, Ellipsoid, Mesh, Part, Pose
from airborne.types import Array

_SAME_POINT_M = 1e-6  # rounding of coordinates in body files
_SAME_MOMENT_M2 = 1e-7  # rounding of second moments of area
_SAME_COLOUR = 1.0  # grey levels
# of its largest radius, by which a mesh may be out of round: as flat as the sides of a circle drawn with 16; chosen, a
# third of a pixel of a ball at 160 pixels a metre
_OUT_OF_ROUND = 0.02
_MOST_FACES = 20_000  # of a mesh whose faces are looked at within, chosen: finer ones at their centres alone
_BARYCENTRIC = [(i, j, 14 - i - j) for i in range(1, 14, 3) for j in range(1, 14 - i, 3)]
_INSIDE = (np.array(_BARYCENTRIC) + 1 / 3) / 15  # (points, 3) weights of a face's corners, where it is looked at
_ANGLES_RAD, _MOST_SAMPLES = (0.7, 1.9, 3.3), 0.99  # chosen: no fractions of a turn; of the samples, edges left out


@dataclass(frozen=True, slots=True, eq=False)
class _Solid:
    """A part in the root's frame, whatever the order and signs of its axes."""

    index: int
    points: Array  # (p, 3) corners, or vertices and face centres, or an ellipsoid's centre and ends of its slab [m]
    moment: Array  # (3, 3) an ellipsoid's axes as a sum of squares [m^2]; zero for other shapes
    colour: Array | None

    @property
    def is_ellipsoid(self) -> bool:
        return bool(self.moment.any())

    def rotate(self, R: Array) -> _Solid:
        return _Solid(self.index, self.points @ R.T, R @ self.moment @ R.T, self.colour)

    def matches(self, other: _Solid) -> bool:
        if len(self.points) != len(other.points) or not self._has_colour_of(other):
            return False
        if np.any(np.abs(self.moment - other.moment) > _SAME_MOMENT_M2):
            return False
        forward, _ = KDTree(other.points).query(self.points)
        reverse, _ = KDTree(self.points).query(other.points)
        return bool(max(forward.max(), reverse.max()) < _SAME_POINT_M)

    def _has_colour_of(self, other: _Solid) -> bool:
        if self.colour is None or other.colour is None:
            return self.index == other.index
        return bool(np.all(np.abs(self.colour - other.colour) <= _SAME_COLOUR))


def symmetries(model: BodyModel) -> list[Array]:
    """Find the rotations (3, 3) about the root's origin under which the body, joints straight, looks the same.

    Searched among the 24 rotations of the cube; the identity is always the first. A body seen at `R` and at `R @ S`
    gives the same images. A part whose colour has yet to be sampled matches no other part.
    """
    solids = _solids(model)
    rotations = [R for R in Rotation.create_group("O").as_matrix().round() + 0.0 if _is_same(R, solids)]
    return sorted(rotations, key=lambda R: -float(np.trace(R)))


def least_turned_pose(model: BodyModel, pose: Pose) -> Pose:
    """Return, of the poses that look like one of a body without joints, that turned least from the world's axes.

    So trials of one body agree, wherever its sides cannot be told apart.
    """
    if model.has_joints:
        return pose
    R = pose.world_from_root.rotation.as_matrix()
    best = max(symmetries(model), key=lambda symmetry: float(np.trace(R @ symmetry)))
    root = RigidTransform.from_components(pose.world_from_root.translation, Rotation.from_matrix(R @ best))
    return replace(pose, world_from_root=root)


def continuous_axes(model: BodyModel) -> Array:
    """Find the axes through the root's origin about which no rotation is visible: unit rows (k, 3), root's frame.

    None for most bodies, one for spheroids, spheres and turned meshes lined up, and all three where every axis is one
    (a ball). A mesh may be a little out of round, as circles of 16 sides are.
    """
    placed = list(_place_parts(model))
    if any(isinstance(part.shape, Box) for part, _, _ in placed):
        return np.zeros((0, 3))
    exact = _axes_of_ellipsoids([each for each in _solids(model) if each.is_ellipsoid])
    if exact is None:
        return np.zeros((0, 3))
    meshes = [_sample_mesh(part.shape, R, t) for part, R, t in placed if isinstance(part.shape, Mesh)]
    if not meshes:
        return exact
    candidates = exact if len(exact) == 1 else _principal_axes(np.concatenate(meshes))
    axes = [axis for axis in candidates if all(_is_round(mesh, axis) for mesh in meshes)]
    return np.eye(3) if len(axes) > 1 else np.array(axes).reshape(-1, 3)


def _axes_of_ellipsoids(solids: Sequence[_Solid]) -> Array | None:
    """Return the axis that all have in common (1, 3), all three where every axis is one, None where there is none."""
    axes: list[Array] = []  # directions that a symmetry axis must have
    for solid in solids:
        centre = solid.points[0]
        if np.linalg.norm(centre) > _SAME_POINT_M:
            axes.append(centre / np.linalg.norm(centre))
        variances, directions = np.linalg.eigh(solid.moment)
        steps = np.diff(np.sqrt(variances)) > _SAME_POINT_M
        if steps.all():
            return None
        if steps.any():
            axes.append(directions[:, 0] if steps[0] else directions[:, 2])
        if len(solid.points) > 1:
            along = solid.points[2] - solid.points[1]  # a slab is cut square to its own axis
            axes.append(along / np.linalg.norm(along))
    if not axes:
        return np.eye(3)
    is_one_axis = all(np.linalg.norm(np.cross(axes[0], axis)) < _SAME_POINT_M for axis in axes)
    return axes[0][None] if is_one_axis else None


def _sample_mesh(mesh: Mesh, R: Array, t: Array) -> Array:
    """Return points of a mesh's faces with their normals and areas: (n, 7), in the root's frame."""
    corners = mesh.vertices_m[mesh.faces] @ R.T + t
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice = np.linalg.norm(normals, axis=1, keepdims=True)
    inside = _INSIDE if len(corners) <= _MOST_FACES else np.full((1, 3), 1 / 3)
    points = np.einsum("pk,fkx->fpx", inside, corners)
    of_face = np.concatenate([normals / np.maximum(twice, 1e-18), twice / 2 / len(inside)], axis=1)
    return np.concatenate([points, np.repeat(of_face[:, None], len(inside), axis=1)], axis=2).reshape(-1, 7)


def _principal_axes(samples: Array) -> Array:
    """Return the axes (3, 3), rows, of the surfaces' second moments about the origin, each upright if it nearly is."""
    points, areas = samples[:, :3], samples[:, 6:]
    _, directions = np.linalg.eigh((points * areas).T @ points)
    nearest = np.eye(3)[np.argmax(np.abs(directions), axis=0)]
    is_near = np.abs(np.sum(nearest * directions.T, axis=1)) > np.cos(_OUT_OF_ROUND)
    return np.where(is_near[:, None], nearest, directions.T)


def _is_round(samples: Array, axis: Array) -> bool:
    """Whether a mesh, by samples of its surface, coincides with itself however it is rotated about an axis."""
    points, normals = samples[:, :3], samples[:, 3:6]
    most_m = _OUT_OF_ROUND * float(np.linalg.norm(np.cross(points, axis), axis=1).max())
    tree = KDTree(points)
    for angle in _ANGLES_RAD:
        rotated = points @ Rotation.from_rotvec(angle * axis).as_matrix().T
        _, nearest = tree.query(rotated)
        off_m = np.abs(np.sum((rotated - points[nearest]) * normals[nearest], axis=1))
        if np.quantile(off_m, _MOST_SAMPLES) > most_m:
            return False
    return True


def _place_parts(model: BodyModel) -> Iterator[tuple[Part, Array, Array]]:
    """Yield each part with its rotation (3, 3) and place (3,) [m] in the root's frame, joints straight."""
    posed = model.with_pose(Pose(world_from_root=RigidTransform.identity()))
    for segment, R, t in zip(model.segments, posed.R, posed.t, strict=True):
        for part in segment.parts:
            place = part.segment_from_part
            yield part, R @ place.rotation.as_matrix(), R @ place.translation + t


def _solids(model: BodyModel) -> list[_Solid]:
    solids: list[_Solid] = []
    for part, rotation, centre in _place_parts(model):
        moment = np.zeros((3, 3))
        if isinstance(part.shape, Ellipsoid):
            moment = rotation @ np.diag(np.square(part.shape.semi_axes_m)) @ rotation.T
        solids.append(_Solid(len(solids), _points(part) @ rotation.T + centre, moment, part.colour))
    return solids


def _points(part: Part) -> Array:
    shape = part.shape
    if isinstance(shape, Ellipsoid):
        radius = shape.semi_axes_m[2]
        low, high = np.clip(part.slab_m, -radius, radius)
        ends = [low, high] if low > -radius or high < radius else []
        return np.array([[0.0, 0.0, height] for height in [0.0, *ends]])
    if isinstance(shape, Box):
        return np.array(list(product((-0.5, 0.5), repeat=3))) * shape.size_m
    return np.concatenate([shape.vertices_m, shape.vertices_m[shape.faces].mean(axis=1)])


def _is_same(R: Array, solids: list[_Solid]) -> bool:
    unmatched = list(solids)
    for solid in (solid.rotate(R) for solid in solids):
        twin = next((other for other in unmatched if solid.matches(other)), None)
        if twin is None:
            return False
        unmatched.remove(twin)
    return True
