"""Somersault, tilt and twist of the body's root over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airborne.geometry.rotations import angles_from_matrix, angles_from_world_rotation, is_near_singular, unwrap
from airborne.motion.motion import Motion
from airborne.motion.uncertainty import standard_deviation
from airborne.types import Array, Mask

ROOT_ANGLES = ("somersault", "tilt", "twist")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RootAngles:
    """Somersault, tilt and twist over time, in this order."""

    deg: Array  # (n, 3) [deg], unwrapped over time; NaN where lost
    sd_deg: Array  # (n, 3) [deg]
    is_singular: Mask  # (n,) near +-90 degrees of tilt


def root_angles(motion: Motion) -> RootAngles:
    """Compute somersault, tilt and twist [deg] of a motion, unwrapped over time, with standard deviations.

    The standard deviations follow from the rotation's covariance to first order. They are NaN where that is unknown or
    infinite, and near +-90 degrees of tilt (gimbal lock: `is_singular`), where somersault and twist are ambiguous.
    """
    radians = unwrap(angles_from_matrix(motion.R), motion.time_s)
    jacobian = angles_from_world_rotation(radians)
    covariance = motion.total_covariance[:, 3:6, 3:6]
    is_known = np.isfinite(covariance).all(axis=(-2, -1), keepdims=True)
    sd = standard_deviation(np.einsum("nij,njk,nik->ni", jacobian, np.where(is_known, covariance, np.nan), jacobian))
    return RootAngles(deg=np.rad2deg(radians), sd_deg=np.rad2deg(sd), is_singular=is_near_singular(radians))
