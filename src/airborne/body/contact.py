"""Which segments of a body pass through each other: spheres along the limbs against the other segments' ellipsoids.

Flesh gives way, so that a little overlap is none. What overlaps in the zero pose, and a segment with its parent, may
always overlap. Boxes and meshes are left out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from airborne.body.model import BodyModel, Ellipsoid, Pose
from airborne.kernels import kernel
from airborne.types import Array

FLESH_M = 0.015  # two segments may overlap by this
_ALONG = np.array([-0.7, -0.25, 0.25, 0.7])  # places of an ellipsoid's spheres on its longest axis, in semi-axes
_LEAST_RATIO = 1.5  # of the longest semi-axis to the next, of an ellipsoid that spheres stand for


@dataclass(frozen=True, slots=True, eq=False)
class ContactModel:
    """Spheres and ellipsoids of a body, and which of them must not overlap."""

    sphere_segment: NDArray[np.int64]  # (m,)
    sphere_centre: Array  # (m, 3) segment's frame [m]
    sphere_radius: Array  # (m,) [m]
    ellipsoid_segment: NDArray[np.int64]  # (e,)
    ellipsoid_centre: Array  # (e, 3) segment's frame [m]
    ellipsoid_axes: Array  # (e, 3, 3) columns in the segment's frame
    ellipsoid_semi_axes: Array  # (e, 3) [m]
    pairs: tuple[NDArray[np.int64], NDArray[np.int64]]  # sphere and ellipsoid of each pair


@dataclass(frozen=True, slots=True, eq=False)
class Overlaps:
    """Where a posed body passes through itself, deeper than flesh gives way."""

    depth_m: Array  # (k,)
    normal: Array  # (k, 3) out of the ellipsoid, world
    point: Array  # (k, 3) world [m]
    segments: NDArray[np.int64]  # (k, 2) of the sphere and of the ellipsoid


@lru_cache(maxsize=16)
def contact_model(model: BodyModel) -> ContactModel:
    """Prepare a body."""
    owners, parts, shapes = [], [], []
    for index, segment in enumerate(model.segments):
        solids = [(part, part.shape) for part in segment.parts if isinstance(part.shape, Ellipsoid)]
        if solids:  # pieces of one ellipsoid in several colours are the same solid
            part, shape = max(solids, key=lambda each: float(each[1].semi_axes_m.prod()))
            owners.append(index)
            parts.append(part)
            shapes.append(shape)
    centre = np.array([part.segment_from_part.translation for part in parts]).reshape(-1, 3)
    axes = np.array([part.segment_from_part.rotation.as_matrix() for part in parts]).reshape(-1, 3, 3)
    semi_axes = np.array([shape.semi_axes_m for shape in shapes]).reshape(-1, 3)
    order = np.argsort(semi_axes, axis=1)
    ordered = np.take_along_axis(semi_axes, order, axis=1)
    is_long = (ordered[:, 2] > _LEAST_RATIO * ordered[:, 1]) if len(parts) else np.zeros(0, bool)
    longest = np.take_along_axis(axes, order[:, None, 2:], axis=2)[..., 0] * ordered[:, 2:]
    along = (centre[:, None] + _ALONG[:, None] * longest[:, None])[is_long]
    radius = (np.sqrt(1 - _ALONG**2) * ordered[:, :2].mean(axis=1, keepdims=True))[is_long]
    segments = np.array(owners, np.int64)
    whole = ContactModel(
        np.repeat(segments[is_long], len(_ALONG)),
        along.reshape(-1, 3),
        radius.ravel(),
        segments,
        centre,
        axes,
        semi_axes,
        (np.zeros(0, np.int64), np.zeros(0, np.int64)),
    )
    sphere, ellipsoid = np.meshgrid(np.arange(len(whole.sphere_segment)), np.arange(len(segments)), indexing="ij")
    every = sphere.ravel(), ellipsoid.ravel()
    a, b = whole.sphere_segment[every[0]], segments[every[1]]
    parents = model.parents
    is_apart = (a != b) & (parents[a] != b) & (parents[b] != a)
    at_rest = model.with_pose(Pose(world_from_root=RigidTransform.identity()))
    is_apart &= _depths(whole, every, at_rest.R, at_rest.t)[0] < FLESH_M
    return replace(whole, pairs=(every[0][is_apart], every[1][is_apart]))


def overlaps(contact: ContactModel, R: Array, t: Array) -> Overlaps:
    """Find where segments pass through each other: R (segments, 3, 3), t (segments, 3) [m] world from segment."""
    depth, normal, point = _depths(contact, contact.pairs, R, t)
    rows = np.flatnonzero(depth > FLESH_M)
    segments = np.stack(
        [contact.sphere_segment[contact.pairs[0][rows]], contact.ellipsoid_segment[contact.pairs[1][rows]]], axis=1
    )
    return Overlaps(depth[rows] - FLESH_M, normal[rows], point[rows], segments)


def _depths(
    contact: ContactModel, pairs: tuple[NDArray[np.int64], NDArray[np.int64]], R: Array, t: Array
) -> tuple[Array, Array, Array]:
    """Return each pair's overlap (k,) [m], its normal (k, 3) and the sphere's centre (k, 3), in the world.

    To first order: an ellipsoid wider by the sphere's radius against the sphere's centre. The overlap of a pair far
    apart is minus infinity, without a normal.
    """
    n = len(pairs[0])
    depth, normal, centre = np.empty(n), np.empty((n, 3)), np.empty((n, 3))
    spheres = contact.sphere_segment, contact.sphere_centre, contact.sphere_radius
    ellipsoids = contact.ellipsoid_segment, contact.ellipsoid_centre, contact.ellipsoid_axes
    _fill_depths(*pairs, *spheres, *ellipsoids, contact.ellipsoid_semi_axes, R, t, depth, normal, centre)
    return depth, normal, centre


@kernel
def _fill_depths(
    spheres, ellipsoids, own, sphere_centre, radius, other, middle, axes, semi_axes, R, t, depth, normal, centre
):
    """Fill in what `_depths` returns."""
    away, slope = np.empty(3), np.empty(3)
    for k in range(len(spheres)):
        m, e = spheres[k], ellipsoids[k]
        a, b, least, farthest = own[m], other[e], np.inf, radius[m]
        farthest += max(semi_axes[e, 0], semi_axes[e, 1], semi_axes[e, 2])
        for i in range(3):
            centre[k, i], away[i] = t[a, i], t[a, i] - t[b, i]
            for j in range(3):
                part = R[a, i, j] * sphere_centre[m, j]
                centre[k, i] += part
                away[i] += part - R[b, i, j] * middle[e, j]
        if away[0] ** 2 + away[1] ** 2 + away[2] ** 2 > farthest**2:
            depth[k] = -np.inf  # apart, whichever way the ellipsoid lies
            continue
        level, steepness = 0.0, 0.0
        for j in range(3):  # along the ellipsoid's axes
            reach, local = semi_axes[e, j] + radius[m], 0.0
            for p in range(3):
                for q in range(3):
                    local += axes[e, p, j] * R[b, q, p] * away[q]
            slope[j] = local / reach**2
            level += (local / reach) ** 2
            steepness += slope[j] ** 2
            least = min(least, reach)
        level, steepness = max(np.sqrt(level), 1e-6), np.sqrt(steepness)
        steepness = max(steepness / level, 1e-9)
        depth[k] = min((1 - level) / steepness, least)
        for i in range(3):
            normal[k, i] = 0.0
            for p in range(3):
                for j in range(3):
                    normal[k, i] += R[b, i, p] * axes[e, p, j] * slope[j] / (level * steepness)
