"""The trial's first pose as the studio finds, shows and writes it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Pose
from airborne.cameras import Rig
from airborne.errors import AirborneError, TrialError
from airborne.studio.clicks import Clicked, read_clicked
from airborne.studio.outlines import outline_items
from airborne.studio.session import Session
from airborne.tracking.first_pose import fit_to_pixels

POSE_COLOUR = "#f0e442"
_BY_HAND = ("position_m", "rotation_matrix", "quaternion_xyzw", "somersault_tilt_twist_deg", "joint_angles_deg")
_WAYS = (*_BY_HAND, "find", "joints_m", "points_px", "detections", "detections_cameras")  # a start has one of them


def points_name(frame: int) -> str:
    """Return the name of the table of the landmarks clicked in a frame."""
    return f"start_points_{frame}.csv"


def read_points(session: Session, frame: int) -> Clicked:
    """Read the landmarks clicked in a frame; none where there is no table. Raises CalibrationError."""
    path = session.folder / points_name(frame)
    return read_clicked(path) if path.is_file() else Clicked((), None, {})


def stored_pose(session: Session) -> tuple[int, Pose] | None:
    """Return the frame and pose that the trial has by hand; None where it has another start, or none."""
    try:
        start = session.project().trial().start
        return start.frame, start.pose
    except TrialError:
        return None


def pose_of(start: dict[str, Any]) -> Pose:
    """Return the pose of a [start] with position and quaternion."""
    rotation = Rotation.from_quat(start["quaternion_xyzw"])
    return Pose(world_from_root=RigidTransform.from_components(start["position_m"], rotation))


def write_start(session: Session, start: dict[str, Any]) -> None:
    """Write a [start] into the trial, in the place of any other. Raises TrialError."""
    session.set_table("start", {**dict.fromkeys(_WAYS), **start}, "first pose set")


def pose_outline(model: BodyModel, rig: Rig, cameras: Sequence[str], pose: Pose) -> list[dict[str, Any]]:
    """Return the outline of a pose in the cameras' pictures."""
    return outline_items(model.with_pose(pose), rig.select(cameras).cameras, POSE_COLOUR)


def fit_clicks(
    model: BodyModel, rig: Rig, cameras: Sequence[str], clicked: Clicked
) -> tuple[list[dict[str, Any]] | None, str]:
    """Fit a body to clicked landmarks: its outline, None where they do not determine it, and what there is to say."""
    px = np.stack([np.stack([clicked.at(name, camera) for camera in rig.names]) for name in clicked.names])
    try:
        first = fit_to_pixels(model, rig, "clicks", names=clicked.names, px=px, weights=np.ones(px.shape[:-1]))
    except AirborneError as error:
        return None, str(error)
    return pose_outline(model, rig, cameras, first.pose), " ".join(first.notes)
