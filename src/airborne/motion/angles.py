"""Somersault, tilt and twist of the body's root over time."""

from __future__ import annotations

import numpy as np
import xarray as xr

from airborne.geometry.rotations import angles_from_matrix, angles_from_world_rotation, is_near_singular, unwrap
from airborne.motion.motion import Motion
from airborne.motion.uncertainty import standard_deviation

ROOT_ANGLES = ("somersault", "tilt", "twist")


def root_angles(motion: Motion) -> xr.Dataset:
    """Compute somersault, tilt and twist [deg] of a motion, unwrapped over time, with standard deviations.

    The standard deviations follow from the rotation's covariance to first order. They are NaN where that is unknown or
    infinite, and near +-90 degrees of tilt (gimbal lock: `is_singular`), where somersault and twist are ambiguous.
    """
    radians = unwrap(angles_from_matrix(motion.R), motion.time_s)
    jacobian = angles_from_world_rotation(radians)
    covariance = motion.total_covariance[:, 3:6, 3:6]
    is_known = np.isfinite(covariance).all(axis=(-2, -1), keepdims=True)
    sd = standard_deviation(np.einsum("nij,njk,nik->ni", jacobian, np.where(is_known, covariance, np.nan), jacobian))
    variables: dict = {
        name: ("time", np.rad2deg(radians[:, k]), {"units": "deg"}) for k, name in enumerate(ROOT_ANGLES)
    }
    variables |= {f"{name}_sd": ("time", np.rad2deg(sd[:, k]), {"units": "deg"}) for k, name in enumerate(ROOT_ANGLES)}
    variables["is_singular"] = ("time", is_near_singular(radians))
    coordinates = {"time": ("time", motion.time_s, {"units": "s"}), "frame": ("time", motion.index)}
    return xr.Dataset(variables, coordinates, {"history": ["angles: somersault, tilt, twist, unwrapped"]})
