"""Nuisance parameters of a run: what may be wrong with the body, the world and the cameras, and how each would show.

Each of them moves the body in every view by a twist (6,): a translation of the root [m] and a rotation about it [rad],
in world axes. A body that is larger looks like the same body nearer to each camera, and so on.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np

from airborne.cameras import Camera, Rig
from airborne.tracking.covariance import SHIFT_SD_PX
from airborne.tracking.self_check.registration import N_SIMILARITY
from airborne.types import Array

Kind = Literal["scale", "turn_deg", "shift_m", "focal", "time_s", "drift_s"]

_KINDS_OF_CAMERA: tuple[tuple[Kind, int], ...] = (("turn_deg", 3), ("shift_m", 3), ("focal", 1), ("time_s", 1))
# sds of what is usual: of a body measured or fitted, of one by its stature alone, of a world, of other cameras
MEASURED_SD, PRESET_SD = 0.01, 0.03  # shares of the size
# the same of a thing that one camera sees, whose distance is as wrong as its file's size; chosen, and looked at on
# three synthetic throws (`airborne synth cross`, seeds 3, 5, 7) with files up to 10 % off
ONE_CAMERA_SD = 0.05
_WORLD_SD = 0.01  # of a world whose calibration does not say how large it is
_CAMERA_SD: Mapping[Kind, float] = {"turn_deg": np.radians(0.1), "shift_m": 0.01, "focal": 0.005, "time_s": 0.002}
# sds of what is possible where something is wrong [share, rad, m, share, s]
_GROSS_SD: Mapping[Kind, float] = {
    "scale": 0.2,
    "turn_deg": np.radians(5.0),
    "shift_m": 0.5,
    "focal": 0.15,
    "time_s": 0.1,
    "drift_s": 0.1,
}
# sds of what a silhouette is off all run long without any such cause: light, shadow, the body's shape
_BIAS_SD = np.array([0.2, 0.2, np.radians(0.05), 0.003])  # [px, px, rad, log scale]
_PERSON_BIAS_SD = np.array([1.5, 1.5, np.radians(0.3), 0.015])  # the same of a person: ellipsoids are not skin


@dataclass(frozen=True, slots=True)
class Nuisance:
    """One cause, of one number or three, and its place in the vector of all parameters."""

    subject: str  # "body", "world", or a camera's name
    kind: Kind
    first: int
    size: int

    @property
    def columns(self) -> slice:
        """Its place among the parameters."""
        return slice(self.first, self.first + self.size)


def nuisances_of(rig: Rig) -> list[Nuisance]:
    """List the causes that a run may have, of a body and the cameras that see it."""
    listed = [Nuisance("body", "scale", 0, 1), Nuisance("world", "scale", 1, 1)]
    for camera in rig:
        for kind, n in _KINDS_OF_CAMERA:
            listed.append(Nuisance(camera.name, kind, listed[-1].columns.stop, n))
    return listed


def columns_of(rig: Rig) -> dict[tuple[str, Kind], slice]:
    """Return the places of all causes among the parameters, by subject and kind."""
    return {(each.subject, each.kind): each.columns for each in nuisances_of(rig)}


def first_bias(rig: Rig) -> int:
    """Return the first of the parameters that are no causes: what each view's silhouette is off all run long."""
    return nuisances_of(rig)[-1].columns.stop


def n_parameters(rig: Rig) -> int:
    """Count the parameters: the causes' and, after them, what each view's silhouette is off all run long."""
    return first_bias(rig) + N_SIMILARITY * len(rig)


def twists(rig: Rig, camera_index: int, root: Array, velocity: Array) -> Array:
    """Return how the body's image moves in one view by each parameter: twists (6, n_parameters).

    root (3,) [m], velocity (6,) [m/s, rad/s] of the body. Parameters say how the truth differs from the file: a scale,
    focal length or body that is larger, a camera that is turned or stands further along its own axes, a later time.
    """
    camera, at = rig.cameras[camera_index], columns_of(rig)
    P = np.zeros((6, n_parameters(rig)))
    P[:3, at["body", "scale"]] = (camera.centre - root)[:, None]
    P[:3, at["world", "scale"]] = -camera.centre[:, None]
    world_from_camera = camera.camera_from_world.rotation.as_matrix().T
    arm, axis = root - camera.centre, world_from_camera[:, 2]
    P[:3, at[camera.name, "turn_deg"]] = np.cross(world_from_camera.T, arm).T
    P[3:, at[camera.name, "turn_deg"]] = world_from_camera
    P[:3, at[camera.name, "shift_m"]] = -world_from_camera
    P[:3, at[camera.name, "focal"]] = -(axis @ arm) * axis[:, None]
    P[:, at[camera.name, "time_s"]] = velocity[:, None]
    return P


def biases(rig: Rig, camera_index: int) -> Array:
    """Return how the offset found in one view changes by the parameters beside the twists: (4, n_parameters)."""
    D = np.zeros((N_SIMILARITY, n_parameters(rig)))
    first = first_bias(rig) + N_SIMILARITY * camera_index
    D[:, first : first + N_SIMILARITY] = np.eye(N_SIMILARITY)
    return D


def shift_covariance(rig: Rig) -> Array:
    """Return the part of the parameters' covariance that the tracker's own covariances hold: shifted images."""
    variance = np.zeros(n_parameters(rig))
    for i, camera in enumerate(rig):
        first = first_bias(rig) + N_SIMILARITY * i
        variance[first : first + 2] = SHIFT_SD_PX**2 + camera.shift_sd_px**2
    return np.diag(variance)


def prior_covariance(rig: Rig, body_sd: float, *, is_person: bool) -> Array:
    """Return the covariance (n_parameters, n_parameters) of what is usual; it may be singular.

    Of cameras that say how well they are known, that counts. A world whose size is known, of control points, lies where
    they say; any other may be larger about the cameras' middle. Where not all cameras say anything, their common
    motion counts for nothing there: poses are in their world. That goes for the place of its origin, too.
    """
    at, variance = columns_of(rig), np.zeros(n_parameters(rig))
    variance[at["body", "scale"]], variance[at["world", "scale"]] = body_sd**2, (rig.world_sd or _WORLD_SD) ** 2
    for camera, (kind, _) in product(rig, _KINDS_OF_CAMERA):
        variance[at[camera.name, kind]] = np.square(_CAMERA_SD[kind])
    variance[first_bias(rig) :] = np.tile((_PERSON_BIAS_SD if is_person else _BIAS_SD) ** 2, len(rig))
    covariance = np.diag(variance)
    for camera in rig:
        if camera.covariance is not None and (rig.world_sd is not None or rig.states_errors):
            known = slice(at[camera.name, "turn_deg"].start, at[camera.name, "focal"].stop)
            covariance[known, known] = camera.covariance
    times = [at[camera.name, "time_s"].start for camera in rig]
    covariance[np.ix_(times, times)] -= _CAMERA_SD["time_s"] ** 2 / len(rig)  # the clock is theirs together
    if rig.world_sd is not None:
        return covariance
    return _about_middle(covariance if rig.states_errors else _without_common_motion(covariance, rig), rig)


def allow_cause(prior: Array, nuisance: Nuisance) -> Array:
    """Return the prior with one cause possible that is not usual."""
    prior = prior.copy()
    columns = np.arange(len(prior))[nuisance.columns]
    prior[columns, columns] += _GROSS_SD[nuisance.kind] ** 2
    return prior


def _without_common_motion(covariance: Array, rig: Rig) -> Array:
    at, columns = columns_of(rig), np.arange(len(covariance))
    rows = np.concatenate([columns[at[camera.name, kind]] for camera in rig for kind in ("turn_deg", "shift_m")])
    sd = np.sqrt(np.diag(covariance)[rows])
    common = np.concatenate([_common_motion(camera) for camera in rig])  # (6 c, 6)
    unit = np.linalg.qr(common / sd[:, None])[0]
    covariance[np.ix_(rows, rows)] = sd[:, None] * (np.eye(len(rows)) - unit @ unit.T) * sd
    return covariance


def _about_middle(covariance: Array, rig: Rig) -> Array:
    """Return the covariance for a world that is usually larger about the cameras' middle, not about its origin."""
    at, row, middle = columns_of(rig), np.zeros(len(covariance)), np.mean([camera.centre for camera in rig], axis=0)
    row[at["world", "scale"]] = 1.0
    for camera in rig:
        row[at[camera.name, "shift_m"]] = -camera.camera_from_world.rotation.apply(middle)
    world, others = at["world", "scale"], covariance.copy()
    variance = covariance[world, world]
    others[world, world] = 0
    return others + variance * np.outer(row, row)


def _common_motion(camera: Camera) -> Array:
    """Return a camera's turn and shift in its own axes when the world as a whole moves: (6, 6)."""
    R, C = camera.camera_from_world.rotation.as_matrix(), camera.centre
    cross = np.array([[0, -C[2], C[1]], [C[2], 0, -C[0]], [-C[1], C[0], 0]])
    return np.block([[np.zeros((3, 3)), -R], [R, -R @ cross]])
