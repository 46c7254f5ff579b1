"""Flight: joint angles as prescribed, the centre of mass on its parabola, angular momentum constant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from body import Body, joints_of, pose_of, skin_of
from people import Keys, Person
from rotations import rotation_of

RATE_HZ = 60  # chosen: as of the recorded somersaults
_GRAVITY_M_S2 = 9.81  # of the Earth
_STEPS = 10  # of the orientation, per frame; chosen: three times as many turn twisters as much as 2 cm further
_HALF_STEP_S = 1e-3  # chosen: of the central difference that gives velocities
_OWN_INERTIA_KG_M2 = 0.4  # chosen: of the segments' thickness, which masses on their axes lack
_OF_TRUNK = ("trunk", "trunk_side", "trunk_twist", "head")
_OF_LIMBS = ("arm", "abd", "armrot", "elbow", "hip", "hipabd", "hiprot", "knee", "plantar")
_Segment = tuple[str, str, tuple[float, float], float, float]
_SEGMENTS: tuple[
    _Segment, ...
] = (  # de Leva 1996, about: from, to, share of the mass (men, women), centre and gyration by the length
    ("hip", "knee", (0.1416, 0.1478), 0.4095, 0.33),
    ("knee", "ankle", (0.0433, 0.0481), 0.4395, 0.25),
    ("ankle", "foot", (0.0137, 0.0129), 0.44, 0.25),
    ("shoulder", "elbow", (0.0271, 0.0255), 0.577, 0.28),
    ("elbow", "wrist", (0.0162, 0.0138), 0.457, 0.27),
    ("wrist", "hand", (0.0061, 0.0056), 0.79, 0.5),
)
_MIDDLE_SEGMENTS: tuple[_Segment, ...] = (
    ("pelvis", "neck", (0.4346, 0.4257), 0.52, 0.30),
    ("neck", "head", (0.0694, 0.0668), 0.9, 0.4),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Flight:
    """A person in flight, frame by frame, in the world: z up, the floor at 0."""

    vertices_m: np.ndarray  # (n, vertices, 3), float32
    joints_m: dict[str, np.ndarray]  # (n, 3) by joint
    centres_m: np.ndarray  # (n, 3) of mass


def fly(body: Body, person: Person) -> Flight:
    """Return the flight of a person in the own body."""
    keys = _keys_by_side(person.angles_deg)
    R = np.eye(3)  # of the pelvis
    momentum = np.array(person.angular_momentum, float)
    vertices, joints, centres = [], [], []
    for frame in range(person.n_frames):
        t = frame / RATE_HZ
        pose = pose_of(body, _angles_at(keys, t))
        at_m = joints_of(body, pose)
        points_m, shares = _point_masses(at_m, person.is_female)
        own_centre_m = shares @ points_m
        centre_m = np.array(person.centre_m) + np.array(person.velocity_m_s) * t
        centre_m[2] -= _GRAVITY_M_S2 * t * t / 2
        vertices.append((centre_m + (skin_of(body, pose) - own_centre_m) @ R.T).astype(np.float32))
        joints.append({joint: centre_m + R @ (point_m - own_centre_m) for joint, point_m in at_m.items()})
        centres.append(centre_m)
        for step in range(_STEPS):
            middle_s = t + (step + 0.5) / (RATE_HZ * _STEPS)
            R = R @ rotation_of(_angular_velocity(body, person, keys, middle_s, R.T @ momentum) / (RATE_HZ * _STEPS))
    return Flight(
        vertices_m=np.array(vertices),
        joints_m={joint: np.array([each[joint] for each in joints]) for joint in joints[0]},
        centres_m=np.array(centres),
    )


def _angular_velocity(
    body: Body, person: Person, keys: dict[str, Keys], time_s: float, momentum: np.ndarray
) -> np.ndarray:
    """Return the pelvis's angular velocity (3,) [rad/s] for an angular momentum, both in the pelvis's frame."""
    before, now, after = (
        _about_centre(body, person, keys, time_s + late_s) for late_s in (-_HALF_STEP_S, 0, _HALF_STEP_S)
    )
    _, shares = now
    q, velocity = now[0], (after[0] - before[0]) / (2 * _HALF_STEP_S)
    about_axes = np.einsum("i,ij,ij->", shares, q, q) * np.eye(3) - np.einsum("i,ij,ik->jk", shares, q, q)
    inertia = person.mass_kg * about_axes + _OWN_INERTIA_KG_M2 * np.eye(3)
    of_limbs = person.mass_kg * shares @ np.cross(q, velocity)
    return np.linalg.solve(inertia, momentum - of_limbs)


def _about_centre(body: Body, person: Person, keys: dict[str, Keys], time_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the point masses about their centre (m, 3) [m], and their shares (m,)."""
    joints_m = joints_of(body, pose_of(body, _angles_at(keys, time_s)))
    points_m, shares = _point_masses(joints_m, person.is_female)
    return points_m - shares @ points_m, shares


def _point_masses(joints_m: dict[str, np.ndarray], is_female: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return two points for each segment, as far apart as its gyration asks: (m, 3) [m], shares of the mass (m,)."""
    sided = [(f"{a}_{side}", f"{b}_{side}", m, c, g) for side in ("left", "right") for a, b, m, c, g in _SEGMENTS]
    points, shares = [], []
    for start, end, mass_shares, centre, gyration in (*sided, *_MIDDLE_SEGMENTS):
        length_m = joints_m[end] - joints_m[start]
        for sign in (-1, 1):
            points.append(joints_m[start] + (centre + sign * gyration) * length_m)
            shares.append(mass_shares[is_female] / 2)
    return np.array(points), np.array(shares) / np.sum(shares)


def _keys_by_side(keys: dict[str, Keys]) -> dict[str, Keys]:
    """Return the keys of each angle; what has no side is of both, where a side has none of its own."""
    both = {f"{name}_{side}": keys[name] for name in _OF_LIMBS if name in keys for side in "lr"}
    return both | {name: value for name, value in keys.items() if name not in _OF_LIMBS}


def _angles_at(keys: dict[str, Keys], time_s: float) -> dict[str, float]:
    """Return all angles [deg] at a time; 0 without keys."""
    names = (*_OF_TRUNK, *(f"{name}_{side}" for name in _OF_LIMBS for side in "lr"))
    return {name: _step(keys[name], time_s) if name in keys else 0.0 for name in names}


def _step(keys: Keys, time_s: float) -> float:
    """Return an angle [deg] on polynomials of degree five between keys, at rest at each."""
    times, angles = zip(*keys, strict=True)
    if time_s <= times[0] or time_s >= times[-1]:
        return angles[0] if time_s <= times[0] else angles[-1]
    k = int(np.searchsorted(times, time_s, side="right")) - 1
    u = (time_s - times[k]) / (times[k + 1] - times[k])
    return angles[k] + (angles[k + 1] - angles[k]) * u**3 * (10 - 15 * u + 6 * u * u)
