"""Smoothing of orientations: as continuous quaternions, never as angles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airborne.motion.smoothing.segments import Smoother, smooth_stretches
from airborne.types import Array


@dataclass(frozen=True, slots=True, eq=False)
class SmoothedRotations:
    """Orientations over time; NaN where unknown. Standard deviations are the same about every axis."""

    R: Array  # (n, 3, 3)
    velocity: Array  # (n, 3) [rad/s], in the axes that R maps to
    acceleration: Array  # (n, 3) [rad/s2]
    sd: Array  # (n,) [rad], of a rotation vector
    velocity_sd: Array  # (n,) [rad/s]
    acceleration_sd: Array  # (n,) [rad/s2]
    segment: NDArray[np.int64]  # (n,)
    is_filled: NDArray[np.bool_]  # (n,)


def continuous_quaternions(R: Array) -> Array:
    """Return quaternions (n, 4) x, y, z, w of rotations (n, 3, 3), each with the sign nearest to its predecessor."""
    quaternion = np.full((len(R), 4), np.nan)
    rows = np.flatnonzero(np.isfinite(R).all(axis=(1, 2)))
    if len(rows):
        q = Rotation.from_matrix(R[rows]).as_quat()
        is_across = np.einsum("ni,ni->n", q[1:], q[:-1]) < 0
        signs = np.concatenate([[1.0], np.cumprod(np.where(is_across, -1.0, 1.0))])
        quaternion[rows] = q * signs[:, None]
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
    """Smooth orientations (n, 3, 3) whose rotation vectors have variances (n,) [rad2], the same about every axis.

    The four components of the continuous quaternions are smoothed like a path and normalised; they rotate by half the
    body's angle, so rotations reach a filter's cut-off at twice its frequency. Angular velocity and acceleration are
    the exact derivatives of the result: w = 2 q' q* / |q|2. See `smooth_stretches`.
    """
    quarter = np.asarray(variance)[:, None, None] / 4  # a rotation by d moves the quaternion by d / 2
    covariance = np.where(np.eye(4, dtype=bool), quarter, 0.0)
    pieces = smooth_stretches(
        smooth, time_s, continuous_quaternions(R), covariance, boundaries_s=boundaries_s, fill_s=fill_s
    )
    q, dq, ddq = pieces.paths.value, pieces.paths.velocity, pieces.paths.acceleration
    squared = (q**2).sum(axis=1, keepdims=True)
    velocity = 2 * _vector_of_product(dq, q) / squared
    stretching = (q * dq).sum(axis=1, keepdims=True) / squared
    acceleration = 2 * _vector_of_product(ddq, q) / squared - 2 * stretching * velocity
    matrix = np.full((len(q), 3, 3), np.nan)
    is_known = np.isfinite(q).all(axis=1)
    if is_known.any():
        matrix[is_known] = Rotation.from_quat(q[is_known]).as_matrix()
    paths = pieces.paths
    sds = [2 * sd[:, 0] for sd in (paths.value_sd, paths.velocity_sd, paths.acceleration_sd)]
    return SmoothedRotations(matrix, velocity, acceleration, sds[0], sds[1], sds[2], pieces.segment, pieces.is_filled)


def _vector_of_product(p: Array, q: Array) -> Array:
    """Return the vector part of p q* for quaternions (n, 4), x, y, z, w."""
    u, a, v, b = p[:, :3], p[:, 3:], q[:, :3], q[:, 3:]
    return b * u - a * v - np.cross(u, v)
