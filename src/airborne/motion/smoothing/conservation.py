"""What holds in free flight, as rows that join three frames each: the centre of mass falls, nothing turns the body.

The angular momentum about the centre of mass is constant. Between two frames it is that of point masses that go from
where they are in one to where they are in the other: sum of m p x q / dt, about the centre of mass. Every segment is as
six of them, of the same mass, centre and second moments (an equimomental system: Routh 1905, "Elementary Rigid
Dynamics", section 33).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Pose
from airborne.body.chain import point_jacobian
from airborne.body.inertia import segment_inertias
from airborne.constants import FREE_FALL_M_S2
from airborne.geometry.banded_equations import JoiningRows
from airborne.motion.flight.fall import fit_fall
from airborne.motion.flight.momentum import centre_of_mass
from airborne.types import Array

# [m2/s3] of the centre of mass's acceleration beside gravity, an sd of 0.3 m/s2 at 50 frames/s; chosen: of 0.3, 0.5, 1
# m/s2 the least errors of six synthetic people, four of them tracked with bodies of other lengths and girths
_FALL_DENSITY = 0.3**2 / 50
# [rad2/s3] of what turns the whole body in flight, an sd of 2.5 rad/s2 at 50 frames/s: it seems to be turned as it
# bends, for its masses are not quite the person's. Chosen: of 1, 2.5, 7, 20 rad/s2 and none, joints of six synthetic
# people, all of other bones than the body's, err least; angular momenta by 0.9 kg m2/s about the worst axis, with none
# by 1.3
_TURN_DENSITY = 2.5**2 / 50


def fall_offset_m(model: BodyModel, poses: Sequence[Pose], time_s: Array) -> Array:
    """Return by what the centre of mass lies beside the body's, in the root's frame, to fall as it does: (3,) [m].

    The body's masses are not quite the person's; see `fit_fall`.
    """
    place = np.array([centre_of_mass(model.with_pose(pose))[0] for pose in poses])
    return fit_fall(time_s, place, np.array([pose.world_from_root.rotation.as_matrix() for pose in poses])).offset_m


def fall_rows(model: BodyModel, poses: Sequence[Pose], time_s: Array, offset_m: Array) -> JoiningRows:
    """Return how far the acceleration of the centre of mass is from gravity: in sds, three of each three frames.

    It lies by an offset (3,) in the root's frame beside that of the body.
    """
    centres = [centre_of_mass(model.with_pose(pose)) for pose in poses]
    offsets = np.array([pose.world_from_root.rotation.apply(offset_m) for pose in poses])
    place, slope = np.array([each[0] for each in centres]) + offsets, np.array([each[1] for each in centres])
    slope[:, :, 3:6] -= np.cross(offsets[:, None], np.eye(3)).swapaxes(1, 2)  # w x offset
    before_s, after_s = np.diff(time_s)[:-1], np.diff(time_s)[1:]
    between_s, n = (before_s + after_s) / 2, len(before_s)
    weights = np.stack([1 / before_s, -1 / before_s - 1 / after_s, 1 / after_s], axis=1) / between_s[:, None]
    values = sum(weights[:, j, None] * place[j : n + j] for j in range(3)) - FREE_FALL_M_S2
    rows = np.stack([weights[:, j, None, None] * slope[j : n + j] for j in range(3)], axis=2)
    sd = np.sqrt(_FALL_DENSITY / between_s)[:, None, None]
    return JoiningRows(rows[:, None] / sd[..., None, None], values[:, None] / sd)


def momentum_rows(model: BodyModel, poses: Sequence[Pose], time_s: Array) -> JoiningRows:
    """Return how much the angular momentum about the centre of mass changes: in sds, three of each three frames."""
    (owners, local_m, mass_kg), step_s = _point_masses(model), np.diff(time_s)
    bodies = [model.with_pose(pose) for pose in poses]
    points = np.array([np.einsum("pij,pj->pi", each.R[owners], local_m) + each.t[owners] for each in bodies])
    pairs = zip(bodies, points, strict=True)
    change = np.array([point_jacobian(each, owners, of_it).swapaxes(1, 2) for each, of_it in pairs])  # (n, p, d, 3)
    arms = points - (mass_kg @ points / mass_kg.sum())[:, None]
    weights = mass_kg / step_s[:, None]
    momentum = np.einsum("np,npi->ni", weights, np.cross(arms[:-1], arms[1:]))
    by_earlier = np.einsum("np,npdi->nid", weights, np.cross(change[:-1], arms[1:, :, None]))
    by_later = np.einsum("np,npdi->nid", weights, np.cross(arms[:-1, :, None], change[1:]))
    rows = np.stack([-by_earlier[:-1], by_earlier[1:] - by_later[:-1], by_later[1:]], axis=2)
    inertia_kg_m2 = 2 / 3 * np.mean(np.sum(mass_kg[:, None] * arms**2, axis=(1, 2)))
    sd = inertia_kg_m2 * np.sqrt(_TURN_DENSITY * (step_s[:-1] + step_s[1:]) / 2)[:, None, None]
    return JoiningRows((rows / sd[..., None])[:, None], np.diff(momentum, axis=0)[:, None] / sd)


def _point_masses(model: BodyModel) -> tuple[NDArray[np.int64], Array, Array]:
    """Return whose they are (p,), places in segments (p, 3) [m] and masses (p,) [kg]: six of every segment's."""
    mass, centre, tensor = segment_inertias(model)
    second = np.trace(tensor, axis1=1, axis2=2)[:, None, None] / 2 * np.eye(3) - tensor  # integral of r r' dm
    squares, axes = np.linalg.eigh(second / mass[:, None, None])
    arms = np.sqrt(3 * np.maximum(squares, 0))[:, :, None] * axes.swapaxes(1, 2)  # (segments, 3 points, 3)
    places = centre[:, None] + np.concatenate([arms, -arms], axis=1)
    return np.repeat(np.arange(len(mass)), 6), places.reshape(-1, 3), np.repeat(mass / 6, 6)
