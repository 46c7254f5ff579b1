"""Margins to impossible motions: through the floor or the net, beyond a joint's limit, through another player."""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np

from airborne.body import surface_arrays
from airborne.geometry.rotations import matrix_from_angles
from airborne.synthetic.block.posture import Person, Poses
from airborne.types import Array

NET_TOP_M = 2.43  # men's net (FIVB rules of volleyball 2.1.1)
_NET_CLEAR_M = 0.03  # hands pass this far above the tape
_LATTICE = np.array([p for p in product((-1.0, 0.0, 1.0), repeat=3) if any(p)])
_SPHERE = _LATTICE / np.linalg.norm(_LATTICE, axis=1, keepdims=True)  # (26, 3)
_BONES: tuple[tuple[str, str, float], ...] = (  # a capsule's ends and its radius [m] for a person of 1.80 m
    ("hip_left", "knee_left", 0.085),
    ("hip_right", "knee_right", 0.085),
    ("knee_left", "ankle_left", 0.055),
    ("knee_right", "ankle_right", 0.055),
    ("ankle_left", "toe_left", 0.045),
    ("ankle_right", "toe_right", 0.045),
    ("pelvis", "torso", 0.14),
    ("torso", "neck", 0.13),
    ("shoulder_left", "shoulder_right", 0.06),
    ("neck", "head", 0.095),
    ("shoulder_left", "elbow_left", 0.05),
    ("shoulder_right", "elbow_right", 0.05),
    ("elbow_left", "wrist_left", 0.045),
    ("elbow_right", "wrist_right", 0.045),
    ("wrist_left", "hand_left", 0.06),
    ("wrist_right", "hand_right", 0.06),
)


class Margins(NamedTuple):
    """Margins, negative where violated; NaN where the legs cannot reach the feet."""

    floor_m: float  # of the lowest point above the floor
    net_m: float  # to the net's plane, of all that is not above the tape
    limits_rad: float  # to the nearest limit of a joint


class BodyVolume(NamedTuple):
    """The volume of a body at n times: c capsules."""

    start: Array  # (n, c, 3) world [m]
    end: Array  # (n, c, 3)
    radius_m: Array  # (c,)


def margins_of(person: Person, poses: Poses, *, side: float) -> Margins:
    """Measure n poses; `side` is -1 for players on y < 0, +1 for their opponents."""
    R, t = person.pose_segments(poses)
    flat = surface_arrays(person.model)
    owner = flat.ellipsoid_segment
    axes = R[:, owner] @ (flat.ellipsoid_axes * flat.ellipsoid_semi_axes[:, None, :])  # (n, e, 3, 3)
    centre = np.einsum("neij,ej->nei", R[:, owner], flat.ellipsoid_centre) + t[:, owner]
    lowest = centre[..., 2] - np.linalg.norm(axes[:, :, 2], axis=-1)
    surface = centre[:, :, None] + np.einsum("neij,kj->neki", axes, _SPHERE)
    from_net = np.where(surface[..., 2] < NET_TOP_M + _NET_CLEAR_M, side * surface[..., 1], np.inf)
    slack = person.model.limits.slack(matrix_from_angles(poses.joint_angles))
    return Margins(float(lowest.min()), float(from_net.min()), float(slack.min()))


def capsules_of(person: Person, poses: Poses, stature_m: float) -> BodyVolume:
    """Return the volume of a person in n poses."""
    marks = person.landmarks(poses)
    starts, stops = (np.stack([marks[name] for name in names], axis=1) for names in list(zip(*_BONES, strict=True))[:2])
    return BodyVolume(starts, stops, np.array([radius for *_, radius in _BONES]) * stature_m / 1.80)


def gap_m(one: BodyVolume, other: BodyVolume) -> float:
    """Return the least distance [m] between two players' capsules over n times; negative where they overlap."""
    (a, b, r), (c, d, s) = one, other
    distance = _segment_distances(a[:, :, None], b[:, :, None], c[:, None], d[:, None])
    return float((distance - r[:, None] - s[None, :]).min())


def _segment_distances(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Return the distances between the segments a-b and c-d (..., 3), broadcast: (...).

    The nearest points of the two lines, each clipped to its segment in turn, then the nearest point of the other.
    """
    u, v, w = b - a, d - c, a - c
    uu, uv, vv = (np.einsum("...i,...i->...", *pair) for pair in ((u, u), (u, v), (v, v)))
    uw, vw = (np.einsum("...i,...i->...", each, w) for each in (u, v))
    det = uu * vv - uv * uv
    s = np.clip(np.where(det > 1e-12, (uv * vw - vv * uw) / np.maximum(det, 1e-12), 0.0), 0, 1)
    t = np.clip((uv * s + vw) / vv, 0, 1)
    s = np.clip((uv * t - uw) / uu, 0, 1)
    return np.linalg.norm(w + s[..., None] * u - t[..., None] * v, axis=-1)
