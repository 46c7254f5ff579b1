"""A person's smooth skin: each segment a closed rational B-spline surface through stadium sections (Yeadon 1990-II).

Paper B draws its targets with a smooth model of a body scan and tracks them with ellipsoids: the same joints and
colours, another surface. This is the smooth one, independent of the ellipsoids: its sections are the measured
ones, so that limbs taper, calves bulge, hands and feet are flat. How B's subject differed from his model's measurements
is drawn from a seed here.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import RigidTransform

from airborne.body.anthropometry import measurements_of
from airborne.body.human import human18, human18_from_measurements
from airborne.body.measurements import STATURE_SHARES, Measurements
from airborne.body.model import BodyModel, Ellipsoid, Mesh, Part, Segment
from airborne.body.nurbs import RationalSurface, stadium_loft
from airborne.body.outfits import ellipsoid_of
from airborne.body.sections import (
    Profile,
    Values,
    arm_profile,
    foot_profile,
    leg_profile,
    shoulder_profile,
    trunk_profile,
)
from airborne.body.shaping import stretch_mesh
from airborne.body.splitting import faces_between, split_at
from airborne.errors import BodyError
from airborne.types import Array

_STATIONS = {  # the two ends of a segment's loft; neighbouring segments share the change of girth there
    "pelvis": ("hip", "waist"),
    "torso": ("waist", "nipples"),
    "chest": ("nipples", "neck"),
    "head": ("neck", "crown"),
    "shoulder": ("neck", "shoulder"),
    "upper_arm": ("elbow", "shoulder"),
    "forearm": ("wrist", "elbow"),
    "hand": ("fingers", "wrist"),
    "thigh": ("knee", "hip"),
    "shank": ("ankle", "knee"),
    "foot": ("heel", "toes"),
}
_LEVELS = sorted({name for ends in _STATIONS.values() for name in ends})
_SAME_JOINT_M, _SAME_MASS = 5e-4, 5e-3  # [m], relative: a body this close to the preset's has the same person's skin
_RINGS = (24, 48)  # of vertices along a segment, at least and at most
# of a skin that is fitted to images, 3700 triangles: with (10, 20), 20 four synthetic somersaults are fitted no better
_FITTED_RINGS, _FITTED_AROUND = (6, 12), 12


def skin_of(
    model: BodyModel,
    *,
    measurements: Measurements | None = None,
    seed: int = 0,
    radius_change: float = 0.08,
    border_change_m: float = 0.02,
    n_around: int = 40,
) -> BodyModel:
    """Clothe the skeleton of a `human18` in a smooth skin: the same joints, masses, landmarks and colours.

    The sections are those of the measurements, by default of our own proportions at the model's stature and mass. At
    each joint, girths differ from them by a share drawn from +-`radius_change`, linear between joints; borders between
    a segment's colours move by up to `border_change_m` [m]. Left and right change alike; a seed stands for a person.
    `n_around` facets go round a segment (a multiple of 4). The parts of a segment are open meshes that close each
    other. Raises BodyError for a body that is not the `human18` of these measurements.
    """
    person = _person_of(model, measurements)
    rng = np.random.default_rng(seed)
    girths = dict(zip(_LEVELS, 1 + radius_change * rng.uniform(-1, 1, len(_LEVELS)), strict=True))
    shifts = dict(zip(_STATIONS, border_change_m * rng.uniform(-1, 1, len(_STATIONS)), strict=True))
    segments = []
    for segment in model.segments:
        kind = _kind_and_side(segment.name)[0]
        first, last = _STATIONS[kind]
        mesh = _skin_of_segment(model, segment, person, (girths[first], girths[last]), n_around=n_around, rings=_RINGS)
        segments.append(replace(segment, parts=_cut_skin(segment, mesh, shifts[kind])))
    return replace(model, name=f"{model.name} skin", segments=tuple(segments))


def stretch_skin(model: BodyModel) -> BodyModel | None:
    """Clothe a body of `human18`'s segments, of any lengths and girths, in a smooth skin; None for another body.

    Each segment's skin is that of `human18()`, stretched along the segment's axes as its ellipsoid has to be to become
    the model's. It is cut where the model's colours change, and coarse enough to be drawn often.
    """
    base = human18()
    if [segment.name for segment in model.segments] != [segment.name for segment in base.segments]:
        return None
    try:
        solids = [[ellipsoid_of(body, segment.name) for body in (base, model)] for segment in model.segments]
    except BodyError:
        return None
    person, segments = _person_of(base, None), []
    for own, segment, ((old, old_m), (new, new_m)) in zip(model.segments, base.segments, solids, strict=True):
        mesh = _skin_of_segment(base, segment, person, (1, 1), n_around=_FITTED_AROUND, rings=_FITTED_RINGS)
        mesh = stretch_mesh(replace(mesh, vertices_m=mesh.vertices_m - old_m), new.semi_axes_m / old.semi_axes_m)
        mesh = replace(mesh, vertices_m=mesh.vertices_m + new_m)
        segments.append(replace(own, parts=tuple(_about(part, new_m) for part in _cut_skin(own, mesh, 0.0))))
    return replace(model, segments=tuple(segments))


def _about(part: Part, centre_m: Array) -> Part:
    """Return a mesh in a frame whose origin lies elsewhere in the segment's: girths scale about that."""
    shape = part.shape
    assert isinstance(shape, Mesh)
    moved = replace(shape, vertices_m=shape.vertices_m - centre_m)
    return replace(part, shape=moved, segment_from_part=RigidTransform.from_translation(centre_m))


def _person_of(model: BodyModel, measurements: Measurements | None) -> Measurements:
    """Find the measurements that give the model's joints."""
    names = [segment.name for segment in model.segments]
    masses = [segment.inertia.mass_kg for segment in model.segments if segment.inertia is not None]
    if "shank_left" not in names or len(masses) < len(names):
        raise BodyError(f"body '{model.name}' is no human18 with known masses; make it with human18(stature, mass)")
    if measurements is None:
        thigh = -float(model.segments[names.index("shank_left")].joint_m[2])
        measurements = measurements_of(thigh / STATURE_SHARES["Lj3L"], sum(masses))
    off_m = np.inf
    for person in (measurements.symmetrise(), measurements):
        segments = human18_from_measurements(person, symmetric=False).segments
        if [segment.name for segment in segments] != names:
            raise BodyError(f"body '{model.name}' has other segments than human18; make it with human18(stature, mass)")
        off_m = min(
            off_m, max(np.abs(a.joint_m - b.joint_m).max() for a, b in zip(model.segments, segments, strict=True))
        )
        person_masses = [segment.inertia.mass_kg for segment in segments if segment.inertia is not None]
        if off_m < _SAME_JOINT_M and np.allclose(masses, person_masses, rtol=_SAME_MASS):
            return person
    raise BodyError(
        f"body '{model.name}' is not the one of measurements '{measurements.name}': joints lie up to "
        f"{1000 * off_m:.0f} mm from theirs, or a segment's mass is another; give the measurements it was made of"
    )


def _skin_of_segment(
    model: BodyModel,
    segment: Segment,
    person: Measurements,
    girths: tuple[float, float],
    *,
    n_around: int,
    rings: tuple[int, int],
) -> Mesh:
    """Return a segment's whole skin in its frame, with factors on the girths at the two ends of its loft."""
    side = _kind_and_side(segment.name)[1]
    profile = _profile(model, segment, (person.mirror() if side == "right" else person).values_m)
    mesh = _mesh(stadium_loft(profile.stations(*girths)), profile.axes, n_around, rings)
    return _transform_mesh(mesh, np.diag([-1.0, 1, 1])) if side == "right" else mesh


def _kind_and_side(name: str) -> tuple[str, str]:
    kind, _, side = name.rpartition("_")
    return (kind, side) if side in ("left", "right") else (name, "")


def _profile(model: BodyModel, segment: Segment, values: Values) -> Profile:
    """Return the profile of a segment; of the left one for a right one."""
    kind, side = _kind_and_side(segment.name)
    if kind in ("pelvis", "torso", "chest", "head"):
        return trunk_profile(kind, values)
    if kind == "shoulder":
        to_left = np.array([-1 if side == "right" else 1, 1, 1])
        arm = model.segments[model.index_of(f"upper_arm_{side}")]
        return shoulder_profile(values, to_left * segment.joint_m, to_left * arm.joint_m)
    if kind == "foot":
        shape, centre = segment.parts[0].shape, segment.parts[0].segment_from_part.translation
        if not isinstance(shape, Ellipsoid):
            raise BodyError(f"part '{segment.parts[0].name}' is no ellipsoid; a skin goes over a human18")
        _, length, height = shape.semi_axes_m
        return foot_profile(values, -centre[1] - length, -centre[1] + length, centre[2] - height)
    return arm_profile(kind, values) if kind in ("upper_arm", "forearm", "hand") else leg_profile(kind, values)


def _mesh(surface: RationalSurface, axes: Array, n_around: int, rings: tuple[int, int]) -> Mesh:
    """Tessellate with facets about as long as wide, in the segment's frame, with so many rings at least and at most."""
    sections = surface.points(surface.knots[0][:1], np.linspace(0, 1, 9))[0]
    length = np.linalg.norm(np.diff(sections, axis=0), axis=1).sum()
    ring = surface.points(np.linspace(0, 1, 25), np.array([0.5]))[:, 0]
    around = np.linalg.norm(np.diff(ring, axis=0), axis=1).sum()
    n_along = int(np.clip(round(n_around * length / around), *rings))
    mesh = surface.mesh(n_around, n_along)
    return _transform_mesh(mesh, axes)


def _transform_mesh(mesh: Mesh, to: Array) -> Mesh:
    """Rotate or mirror a mesh: rows of `to` (3, 3) are the images of its axes."""
    faces = mesh.faces if np.linalg.det(to) > 0 else mesh.faces[:, ::-1]
    return Mesh(mesh.vertices_m @ to, faces, None if mesh.normals is None else mesh.normals @ to)


def _cut_skin(segment: Segment, mesh: Mesh, shift_m: float) -> tuple[Part, ...]:
    """Cut the skin where the segment's colours change, `shift_m` further along the parts' own z."""
    for part in segment.parts:
        for border in part.slab_m:
            if np.isfinite(border):
                mesh = split_at(mesh, _heights(part, mesh.vertices_m) - border - shift_m)
    parts = []
    for part in segment.parts:
        low, high = part.slab_m
        piece = faces_between(mesh, _heights(part, mesh.vertices_m), low + shift_m, high + shift_m)
        if len(piece.faces):
            parts.append(Part(part.name, piece, RigidTransform.identity(), part.colour))
    return tuple(parts)


def _heights(part: Part, vertices: Array) -> Array:
    """Return the heights of points of the segment's frame along the part's own z: (v,) [m]."""
    return part.segment_from_part.inv().apply(vertices)[:, 2]
