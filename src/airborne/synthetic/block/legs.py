"""Legs on the floor: how a foot rolls without sliding, and inverse kinematics of a leg from hip to foot.

Angles are those of the preset `human18`; arrays only, n times at once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import ellipeinc

from airborne.geometry.rotations import angles_from_matrix
from airborne.types import Array

_STRAIGHT = 0.99995  # a leg reaches at most this share of its length


class LegSizes(NamedTuple):
    """The lengths of a leg and the size of its foot."""

    thigh_m: float
    shank_m: float
    foot_centre_m: Array  # (3,) of the foot's ellipsoid, from the ankle, foot's frame [m]
    foot_half_length_m: float  # semi-axes of the ellipsoid along y and z
    foot_half_height_m: float


def axis_rotation(axis: int, angle: Array) -> Array:
    """Return the rotations (n, 3, 3) about the axis 0, 1 or 2 by the angles (n,) [rad]."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R = np.zeros((len(angle), 3, 3))
    R[:, axis, axis] = 1
    R[:, i, i] = R[:, j, j] = np.cos(angle)
    R[:, j, i] = np.sin(angle)
    R[:, i, j] = -np.sin(angle)
    return R


def roll_foot(sizes: LegSizes, placement: Array, pitch: Array, lift_m: Array) -> tuple[Array, Array]:
    """Return the position of the ankle (n, 3) [m] and the orientation of the foot (n, 3, 3), world from foot.

    `placement` (n, 3) holds x, y [m] of the foot's middle while the sole is level, and its yaw [rad]; at 0 the
    toes point to -y. `pitch` (n,) [rad] raises the heel: the foot's ellipse then rolls without slip toward the toes.
    `lift_m` (n,) raises the whole foot.
    """
    a, b = sizes.foot_half_length_m, sizes.foot_half_height_m
    sine, cosine = np.sin(pitch), np.cos(pitch)
    height = np.sqrt((a * sine) ** 2 + (b * cosine) ** 2)
    arc = a * ellipeinc(np.arctan2(a * sine, b * cosine), 1 - (b / a) ** 2)  # arc length rolled on the floor
    ahead = arc - (a**2 - b**2) * sine * cosine / height
    yaw = placement[:, 2]
    centre = np.column_stack(
        [placement[:, 0] + np.sin(yaw) * ahead, placement[:, 1] - np.cos(yaw) * ahead, np.asarray(height + lift_m)]
    )
    R = axis_rotation(2, yaw) @ axis_rotation(0, pitch)
    return centre - R @ sizes.foot_centre_m, R


def leg_angles(sizes: LegSizes, R_pelvis: Array, hip: Array, *, ankle: Array, R_foot: Array) -> tuple[Array, Array]:
    """Return the angles (n, 3, 3) [rad] of hip, knee and ankle, and the missing length of the leg (n,) [m].

    `hip` and `ankle` (n, 3) world [m], `R_pelvis` and `R_foot` (n, 3, 3) world from segment. The knee points the same
    way as the toes.
    """
    hip_to_ankle = np.einsum("nji,nj->ni", R_pelvis, ankle - hip)
    length = np.linalg.norm(hip_to_ankle, axis=1)
    a, b = sizes.thigh_m, sizes.shank_m
    reached = np.clip(length, abs(a - b) + 1e-3, _STRAIGHT * (a + b))
    bend = np.pi - np.arccos((a**2 + b**2 - reached**2) / (2 * a * b))
    hip_to_ankle = hip_to_ankle * (reached / length)[:, None]
    twist = _yaw_of(R_foot) - _yaw_of(R_pelvis)
    twist = (twist + np.pi) % (2 * np.pi) - np.pi
    straight = np.column_stack([np.zeros_like(bend), b * np.sin(bend), -a - b * np.cos(bend)])
    rotated = np.einsum("nij,nj->ni", axis_rotation(2, twist), straight)
    across = np.hypot(rotated[:, 0], rotated[:, 2])
    side = np.arctan2(rotated[:, 0], -rotated[:, 2]) - np.arcsin(np.clip(hip_to_ankle[:, 0] / across, -1, 1))
    down = np.cos(side) * rotated[:, 2] - np.sin(side) * rotated[:, 0]
    short = length - reached + np.maximum(np.abs(hip_to_ankle[:, 0]) - across, 0)
    swing = np.arctan2(hip_to_ankle[:, 2], hip_to_ankle[:, 1]) - np.arctan2(down, rotated[:, 1])
    swing = (swing + np.pi) % (2 * np.pi) - np.pi
    knee = np.column_stack([bend, np.zeros_like(bend), np.zeros_like(bend)])
    R_shank = (
        R_pelvis @ axis_rotation(0, swing) @ axis_rotation(1, side) @ axis_rotation(2, twist) @ axis_rotation(0, bend)
    )
    foot = angles_from_matrix(np.swapaxes(R_shank, 1, 2) @ R_foot)
    return np.stack([np.column_stack([swing, side, twist]), knee, foot], axis=1), short


def _yaw_of(R: Array) -> Array:
    """Return the yaw (n,) of a frame that is pitched about its own x axis."""
    return np.arctan2(R[:, 1, 0], R[:, 0, 0])
