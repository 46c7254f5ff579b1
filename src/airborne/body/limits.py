"""Limits of joints, on their rotations: a swing of the segment's long axis from a centre, and a twist about it.

parent_from_segment = centre S T: S turns the long axis, z, away from the centre's, T turns the segment about it. The
swing of a ball joint (hip, shoulder, spine) ends on an ellipse, that of a hinge or a saddle (knee, elbow, wrist, ankle)
on a rectangle, narrow across a hinge.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.geometry.joint_rotations import fill_exponential, fill_rotation
from airborne.geometry.rotations import angles_from_matrix, matrix_from_angles
from airborne.geometry.swing_twist import fill_swing_twist, rotation_of, swing_twist_from_matrix
from airborne.kernels import kernel
from airborne.types import Array

_BALL_RAD = np.radians(20)  # a range of angles wider than this, to both sides of its middle, about x and y: a ball
_MOST_RAD = np.radians(175)  # of a swing's half range taken from angles: it must not reach right round


@dataclass(frozen=True, slots=True, eq=False)
class JointLimits:
    """The range of one joint, or stacked along a first axis, of all joints of a body."""

    centre: Array  # (..., 3, 3) the middle of the range, parent from segment
    half_rad: Array  # (..., 3) swing about the centre's x and y, twist, to either side [rad]; inf: free
    is_ball: NDArray[np.bool_]  # (...) the swing ends on an ellipse, else on a rectangle
    is_from_angles: bool = False  # given as ranges of angles, in an older body file

    @classmethod
    def from_angles(cls, ranges_rad: Array) -> JointLimits:
        """Turn ranges of x-y-z angles (3, 2) [rad] into limits with the same middle and the same widths."""
        ranges = np.clip(ranges_rad, -np.pi, np.pi)
        middle, half = ranges.mean(axis=1), np.minimum(np.diff(ranges, axis=1)[:, 0] / 2, _MOST_RAD)
        half = np.where(np.isfinite(ranges_rad).any(axis=1), half, np.inf)
        return cls(matrix_from_angles(middle), half, np.asarray(half[:2].min() > _BALL_RAD), is_from_angles=True)

    @classmethod
    def stack(cls, limits: Iterable[JointLimits]) -> JointLimits:
        """Stack the limits of joints."""
        each = list(limits)
        return cls(
            np.array([one.centre for one in each]).reshape(-1, 3, 3),
            np.array([one.half_rad for one in each]).reshape(-1, 3),
            np.array([one.is_ball for one in each], bool),
        )

    @property
    def is_limited(self) -> NDArray[np.bool_]:
        """Whether the joint has any limit: (...)."""
        return np.asarray(np.isfinite(self.half_rad).any(axis=-1))

    @property
    def centre_angles_rad(self) -> Array:
        """The centre as x-y-z angles: (..., 3) [rad]."""
        return angles_from_matrix(self.centre)

    @property
    def angle_ranges_rad(self) -> Array:
        """Ranges of the x-y-z angles about the centre's: (..., 3, 2) [rad], for formats that know no other limits."""
        half = self.half_rad[..., None] * [-1, 1]
        return np.clip(self.centre_angles_rad[..., None] + half, -np.pi, np.pi)

    def relative(self, R: Array) -> Array:
        """Return rotations (..., 3, 3), parent from segment, relative to the centre."""
        return np.swapaxes(self.centre, -1, -2) @ R

    def coordinates(self, R: Array) -> Array:
        """Return the swing's x and y, and the twist, of rotations parent from segment: (..., 3) [rad]."""
        return swing_twist_from_matrix(self.relative(R))

    def rotation(self, coordinates: Array) -> Array:
        """Return the rotations (..., 3, 3), parent from segment, of swings and twists (..., 3) [rad]."""
        return self.centre @ rotation_of(coordinates)

    def nearest(self, coordinates: Array) -> Array:
        """Return the nearest coordinates (..., 3) within the limits; a ball's swing goes back on its own meridian."""
        shape = np.broadcast_shapes(coordinates.shape, self.half_rad.shape)
        bounded = np.array(np.broadcast_to(coordinates, shape), float)
        half = np.ascontiguousarray(self.half_rad, float).reshape(-1, 3)
        _bound(bounded.reshape(-1, 3), half, np.ascontiguousarray(self.is_ball).reshape(-1))
        return bounded

    def move(self, angles: Array, rotation_vectors: Array) -> tuple[Array, Array]:
        """Return where joints of x-y-z angles (joints, 3) are after rotations about their own axes (joints, 3) [rad].

        Their coordinates (joints, 3), and the nearest ones within the limits, which are those of all joints.
        """
        half, is_ball = np.ascontiguousarray(self.half_rad, float), np.ascontiguousarray(self.is_ball)
        vectors = np.ascontiguousarray(rotation_vectors, float)
        return _move(self.centre, half, is_ball, np.ascontiguousarray(angles, float), vectors)

    def excess(self, R: Array) -> Array:
        """Return how far rotations (..., 3, 3) lie beyond the limits, along each coordinate: (..., 3) [rad]."""
        coordinates = self.coordinates(R)
        return coordinates - self.nearest(coordinates)

    def slack(self, R: Array) -> Array:
        """Return the angle (...) [rad] to the nearest limit; negative beyond it."""
        size = np.abs(self.coordinates(R))
        swing = (self.half_rad - size)[..., :2].min(axis=-1)
        reach = np.hypot(size[..., 0] / self.half_rad[..., 0], size[..., 1] / self.half_rad[..., 1])
        swing = np.where(self.is_ball, (1 - reach) * self.half_rad[..., :2].min(axis=-1), swing)
        return np.minimum(swing, self.half_rad[..., 2] - size[..., 2])

    def clamp(self, R: Array) -> Array:
        """Return the nearest rotations (..., 3, 3) within the limits; those within keep every bit."""
        coordinates = self.coordinates(R)
        bounded = self.nearest(coordinates)
        is_out = np.any(bounded != coordinates, axis=-1)
        return np.where(is_out[..., None, None], self.rotation(bounded), R)


@kernel
def _bound(coordinates, half, is_ball):
    """Bound coordinates (n, 3), of the joints again and again: half (joints, 3), is_ball (joints,)."""
    for n in range(len(coordinates)):
        k = n % len(half)
        _bound_joint(coordinates[n], half[k], is_ball[k])


@kernel(is_inner=True)
def _bound_joint(coordinates, half, is_ball):
    """Bound the coordinates (3,) of one joint."""
    reach = max(math.hypot(coordinates[0] / half[0], coordinates[1] / half[1]), 1.0) if is_ball else 1.0
    for axis in range(3):
        if axis < 2 and is_ball:
            coordinates[axis] /= reach
        else:
            coordinates[axis] = min(max(coordinates[axis], -half[axis]), half[axis])


@kernel
def _move(centre, half, is_ball, angles, rotation_vectors):
    """Return coordinates and bounds as `JointLimits.move`."""
    after, bound = np.empty_like(angles), np.empty_like(angles)
    first, turn, relative = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    for k in range(len(angles)):
        fill_rotation(angles[k], first)
        fill_exponential(rotation_vectors[k], turn)
        for a in range(3):
            for b in range(3):
                relative[a, b] = 0.0
                for c in range(3):
                    inside = (
                        centre[k, 0, a] * first[0, c] + centre[k, 1, a] * first[1, c] + centre[k, 2, a] * first[2, c]
                    )
                    relative[a, b] += inside * turn[c, b]
        fill_swing_twist(relative, after[k])
        for a in range(3):
            bound[k, a] = after[k, a]
        _bound_joint(bound[k], half[k], is_ball[k])
    return after, bound


FREE = JointLimits(np.eye(3), np.full(3, np.inf), np.asarray(False))  # a joint without limits
