"""A moving person's 2D detections as a source, and the prior of a rig that they refine.

A network's joints have systematic errors, so all detections of one point by one camera count as one cluster, and the
other cameras have a prior about their calibration: detections alone would deform a good rig. The rig as a whole keeps
the position and the scale of these cameras.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration.bundle import CameraPrior, Source
from airborne.calibration.bundle.lenses import N_PARAMETERS
from airborne.calibration.initial.resection import (
    LEAST_RESECTION_VISIBILITY,
    MISPLACED_PX,
    sample_moments,
)
from airborne.cameras.camera import Rig
from airborne.cameras.consensus import triangulate_consensus
from airborne.cameras.detections import Detections
from airborne.types import Array

_CALIBRATION_SD_PX = MISPLACED_PX / 2  # prior standard deviation of a camera that is not misplaced


def calibration_prior(rig: Rig, trusted: Sequence[str], points: Array) -> CameraPrior:
    """Return the prior of a calibration's trusted cameras: _CALIBRATION_SD_PX at points (n, 3) [m].

    Half of the variance by each camera's position and half by its rotation; no prior on other cameras, nor on lenses.
    """
    sd = np.full((len(rig), N_PARAMETERS), np.inf)
    middle = np.median(points, axis=0)
    for row, camera in zip(sd, rig, strict=True):
        if camera.name in trusted:
            angle_rad = _CALIBRATION_SD_PX / camera.K[0, 0]
            row[:3] = angle_rad / np.sqrt(2)
            row[3:6] = angle_rad / np.sqrt(2) * np.linalg.norm(camera.centre - middle)
    return CameraPrior(sd=sd)


def person_source(rig: Rig, detections: Detections, *, name: str = "detections") -> Source:
    """Return confident detections that the cameras agree on as free points, triangulated with the rig."""
    confident = sample_moments(detections).above_visibility(LEAST_RESECTION_VISIBILITY).select(rig.names)
    consensus = triangulate_consensus(rig, confident.px, confident.visibility)
    n_points, n_cameras = confident.px.shape[1:3]
    points = consensus.points.reshape(-1, 3)
    is_known = np.asarray(np.isfinite(points).all(axis=1))
    px = confident.px.reshape(-1, n_cameras, 2)
    row, camera = np.nonzero(np.isfinite(px).all(axis=-1) & is_known[:, None])
    return Source(
        name=name,
        camera=camera,
        point=(np.cumsum(is_known) - 1)[row],
        px=px[row, camera],
        points=points[is_known],
        is_free=np.ones(is_known.sum(), bool),
        cluster=(row % n_points) * n_cameras + camera,
    )


def align_rigs(
    rig: Rig, target_rig: Rig, names: Sequence[str], *, fits_scale: bool = True
) -> tuple[RigidTransform, float]:
    """Return the rigid transform, and the scale before it, that align the named cameras of a rig with a target rig.

    The rotation is Markley's mean of the cameras', scale and shift follow from their positions; the scale is 1 unless
    `fits_scale`.
    """
    pairs = [(rig[name].camera_from_world, target_rig[name].camera_from_world) for name in names]
    rotation = Rotation.concatenate([b.rotation.inv() * a.rotation for a, b in pairs]).mean()
    centres = np.stack([rig[name].centre for name in names])
    target_centres = np.stack([target_rig[name].centre for name in names])
    offsets = rotation.apply(centres - centres.mean(axis=0))
    target_offsets = target_centres - target_centres.mean(axis=0)
    size = float(np.sum(offsets**2))
    scale = float(np.sum(offsets * target_offsets)) / size if fits_scale and size > 0 else 1.0
    return RigidTransform.from_components(
        target_centres.mean(axis=0) - rotation.apply(centres.mean(axis=0)) * scale, rotation
    ), scale
