"""The first pose of a trial: what its [start] says, read, and fitted by `tracking.first_pose`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from airborne.body import BodyModel, PosedBody, surface_arrays
from airborne.cameras import Camera, Rig
from airborne.errors import TrialError
from airborne.rendering import FLAT, render
from airborne.run.detections import TrialDetections
from airborne.run.keys import read_key
from airborne.run.landmarks import read_joint_positions, read_pixels
from airborne.tracking.first_pose import FirstPose, fit_to_detections, fit_to_pixels, fit_to_points, pose_by_hand
from airborne.tracking.first_pose.evidence_fit import join_evidence
from airborne.tracking.model_based.degrees_of_freedom import FIRST_POSE_SD
from airborne.trial.file import Trial
from airborne.trial.keys import KeyTable

OUT_OF_SIGHT = "the start pose lies in no camera's image; check [start], in metres, and the calibration"

_AVERAGE_JOINTS = (
    "no joint of this person was given, so joints lie where an average person of this stature has them: by how much "
    "this one differs, up to 8 cm at shoulders, hands and head, 5 cm at hips, knees and feet, is not in sd_m; give "
    "start.joints_m, clicks or detections, or let `airborne fit-body` measure the body"
)


def find_first_pose(trial: Trial, model: BodyModel, rig: Rig, detections: TrialDetections | None) -> FirstPose:
    """Find the first pose of a trial; `rig` holds the cameras of its videos, resected where the trial asks for it.

    Raises TrialError where the points do not determine a pose of this body, CalibrationError for unusable tables.
    """
    start = trial.start
    if start.find:
        raise TrialError(f"{trial.name}: [start] is missing; `airborne find` looks for the body and prints one")
    if detections is not None:
        where = f"{start.detections}, frame {start.frame}"
        return fit_to_detections(model, rig, where, detections.at_image(start.frame))
    if start.points_px is not None:
        names, px = read_pixels(trial, start.points_px, rig.names)
        where = start.points_px if isinstance(start.points_px, str) else "start.points_px"
        first = fit_to_pixels(model, rig, where, names=names, px=px, weights=np.ones(px.shape[:-1]))
        lone = [name for name, n in zip(names, np.isfinite(px).all(axis=-1).sum(axis=-1), strict=True) if n == 1]
        return _add_lone_clicks(trial, model, rig, first, names=lone) if lone else first
    if start.joints_m is None:
        first = pose_by_hand(model, start.world_from_root, start.joint_angles_deg)
        is_average = model.has_joints and trial.body.file is None
        return replace(first, notes=(*first.notes, _AVERAGE_JOINTS)) if is_average else first
    where = start.joints_m if isinstance(start.joints_m, str) else "start.joints_m"
    return fit_to_points(model, where, *read_joint_positions(trial, start.joints_m))


def _add_lone_clicks(trial: Trial, model: BodyModel, rig: Rig, first: FirstPose, *, names: Sequence[str]) -> FirstPose:
    """Add what points that are clicked in one camera alone say to a pose that the others gave."""
    clicks = KeyTable(frame=trial.start.frame, points_px=trial.start.points_px)
    evidence = read_key(trial, clicks, model, rig=rig, facts=())
    sds = np.repeat(FIRST_POSE_SD, [3, 3, 3 * model.n_joints])
    note = f"start.points_px: {', '.join(names)} clicked in one camera: placed across its line of sight alone"
    return replace(first, pose=join_evidence(first.pose, sds, evidence), notes=(*first.notes, note))


def out_of_sight(posed: PosedBody, cameras: Iterable[Camera]) -> str:
    """Say in which cameras' images no part of a body lies: `OUT_OF_SIGHT` for all; empty where each shows some.

    Lens distortion is left out.
    """
    surface = surface_arrays(posed.model)
    seen = {each.name: render(surface, posed, each.without_distortion(), FLAT).mask.any() for each in cameras}
    if not any(seen.values()):
        return OUT_OF_SIGHT
    names = [name for name, is_seen in seen.items() if not is_seen]
    where = f"the start pose lies outside the image of {', '.join(names)}"
    return f"{where}; where it should show, check the calibration" if names else ""
