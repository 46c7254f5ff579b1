"""Smoothing of orientations: as quaternions that run on over time, never as angles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airborne.motion.smoothing.segments import Smoother, in_stretches

Array = NDArray[np.floating]


@dataclass(frozen=True, slots=True, eq=False)
class SmoothedRotations:
    """Orientations over time; NaN where unknown. Deviations are the same about every axis."""

    R: Array  # (n, 3, 3)
    velocity: Array  # (n, 3) [rad/s], in the axes that R maps to
    acceleration: Array  # (n, 3) [rad/s2]
    sd: Array  # (n,) [rad], of a rotation vector
    velocity_sd: Array  # (n,) [rad/s]
    acceleration_sd: Array  # (n,) [rad/s2]
    segment: NDArray[np.int64]  # (n,)
    is_filled: NDArray[np.bool_]  # (n,)


def continuous_quaternions(R: Array) -> Array:
    """Return quaternions (n, 4) x, y, z, w of rotations (n, 3, 3), each on the side of the known one before it."""
    quaternion = np.full((len(R), 4), np.nan)
    known = np.flatnonzero(np.isfinite(R).all(axis=(1, 2)))
    if len(known):
        found = Rotation.from_matrix(R[known]).as_quat()
        is_across = np.einsum("ni,ni->n", found[1:], found[:-1]) < 0
        signs = np.concatenate([[1.0], np.cumprod(np.where(is_across, -1.0, 1.0))])
        quaternion[known] = found * signs[:, None]
    return quaternion


def smooth_rotations(
    smooth: Smoother,
    time_s: Array,
    R: Array,
    variance: Array,
    *,
    boundaries_s: Sequence[float] = (),
    fill_s: float = 0.0,
) -> SmoothedRotations:
    """Smooth orientations (n, 3, 3) whose rotation vectors have these variances (n,) [rad2], alike about every axis.

    The four components of the continuous quaternions are smoothed as a path is and brought back to unit length; they
    move at half the speed of the body, so that a filter's cut-off is met by turns twice as fast. Angular velocity and
    acceleration are the exact derivatives of what results: w = 2 q' q* / |q|2. See `in_stretches`.
    """
    quarter = np.asarray(variance)[:, None, None] / 4  # a turn by d moves the quaternion by d / 2
    covariance = np.where(np.eye(4, dtype=bool), quarter, 0.0)
    pieces = in_stretches(
        smooth, time_s, continuous_quaternions(R), covariance, boundaries_s=boundaries_s, fill_s=fill_s
    )
    q, speed, bend = pieces.smoothed.value, pieces.smoothed.velocity, pieces.smoothed.acceleration
    squared = (q**2).sum(axis=1, keepdims=True)
    velocity = 2 * _vector_of_product(speed, q) / squared
    stretching = (q * speed).sum(axis=1, keepdims=True) / squared
    acceleration = 2 * _vector_of_product(bend, q) / squared - 2 * stretching * velocity
    matrix = np.full((len(q), 3, 3), np.nan)
    is_known = np.isfinite(q).all(axis=1)
    if is_known.any():
        matrix[is_known] = Rotation.from_quat(q[is_known]).as_matrix()
    found = pieces.smoothed
    sds = [2 * each[:, 0] for each in (found.value_sd, found.velocity_sd, found.acceleration_sd)]
    return SmoothedRotations(matrix, velocity, acceleration, sds[0], sds[1], sds[2], pieces.segment, pieces.is_filled)


def _vector_of_product(p: Array, q: Array) -> Array:
    """Return the vector part of p q* for quaternions (n, 4), x, y, z, w."""
    u, a, v, b = p[:, :3], p[:, 3:], q[:, :3], q[:, 3:]
    return b * u - a * v - np.cross(u, v)
