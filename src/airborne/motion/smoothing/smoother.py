"""Smoothed motions: positions, orientations and joints with velocities and accelerations, as labelled arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from itertools import pairwise

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from airborne.body import BodyModel
from airborne.body.chain import nearest_angles
from airborne.errors import ResultError
from airborne.geometry.rotations import angles_from_matrix, is_near_singular, matrix_from_angles, unwrap
from airborne.motion.angles import ROOT_ANGLES
from airborne.motion.flight.momentum_table import has_inertias, measure_flight
from airborne.motion.joints import known_landmarks, require_body
from airborne.motion.motion import Motion
from airborne.motion.players import PlayersMotion
from airborne.motion.smoothing import (
    SmoothedPaths,
    SmoothedRotations,
    SmoothedSegments,
    continuous_quaternions,
    smooth_rotations,
    smooth_stretches,
)
from airborne.motion.smoothing.free_rotation import conserve_momentum
from airborne.motion.smoothing.segments import finite_rows
from airborne.motion.smoothing.settings import Smoothing
from airborne.types import Array, Progress

CENTRE_OF_MASS = "centre_of_mass"


def smooth_root(motion: Motion, model: BodyModel, smoothing: Smoothing, boundaries_s: Sequence[float]) -> xr.Dataset:
    """Smooth a body's root: position, velocity, acceleration; orientation, angular velocity and acceleration.

    The position is smoothed with the position's covariance, the orientation with the mean variance of its rotation
    vector; the Kalman smoother conserves the angular momentum of free flights. Angular velocities are in world axes.
    """
    smooth = smoothing.smoother(has_joints=bool(motion.joints))
    of_position, fill_s = motion.covariance[:, :3, :3], smoothing.fill_s
    variance = _mean_variance(motion.covariance[:, 3:6, 3:6])
    _require_covariances(smoothing, motion.position, of_position)
    position = smooth_stretches(
        smooth, motion.time_s, motion.position, of_position, boundaries_s=boundaries_s, fill_s=fill_s
    )
    rotation = smooth_rotations(smooth, motion.time_s, motion.R, variance, boundaries_s=boundaries_s, fill_s=fill_s)
    history, filtered = smoothing.history(boundaries_s), rotation
    if smoothing.way.conserves_momentum:
        rotation = conserve_momentum(filtered, motion, model)
    if rotation is not filtered:
        history.append("in free flight the root turns with a constant angular momentum")
    space, radians = ("time", "space"), unwrap(angles_from_matrix(rotation.R), motion.time_s)
    quaternion = continuous_quaternions(rotation.R)
    variables: dict = _position_variables(position, space, motion.status)
    variables |= {"quaternion": (("time", "component"), quaternion, {"units": "1", "map": "world_from_root"})}
    variables |= _rotation_variables(rotation, space)
    variables |= {name: ("time", np.rad2deg(radians[:, k]), {"units": "deg"}) for k, name in enumerate(ROOT_ANGLES)}
    variables["is_singular"] = ("time", is_near_singular(radians))
    coordinates = _coordinates(motion.time_s, motion.index) | {"space": list("xyz"), "component": list("xyzw")}
    return xr.Dataset(variables, coordinates, {"history": history})


def smooth_landmarks(
    motion: Motion,
    model: BodyModel,
    smoothing: Smoothing,
    boundaries_s: Sequence[float],
    *,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Smooth the paths of a body's landmarks, and of its centre of mass where it has masses: (time, joint, space).

    Each landmark has its own standard deviation, the same along all axes; where no image shows it is a gap.
    `joint_status` (time, joint) is that of the tracked landmark, of the centre of mass the frame's. Raises ResultError
    for another body's motion.
    """
    points, sd, status = known_landmarks(motion, model)
    names = [landmark.name for landmark in model.landmarks]
    covariance = np.where(np.eye(3, dtype=bool), sd[..., None, None] ** 2, 0.0)
    lasting = None
    if has_inertias(model):
        table = measure_flight(motion, model)
        names_of_com = "com", "com_sd_frame", "com_sd"
        com, com_sd, whole_sd = (table[name].transpose("time", "space").to_numpy() for name in names_of_com)
        lasting = whole_sd**2 - com_sd**2
        points = np.concatenate([points, com[:, None]], axis=1)
        diagonal = np.where(np.eye(3, dtype=bool), com_sd[:, None, :] ** 2, 0.0)
        covariance, names = np.concatenate([covariance, diagonal[:, None]], axis=1), [*names, CENTRE_OF_MASS]
        status = np.concatenate([status, motion.status[:, None]], axis=1)
    own = [boundaries_s] * len(names)
    segments = _smooth_points(
        motion.time_s,
        points,
        covariance,
        smoothing,
        boundaries_s=own,
        has_joints=bool(motion.joints),
        progress=progress,
    )
    if lasting is not None:  # errors of the centre of mass that last all run are not smoothed away
        sd, known = segments.paths.value_sd[:, -1], finite_rows(lasting)
        usual = np.median(lasting[known], axis=0) if known.any() else np.nan
        sd[:] = np.sqrt(sd**2 + np.where(known[:, None], lasting, usual))
    coordinates = _coordinates(motion.time_s, motion.index) | {"joint": names, "space": list("xyz")}
    variables = _position_variables(segments, ("time", "joint", "space"), status)
    return xr.Dataset(variables, coordinates, {"history": smoothing.history(boundaries_s)})


def smooth_joint_angles(
    motion: Motion, model: BodyModel, smoothing: Smoothing, boundaries_s: Sequence[float]
) -> xr.Dataset:
    """Smooth a body's joint rotations: (time, joint, axis).

    `angle` [deg] follows from them, continuous over time; `velocity` [deg/s] is the angular one in the parent's axes.
    Raises ResultError for another body's motion.
    """
    require_body(motion, model)
    n, n_joints = len(motion), len(motion.joints)
    angle, velocity = np.full((2, n, n_joints, 3), np.nan)
    sd, velocity_sd = np.full((2, n, n_joints), np.nan)
    is_filled = np.zeros((n, n_joints), bool)
    for k in range(n_joints):
        block = slice(6 + 3 * k, 9 + 3 * k)
        rotation = smooth_rotations(
            smoothing.smoother(has_joints=True),
            motion.time_s,
            matrix_from_angles(motion.joint_angles[:, k]),
            _mean_variance(motion.covariance[:, block, block]),
            boundaries_s=boundaries_s,
            fill_s=smoothing.fill_s,
        )
        angle[:, k], velocity[:, k] = _continuous(angles_from_matrix(rotation.R)), rotation.velocity
        sd[:, k], velocity_sd[:, k], is_filled[:, k] = rotation.sd, rotation.velocity_sd, rotation.is_filled
    axes = ("time", "joint", "axis")
    variables = {
        "angle": (axes, np.rad2deg(angle), {"units": "deg", "order": "x, y, z, body-fixed"}),
        "velocity": (axes, np.rad2deg(velocity), {"units": "deg/s", "frame": "parent segment"}),
        "rotation_sd": (axes[:2], np.rad2deg(sd), {"units": "deg"}),
        "velocity_sd": (axes[:2], np.rad2deg(velocity_sd), {"units": "deg/s"}),
        "is_singular": (axes[:2], is_near_singular(angles_from_matrix(matrix_from_angles(angle)))),
        "is_filled": (axes[:2], is_filled),
    }
    coordinates = _coordinates(motion.time_s, motion.index) | {"joint": list(motion.joints), "axis": list("xyz")}
    return xr.Dataset(variables, coordinates, {"history": smoothing.history(boundaries_s)})


def smooth_players(
    motion: PlayersMotion,
    smoothing: Smoothing,
    boundaries_s: Mapping[str, Sequence[float]],
    progress: Progress | None = None,
) -> xr.Dataset:
    """Smooth the joints of several players, each with its covariances and its player's segments.

    Returns (time, player, joint, space), and the tracked joints' statuses, as `smooth_landmarks` does.
    """
    n, n_players, n_joints = motion.points.shape[:3]
    own = [boundaries_s[name] for name in motion.players for _ in motion.joints]
    points, covariance = motion.points.reshape(n, -1, 3), motion.covariance.reshape(n, -1, 3, 3)
    segments = _smooth_points(
        motion.time_s, points, covariance, smoothing, boundaries_s=own, has_joints=True, progress=progress
    )
    shape = (n, n_players, n_joints)
    segments = SmoothedSegments(
        SmoothedPaths(*(getattr(segments.paths, field.name).reshape(*shape, 3) for field in fields(SmoothedPaths))),
        segments.segment.reshape(shape),
        segments.is_filled.reshape(shape),
    )
    coordinates = _coordinates(motion.time_s, motion.index) | {
        "player": list(motion.players),
        "joint": list(motion.joints),
        "space": list("xyz"),
    }
    variables = _position_variables(segments, ("time", "player", "joint", "space"), motion.joint_status)
    return xr.Dataset(variables, coordinates, {"history": smoothing.history(boundaries_s)})


def _smooth_points(
    time_s: Array,
    points: Array,
    covariance: Array,
    smoothing: Smoothing,
    *,
    boundaries_s: Sequence[Sequence[float]],
    has_joints: bool,
    progress: Progress | None,
) -> SmoothedSegments:
    """Smooth points (n, p, 3) one after another; the result has the same axes."""
    _require_covariances(smoothing, points, covariance)
    smooth, parts = smoothing.smoother(has_joints=has_joints), []
    for k, own in enumerate(boundaries_s):
        parts.append(
            smooth_stretches(smooth, time_s, points[:, k], covariance[:, k], boundaries_s=own, fill_s=smoothing.fill_s)
        )
        if progress is not None:
            progress(k + 1, len(boundaries_s))
    stacked = (np.stack([getattr(one.paths, field.name) for one in parts], axis=1) for field in fields(SmoothedPaths))
    return SmoothedSegments(
        SmoothedPaths(*stacked),
        np.stack([one.segment for one in parts], 1),
        np.stack([one.is_filled for one in parts], 1),
    )


def _require_covariances(smoothing: Smoothing, values: Array, covariance: Array) -> None:
    """Raise ResultError where the method needs covariances and there are values to smooth without any."""
    if smoothing.way.needs_covariances and np.isfinite(values).any() and not np.isfinite(covariance).any():
        raise ResultError(f"the run states no covariances, which {smoothing.method} needs; smooth in another way")


def _position_variables(segments: SmoothedSegments, axes: tuple[str, ...], status: NDArray[np.str_]) -> dict:
    """Name what was smoothed, axes (..., "space"), beside the status (...) of what was tracked."""
    units = {"value": ("position", "m"), "velocity": ("velocity", "m/s"), "acceleration": ("acceleration", "m/s2")}
    variables: dict = {}
    for field, (name, unit) in units.items():
        variables[name] = (axes, getattr(segments.paths, field), {"units": unit, "frame": "world"})
        variables[f"{name}_sd"] = (axes, getattr(segments.paths, f"{field}_sd"), {"units": unit, "frame": "world"})
    flags = {"segment": segments.segment, "is_filled": segments.is_filled}
    flags["joint_status" if "joint" in axes else "status"] = status
    return variables | {name: (axes[:-1], values) for name, values in flags.items()}


def _rotation_variables(rotations: SmoothedRotations, axes: tuple[str, str]) -> dict:
    return {
        "rotation_sd": ("time", rotations.sd, {"units": "rad"}),
        "angular_velocity": (axes, rotations.velocity, {"units": "rad/s", "frame": "world"}),
        "angular_velocity_sd": ("time", rotations.velocity_sd, {"units": "rad/s"}),
        "angular_acceleration": (axes, rotations.acceleration, {"units": "rad/s2", "frame": "world"}),
        "angular_acceleration_sd": ("time", rotations.acceleration_sd, {"units": "rad/s2"}),
    }


def _coordinates(time_s: Array, index: NDArray[np.int64]) -> dict:
    return {"time": ("time", time_s, {"units": "s"}), "frame": ("time", index)}


def _mean_variance(covariance: Array) -> Array:  # (n, 3, 3) -> (n,), over the axes
    return np.diagonal(covariance, axis1=1, axis2=2).mean(axis=1)


def _continuous(radians: Array) -> Array:
    """Return joint angles (n, 3), each row on the branch nearest to the last known one before it."""
    angles = np.array(radians)
    for before, row in pairwise(np.flatnonzero(np.isfinite(angles).all(axis=1))):
        angles[row] = nearest_angles(angles[row], angles[before])
    return angles
