"""Inverse kinematics of a `human18` in stance: the root follows from the feet and the centre of mass."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Ellipsoid, Pose
from airborne.body.inertia import segment_inertias
from airborne.synthetic.block.legs import LegSizes, leg_angles
from airborne.types import Array

_SIDES = ("left", "right")
# at most; residual that ends them; by which a leg may be too short
_MOST_ITERATIONS, _TOLERANCE_M, _TOO_SHORT_M = 60, 1e-13, 1e-6
_OVER_RELAXATION = 1.2  # the centre of mass follows the root by less than its step


class Poses(NamedTuple):
    """n poses of one body."""

    root_R: Array  # (n, 3, 3) world from root
    root_t: Array  # (n, 3) world [m]
    joint_angles: Array  # (n, 17, 3) [rad]

    def pose(self, i: int) -> Pose:
        """Return the i-th pose."""
        root = RigidTransform.from_components(self.root_t[i], Rotation.from_matrix(self.root_R[i]))
        return Pose(world_from_root=root, joint_angles=self.joint_angles[i])


class Feet(NamedTuple):
    """Positions and orientations of n pairs of feet, left first."""

    ankle: Array  # (2, n, 3) world [m]
    R: Array  # (2, n, 3, 3) world from foot


@dataclass(frozen=True, eq=False)
class Person:
    """A body and its quantities that stance needs."""

    model: BodyModel
    mass_kg: Array  # (segments,)
    centre_m: Array  # (segments, 3) of mass, segments' frames [m]
    leg: LegSizes  # both legs are alike
    hips_m: Array  # (2, 3) root's frame [m]
    joints: NDArray[np.intp]  # (2, 3) rows of hip, knee and ankle among the joints

    @property
    def knees(self) -> NDArray[np.intp]:
        """The rows of both knees among the joints: (2,)."""
        return self.joints[:, 1]

    def pose_segments(self, poses: Poses) -> tuple[Array, Array]:
        """Return R (n, s, 3, 3) and t (n, s, 3) of the segments, world from segment."""
        return self.model.pose_segments(poses.root_R, poses.root_t, poses.joint_angles)

    def centre_of_mass(self, poses: Poses) -> Array:
        """Return the centre of mass: (n, 3) world [m]."""
        R, t = self.pose_segments(poses)
        return np.einsum(
            "s,nsi->ni", self.mass_kg / self.mass_kg.sum(), np.einsum("nsij,sj->nsi", R, self.centre_m) + t
        )

    def landmarks(self, poses: Poses) -> dict[str, Array]:
        """Return the body's landmarks and the tips of the toes, `toe_left` and `toe_right`: (n, 3) world [m] each."""
        R, t = self.pose_segments(poses)
        local = {mark.name: (mark.segment, mark.position_m) for mark in self.model.landmarks}
        tip = self.leg.foot_centre_m - [0, self.leg.foot_half_length_m, 0]
        local |= {f"toe_{side}": (f"foot_{side}", tip) for side in _SIDES}
        positions = {}
        for name, (segment, point) in local.items():
            k = self.model.index_of(segment)
            positions[name] = R[:, k] @ point + t[:, k]
        return positions


@lru_cache(maxsize=64)
def measure_person(model: BodyModel) -> Person:
    """Collect the segment masses and leg sizes of a `human18`."""
    mass, centres, _ = segment_inertias(model)
    segment = {each.name: each for each in model.segments}
    foot = segment["foot_left"].parts[0]
    assert isinstance(foot.shape, Ellipsoid)
    leg = LegSizes(
        thigh_m=float(-segment["shank_left"].joint_m[2]),
        shank_m=float(-segment["foot_left"].joint_m[2]),
        foot_centre_m=foot.segment_from_part.translation,
        foot_half_length_m=float(foot.shape.semi_axes_m[1]),
        foot_half_height_m=float(foot.shape.semi_axes_m[2]),
    )
    hips = np.array([segment[f"thigh_{side}"].joint_m for side in _SIDES])
    joints = np.array([[model.index_of(f"{k}_{side}") - 1 for k in ("thigh", "shank", "foot")] for side in _SIDES])
    return Person(model, mass, centres, leg, hips, joints)


def solve_stance(person: Person, root_R: Array, joint_angles: Array, *, feet: Feet, centre: Array) -> Poses:
    """Solve for the root and leg angles that put the feet in place and the centre of mass at `centre` (n, 3) [m].

    `joint_angles` (n, 17, 3) are those of all other joints. NaN where a leg is too short.
    """
    angles, root, n = np.array(joint_angles, float), np.array(centre, float), len(centre)
    R_pelvis, hips = np.concatenate([root_R, root_R]), np.concatenate([root_R @ hip for hip in person.hips_m])
    ankles, R_feet = feet.ankle.reshape(2 * n, 3), feet.R.reshape(2 * n, 3, 3)
    short = np.zeros(2 * n)
    for _ in range(_MOST_ITERATIONS):
        legs, short = leg_angles(person.leg, R_pelvis, hips + np.concatenate([root, root]), ankle=ankles, R_foot=R_feet)
        angles[:, person.joints[0]], angles[:, person.joints[1]] = legs[:n], legs[n:]
        error = centre - person.centre_of_mass(Poses(root_R, root, angles))
        if np.abs(error).max(initial=0.0) < _TOLERANCE_M:
            break
        root = root + _OVER_RELAXATION * error
    angles[np.any(short.reshape(2, n) > _TOO_SHORT_M, axis=0)] = np.nan
    return Poses(root_R, root, angles)


def upper_body_angles(
    person: Person,
    *,
    trunk: float = 0.0,
    head: float = 0.0,
    arms: tuple[float, float] = (0.0, 0.0),
    elbows: tuple[float, float] = (10.0, 10.0),
    abduction: float = 8.0,
) -> Array:
    """Return joint angles (17, 3) [rad] of a flexed trunk and of arms raised forward, the left first; given in degrees.

    `abduction` is that of the arms. The legs stay straight.
    """
    angles = np.zeros((len(person.model.segments) - 1, 3))

    def set_angles(segment: str, x: float, y: float = 0.0) -> None:
        angles[person.model.index_of(segment) - 1, :2] = x, y

    set_angles("torso", 0.6 * trunk)
    set_angles("chest", 0.4 * trunk)
    set_angles("head", head)
    for side, sign, arm, elbow in zip(_SIDES, (-1, 1), arms, elbows, strict=True):
        set_angles(f"upper_arm_{side}", -arm, sign * abduction)
        set_angles(f"forearm_{side}", -elbow)
    return np.radians(angles)
