"""A moving person's 2D detections as evidence, and a rig refined by them: which is wrong, and all a little better.

What a network takes for a joint errs steadily, so all detections of one point by one camera count as one cluster, and
cameras that were not found wrong keep what their calibration is worth: detections alone would bend a good rig. The rig
stays as a whole where these cameras were, and keeps their scale.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration.bundle import Adjustment, CameraPrior, FreeParameters, Source, adjust
from airborne.calibration.initial.resection import (
    LEAST_RESECTION_VISIBILITY,
    MISPLACED_PX,
    Resection,
    find_misplaced_cameras,
    resect_cameras,
    sample_moments,
)
from airborne.cameras.camera import Rig
from airborne.cameras.consensus import triangulate_consensus
from airborne.cameras.detections import Detections
from airborne.types import Array

_CALIBRATION_SD_PX = MISPLACED_PX / 2  # how far, one standard deviation, a camera may be off that was not found wrong


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RigRefinement:
    """A rig that agrees better with what it sees."""

    rig: Rig
    resections: tuple[Resection, ...]  # cameras that were clearly elsewhere, placed anew first
    adjustment: Adjustment
    before_px: float  # median distance of all detections from their triangulated points [px]
    after_px: float


def refine_rig(rig: Rig, detections: Detections, free: FreeParameters | None = None) -> RigRefinement:
    """Name and mend the cameras that are clearly wrong, then adjust the places of all; lenses stay unless freed.

    detections: one moment a row. Raises CalibrationError where too little is seen.
    """
    seen = detections.select(rig.names)
    wrong = find_misplaced_cameras(rig, seen)
    start, _ = resect_cameras(rig, seen, [m.camera.name for m in wrong]) if wrong else (rig, ())
    trusted = [name for name in rig.names if name not in {m.camera.name for m in wrong}]
    source = person_source(start, seen)
    prior = calibration_prior(start, trusted, source.points)
    adjusted = adjust(start, [source], free or FreeParameters(focal=False), prior=prior)
    return RigRefinement(
        rig=adjusted.rig,
        resections=wrong,
        adjustment=adjusted,
        before_px=median_reprojection_px(rig, seen),
        after_px=median_reprojection_px(adjusted.rig, seen),
    )


def calibration_prior(rig: Rig, trusted: Sequence[str], points: Array) -> CameraPrior:
    """Return what a calibration is worth that its cameras were not found wrong in: _CALIBRATION_SD_PX at points (n, 3) [m].

    Half of it by each camera's place and half by its direction; nothing is known of cameras that are not trusted, and
    nothing of lenses.
    """
    sd = np.full((len(rig), 15), np.inf)
    middle = np.median(points, axis=0)
    for row, camera in zip(sd, rig, strict=True):
        if camera.name in trusted:
            angle_rad = _CALIBRATION_SD_PX / camera.K[0, 0]
            row[:3] = angle_rad / np.sqrt(2)
            row[3:6] = angle_rad / np.sqrt(2) * np.linalg.norm(camera.centre - middle)
    return CameraPrior(sd=sd)


def person_source(rig: Rig, detections: Detections, *, name: str = "detections") -> Source:
    """Return sure detections that the cameras agree on as free points; starts are triangulated with the rig."""
    sure = sample_moments(detections).above_visibility(LEAST_RESECTION_VISIBILITY).select(rig.names)
    agreed = triangulate_consensus(rig, sure.px, sure.visibility)
    n_points, n_cameras = sure.px.shape[1:3]
    points = agreed.points.reshape(-1, 3)
    is_known = np.asarray(np.isfinite(points).all(axis=1))
    px = sure.px.reshape(-1, n_cameras, 2)
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


def median_reprojection_px(rig: Rig, detections: Detections) -> float:
    """Return the median distance of all detections from their triangulated points' projections [px]."""
    points = rig.points_from_px(detections.px, detections.visibility)
    projected = np.stack([camera.px_from_world(points) for camera in rig], axis=-2)
    return float(np.nanmedian(np.linalg.norm(projected - detections.px, axis=-1)))


def align_rigs(rig: Rig, wanted: Rig, names: Sequence[str], *, fits_scale: bool = True) -> tuple[RigidTransform, float]:
    """Return the move, and the scale before it, that bring the named cameras nearest to where `wanted` has them.

    Directions settle the turn (Markley's mean), places the scale and the shift; the scale is 1 unless `scaled`.
    """
    pairs = [(rig[name].camera_from_world, wanted[name].camera_from_world) for name in names]
    turn = Rotation.concatenate([b.rotation.inv() * a.rotation for a, b in pairs]).mean()
    here = np.stack([rig[name].centre for name in names])
    there = np.stack([wanted[name].centre for name in names])
    spread, target = turn.apply(here - here.mean(axis=0)), there - there.mean(axis=0)
    size = float(np.sum(spread**2))
    scale = float(np.sum(spread * target)) / size if fits_scale and size > 0 else 1.0
    return RigidTransform.from_components(there.mean(axis=0) - turn.apply(here.mean(axis=0)) * scale, turn), scale
