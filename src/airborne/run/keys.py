"""The keys of a trial: its [[key]] tables, read, as evidence of the pose at their frames."""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Pose
from airborne.cameras import Rig
from airborne.cameras.detections import landmarks_from_points
from airborne.errors import TrialError
from airborne.run.detections import read_forms_detections
from airborne.run.landmarks import read_joint_positions, read_pixels
from airborne.tracking.evidence import PoseEvidence
from airborne.tracking.first_pose import LANDMARK_WEIGHTS, LEAST_VISIBILITY, check_landmark_names, pose_by_hand
from airborne.trial.file import Trial
from airborne.trial.keys import KeyTable
from airborne.types import Array
from airborne.video import Recording, VideoFacts


def read_keys(trial: Trial, model: BodyModel, rig: Rig, facts: Sequence[VideoFacts]) -> dict[int, PoseEvidence]:
    """Read the keys, by their frames in the order of time.

    Raises TrialError where one names what the body does not have, CalibrationError for unusable tables.
    """
    keys = sorted(trial.key, key=lambda key: key.frame)
    return {key.frame: read_key(trial, key, model, rig=rig, facts=facts) for key in keys}


def keys_of_frames(trial: Trial, model: BodyModel, recording: Recording) -> tuple[dict[int, PoseEvidence], list[str]]:
    """Read the keys; return those of frames that are tracked, and a note on the others."""
    ends = [end for end in (recording.n_images, recording.stop) if end is not None]
    frames = range(recording.start, min(ends, default=sys.maxsize), recording.every)
    keys = read_keys(trial, model, recording.rig, recording.facts)
    missed = ", ".join(str(frame) for frame in keys if frame not in frames)
    every = f", every {frames.step}" if frames.step > 1 else ""
    note = f"[[key]] of frame {missed} is not used: tracked are frames {frames.start} to {frames.stop - 1}{every}"
    return {frame: key for frame, key in keys.items() if frame in frames}, [note] if missed else []


def read_key(trial: Trial, key: KeyTable, model: BodyModel, *, rig: Rig, facts: Sequence[VideoFacts]) -> PoseEvidence:
    """Return what a key says of the pose; the errors are those of `read_keys`."""
    where, names = f"key of frame {key.frame}", [landmark.name for landmark in model.landmarks]
    root_weights = np.sqrt([LANDMARK_WEIGHTS.get(name, 1.0) for name in names])
    positions = np.full((len(names), 3), np.nan)
    if key.joints_m is not None:
        positions = _by_landmark(model, where, *read_joint_positions(trial, key.joints_m))
    px, px_sds = _pixels(trial, key, model, rig=rig, facts=facts, where=where)
    landmark, camera = np.nonzero(np.isfinite(px).all(axis=-1))
    known = np.flatnonzero(np.isfinite(positions).all(axis=-1))
    undistorted = [rig.cameras[c].undistort_px(px[i, c]) for i, c in zip(landmark, camera, strict=True)]
    pose, pose_sds = _pose(key, model)
    if pose is None and not len(known) and not len(landmark):
        raise TrialError(f"{trial.name}: {where}: none of its points is seen; click one, or remove the key")
    return PoseEvidence(
        model=model,
        landmarks=known,
        positions=positions[known],
        position_sds=key.sd_m / root_weights[known],
        clicked=landmark,
        P=rig.P[camera],
        px=np.reshape(undistorted, (-1, 2)),
        px_sds=px_sds[landmark, camera] / root_weights[landmark],
        pose=pose,
        pose_sds=pose_sds,
    )


def _pixels(
    trial: Trial, key: KeyTable, model: BodyModel, *, rig: Rig, facts: Sequence[VideoFacts], where: str
) -> tuple[Array, Array]:
    """Return clicks and detections of every landmark: pixels (landmarks, cameras, 2), NaN where none, and their sds."""
    px = np.full((len(model.landmarks), len(rig), 2), np.nan)
    sds = np.full(px.shape[:-1], key.sd_px)
    detections = read_forms_detections(trial, key, facts)
    if detections is not None:
        row = detections.at_image(key.frame).above_visibility(LEAST_VISIBILITY)
        px = _by_landmark(model, where, row.points, row.px[0])
    if key.points_px is not None:
        names, read = read_pixels(trial, key.points_px, rig.names, fewest=1)
        _check_inside(f"{trial.name}: {where}", names, read, rig)
        clicked = _by_landmark(model, where, names, read)
        px = np.where(np.isfinite(clicked), clicked, px)
    return px, sds


def _check_inside(where: str, names: Sequence[str], px: Array, rig: Rig) -> None:
    """Raise TrialError for a click (points, cameras, 2) [px] outside its camera's image."""
    sizes = np.array([camera.size for camera in rig])
    for point, camera in np.argwhere(((px < -0.5) | (px > sizes - 0.5)).any(axis=-1)):
        (u, v), (width, height) = px[point, camera], sizes[camera]
        raise TrialError(
            f"{where}: {names[point]} is clicked at {u:g}, {v:g} in {rig.names[camera]}, whose images have "
            f"{width}×{height} px; correct it"
        )


def _by_landmark(model: BodyModel, where: str, names: Sequence[str], points: Array) -> Array:
    """Return named points (points, ...) by the body's landmarks (landmarks, ...), NaN where there is none."""
    check_landmark_names(model, where, names)
    flat = landmarks_from_points(names, points.reshape(len(names), -1))
    of_body = np.full((len(model.landmarks), *points.shape[1:]), np.nan)
    for index, landmark in enumerate(model.landmarks):
        if landmark.name in flat:
            of_body[index] = flat[landmark.name].reshape(points.shape[1:])
    return of_body


def _pose(key: KeyTable, model: BodyModel) -> tuple[Pose | None, Array]:
    """Return the pose by hand and its sds (6 + 3 joints,), infinite of what it leaves open."""
    sds, turn = np.full(model.n_dofs, np.inf), np.radians(key.sd_deg)
    if key.position_m is None and key.rotation is None and not key.joint_angles_deg:
        return None, sds
    sds[:3] = np.inf if key.position_m is None else key.sd_m
    sds[3:6] = np.inf if key.rotation is None else turn
    for name in key.joint_angles_deg:
        if name in [segment.name for segment in model.segments[1:]]:
            sds[3 + 3 * model.index_of(name) : 6 + 3 * model.index_of(name)] = turn
    root = RigidTransform.from_components(key.position_m or np.zeros(3), key.rotation or Rotation.identity())
    return pose_by_hand(model, root, key.joint_angles_deg, f"key of frame {key.frame}").pose, sds
