"""The first pose: set by hand, or from positions, clicked points or 2D detections; cameras that moved, resected."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Pose
from airborne.body.inverse_kinematics import fit_pose
from airborne.calibration.initial.resection import find_misplaced_cameras, resect_cameras
from airborne.cameras import Rig
from airborne.cameras.clicks import read_clicks, read_positions
from airborne.cameras.consensus import triangulate_consensus
from airborne.cameras.detections import LANDMARK_RECIPES, NETWORKS, Detections, landmarks_from_points, read_detections
from airborne.errors import BodyError, TrialError
from airborne.trial.file import Trial
from airborne.types import Array
from airborne.video import VideoSource, inspect

_LEAST_VISIBILITY = 0.3  # detections with a lower confidence are ignored
LANDMARK_WEIGHTS = {  # of points that only lie near the landmark they stand for
    "head": 0.1,
    **dict.fromkeys(("hand_left", "hand_right", "foot_left", "foot_right"), 0.3),
}


@dataclass(frozen=True, slots=True, eq=False)
class FirstPose:
    """The body's pose at the first frame."""

    pose: Pose
    notes: tuple[str, ...] = ()  # what the user should know, one line each


def find_first_pose(trial: Trial, model: BodyModel, rig: Rig) -> FirstPose:
    """Find the first pose of a trial; `rig` holds the cameras of its videos, resected where the trial asks for it.

    Raises TrialError where the points do not determine a pose of this body, CalibrationError for unusable tables.
    """
    start = trial.start
    if start.position_m is not None:
        return _by_hand(trial, model)
    if isinstance(start.joints_m, dict):
        points = {name: np.array(point) for name, point in start.joints_m.items()}
        return _fit_to_points(model, "start.joints_m", list(points), np.stack(list(points.values())))
    if start.joints_m is not None:
        points = read_positions(trial.path(start.joints_m))
        return _fit_to_points(model, start.joints_m, list(points), np.stack(list(points.values())))
    if start.points_px is not None:
        names, px = read_clicks(trial.path(start.points_px), rig.names)
        return _fit_to_pixels(model, rig, start.points_px, names=names, px=px, weights=np.ones(px.shape[:-1]))
    detections = _detections(trial, rig).at(_frames_at(trial, np.array([start.frame]), fields=True))
    confident = detections.above_visibility(_LEAST_VISIBILITY)
    where = f"{start.detections}, frame {start.frame}"
    first = _fit_to_pixels(
        model,
        rig,
        where,
        names=confident.points,
        px=confident.px[0],
        weights=confident.visibility[0],
    )
    return FirstPose(first.pose, (*detections.notes, *first.notes))


def resect_moved_cameras(trial: Trial, rig: Rig) -> tuple[Rig, tuple[str, ...]]:
    """Resect the cameras that the trial lists under `mend`; the notes say what changed, and which others disagree.

    Without detections the rig stays as it is. Raises CalibrationError where a camera cannot be resected.
    """
    if trial.start.detections is None:
        return rig, ()
    detections = _synchronous_detections(trial, rig)
    notes = []
    if trial.calibration.mend:
        rig, done = resect_cameras(rig, detections, trial.calibration.mend)
        notes += [mending.describe() for mending in done]
    notes += [
        f"{each.camera.name} disagrees with the other cameras: half of its detections lie over "
        f"{each.before_px:.0f} px from where the others see the points; if it moved after the calibration, give "
        f'mend = ["{each.camera.name}"] under [calibration]'
        for each in find_misplaced_cameras(rig, detections)
    ]
    return rig, tuple(notes)


def landmarks_over_time(trial: Trial, rig: Rig) -> dict[str, Array]:
    """Triangulate a trial's detections at every frame of the first camera: point or landmark -> (frames, 3) [m].

    NaN where fewer than two cameras agree. Raises CalibrationError.
    """
    confident = _synchronous_detections(trial, rig).above_visibility(_LEAST_VISIBILITY)
    return landmarks_from_points(
        confident.points, triangulate_consensus(rig, confident.px, confident.visibility).points
    )


def _by_hand(trial: Trial, model: BodyModel) -> FirstPose:
    joints = [segment.name for segment in model.segments[1:]]
    angles = np.zeros((len(joints), 3))
    for name, xyz in trial.start.joint_angles_deg.items():
        if name not in joints:
            raise TrialError(
                f"start.joint_angles_deg: body '{model.name}' has no joint '{name}'; "
                f"it has: {', '.join(joints) or 'none'}"
            )
        angles[joints.index(name)] = np.radians(xyz)
    is_out = np.any((angles < model.limits_rad[..., 0]) | (angles > model.limits_rad[..., 1]), axis=1)
    beyond = [name for name, out in zip(joints, is_out, strict=True) if out and name in trial.start.joint_angles_deg]
    notes = (f"start.joint_angles_deg: {', '.join(beyond)} beyond the body's joint limits",) if beyond else ()
    return FirstPose(Pose(world_from_root=trial.start.world_from_root, joint_angles=angles), notes)


def _fit_to_pixels(
    model: BodyModel, rig: Rig, where: str, *, names: Sequence[str], px: Array, weights: Array
) -> FirstPose:
    """Fit to image points: px (points, cameras, 2) [px], NaN where missing; weights (points, cameras)."""
    needed = _required_points(model, where, names)
    names = [names[i] for i in needed]
    agreed = triangulate_consensus(rig, px[needed], weights[needed])
    is_left_out = np.isfinite(agreed.distance_px) & ~agreed.is_used & (weights[needed] > 0)
    left_out = [
        f"{where}: {camera} left out at {', '.join(name for name, is_out in zip(names, out, strict=True) if is_out)}, "
        f"up to {distance_px[out].max():.0f} px from where the other cameras see them"
        for camera, out, distance_px in zip(rig.names, is_left_out.T, agreed.distance_px.T, strict=True)
        if out.any()
    ]
    first = _fit_to_points(model, where, names, agreed.points)
    return FirstPose(first.pose, (*left_out, *first.notes))


def _required_points(model: BodyModel, where: str, names: Sequence[str]) -> list[int]:
    """Return which points determine landmarks of the body; raises TrialError for an unknown name."""
    landmarks = [landmark.name for landmark in model.landmarks]
    of_networks = {*chain.from_iterable(NETWORKS.values())}
    unknown = [name for name in names if name not in landmarks and name not in of_networks]
    if unknown:
        raise TrialError(
            f"{where}: body '{model.name}' has no landmark {', '.join(unknown)}; it has: {', '.join(landmarks)}"
        )
    recipes = chain.from_iterable(LANDMARK_RECIPES[landmark] for landmark in landmarks if landmark in LANDMARK_RECIPES)
    parts = {*landmarks, *chain.from_iterable(recipes)}
    return [i for i, name in enumerate(names) if name in parts]


def _fit_to_points(model: BodyModel, where: str, names: Sequence[str], points: Array) -> FirstPose:
    """Fit to points (points, 3) [m] of these names."""
    needed = _required_points(model, where, names)
    landmarks = landmarks_from_points([names[i] for i in needed], points[needed])
    targets = {landmark.name: landmarks[landmark.name] for landmark in model.landmarks if landmark.name in landmarks}
    try:
        fit = fit_pose(model, targets, weights=LANDMARK_WEIGHTS)
    except BodyError as error:
        raise TrialError(f"{where}: {error}") from error
    off_m = {name: distance for name, distance in fit.residual_m.items() if np.isfinite(distance)}
    worst = max(off_m, key=off_m.__getitem__)
    missing = ", ".join(name for name, point in targets.items() if np.isnan(point).any())
    notes = [
        f"{where}: first pose found, landmarks {fit.rms_m * 1e3:.0f} mm off (RMS), "
        f"most {worst}, {off_m[worst] * 1e3:.0f} mm",
        f"{where}: no place of {missing}; there the first pose is as near to straight as it can be" if missing else "",
        f"{where}: {fit.note}" if fit.note else "",
    ]
    return FirstPose(fit.pose, tuple(note for note in notes if note))


def _detections(trial: Trial, rig: Rig) -> Detections:
    start = trial.start
    return read_detections(trial.path(start.detections or ""), rig.names, start.detections_cameras)


def _synchronous_detections(trial: Trial, rig: Rig) -> Detections:
    """Return the detections at common times, one row for each frame of the first camera."""
    detections = _detections(trial, rig)
    return detections.at(_frames_at(trial, np.arange(len(detections.px)), fields=False))


def _frames_at(trial: Trial, index: NDArray[np.integer], *, fields: bool) -> NDArray[np.int64]:
    """Return every camera's frame nearest in time (n, cameras) to the first camera's frames, or images, (n,)."""
    facts = [inspect(VideoSource(c.name, trial.path(c.video), c.fields)) for c in trial.camera]
    rate = facts[0].image_rate if fields else facts[0].frame_rate
    first = trial.camera[0]
    time_s = first.offset_s + index / float(rate) * (1 + first.drift_ppm / 1e6)
    columns = [
        (time_s - camera.offset_s) / (1 + camera.drift_ppm / 1e6) * float(fact.frame_rate)
        for camera, fact in zip(trial.camera, facts, strict=True)
    ]
    return np.floor(np.stack(columns, axis=1) + 0.5 - 1e-6).astype(np.int64)  # a field at a half belongs to its frame
