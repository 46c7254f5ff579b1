"""Somersault, tilt and twist of the body's root over time."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from airborne.geometry.rotations import angles_from_matrix, angles_from_world_rotation, is_near_singular, unwrapped
from airborne.motion.motion import Motion
from airborne.motion.uncertainty import deviation

Array = NDArray[np.floating]

ANGLES = ("somersault", "tilt", "twist")


def angles(motion: Motion) -> xr.Dataset:
    """Read somersault, tilt and twist [deg] off a motion, unwrapped over time, with standard deviations.

    The deviations follow from the rotation's covariance to first order; NaN where that is unknown or infinite, and
    near +-90 degrees of tilt, where `is_singular` says that somersault and twist cannot be told apart.
    """
    radians = unwrapped(angles_from_matrix(motion.R), motion.time_s)
    jacobian = angles_from_world_rotation(radians)
    covariance = motion.covariance[:, 3:6, 3:6]
    is_known = np.isfinite(covariance).all(axis=(-2, -1), keepdims=True)
    sd = deviation(np.einsum("nij,njk,nik->ni", jacobian, np.where(is_known, covariance, np.nan), jacobian))
    variables: dict = {name: ("time", np.rad2deg(radians[:, k]), {"units": "deg"}) for k, name in enumerate(ANGLES)}
    variables |= {f"{name}_sd": ("time", np.rad2deg(sd[:, k]), {"units": "deg"}) for k, name in enumerate(ANGLES)}
    variables["is_singular"] = ("time", is_near_singular(radians))
    coordinates = {"time": ("time", motion.time_s, {"units": "s"}), "frame": ("time", motion.index)}
    return xr.Dataset(variables, coordinates, {"history": ["angles: somersault, tilt, twist, unwrapped"]})
