"""The trial's first pose as the studio finds, shows and writes it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Pose
from airborne.body.chain import angles_of
from airborne.cameras import Rig
from airborne.errors import AirborneError, TrialError
from airborne.motion.run_folder import CANDIDATES, CANDIDATES_PICTURE
from airborne.run.players_tracker import player_starts
from airborne.studio.clicks import Clicked, read_clicked
from airborne.studio.folder import files_inside
from airborne.studio.session import Session
from airborne.studio.stage import middle_of_view
from airborne.studio.writing import FOLDER, read_if_there
from airborne.tracking.first_pose import fit_to_pixels, pose_by_hand
from airborne.tracking.players import PlayerStart
from airborne.trial.start import StartTable

FOUND = f"{FOLDER}/find"  # where the search leaves what it could not decide between
FOUND_LIST, FOUND_PICTURE = (f"{FOUND}/{name}" for name in (CANDIDATES, CANDIDATES_PICTURE))
POSE_COLOUR = "#f0e442"
_BY_HAND = ("position_m", "rotation_matrix", "quaternion_xyzw", "somersault_tilt_twist_deg", "joint_angles_deg")
_WAYS = (
    *_BY_HAND,
    "player",
    "find",
    "joints_m",
    "points_px",
    "detections",
    "detections_cameras",
)  # a start has one of them
_ON_A_LINE_M = 0.01  # points nearer to a line than a click is off determine no turn about it
_DRAFT = "start"  # its name among the drafts


def points_name(frame: int) -> str:
    """Return the name of the table of the landmarks clicked in a frame."""
    return f"start_points_{frame}.csv"


def read_points(session: Session, frame: int) -> Clicked:
    """Read the landmarks clicked in a frame; none where there is no table. Raises CalibrationError."""
    path = session.file(points_name(frame))
    return read_clicked(path) if path.is_file() else Clicked((), None, {})


def player_file(player: str, frame: int) -> str:
    """Return the name of the table of a player's points clicked in a frame."""
    return f"start_{player}_{frame}.csv"


def read_clicked_players(folder: Path, frame: int) -> dict[str, Clicked]:
    """Read the points of all players that are clicked in a frame. Raises CalibrationError."""
    named = re.compile(player_file("(.+)", frame))
    found = [(named.fullmatch(path.name), path) for path in files_inside(folder, ".csv")]
    return {match[1]: read_clicked(path) for match, path in found if match is not None and match[1] != "points"}


def read_start_players(session: Session, rig: Rig) -> tuple[int, dict[str, PlayerStart]]:
    """Return the frame and the players of the start that the trial has; nobody where it has none."""
    try:
        trial = session.project().trial()
        return trial.start.frame, {start.name: start for start in player_starts(trial, rig)}
    except AirborneError:
        return 0, {}


def read_pose(session: Session, model: BodyModel) -> tuple[int, Pose] | None:
    """Return the frame and pose that the trial has by hand; None where it has another start, or none."""
    try:
        start = session.project().trial().start
        return start.frame, pose_by_hand(model, start.world_from_root, start.joint_angles_deg).pose
    except TrialError:
        return None


def pose_of(model: BodyModel, start: dict[str, Any]) -> Pose:
    """Return the pose of a [start] with position, quaternion, and angles of joints if it has them."""
    rotation = Rotation.from_quat(start["quaternion_xyzw"])
    root = RigidTransform.from_components(start["position_m"], rotation)
    return pose_by_hand(model, root, start.get("joint_angles_deg", {})).pose


def start_from_pose(model: BodyModel, frame: int, pose: Pose) -> dict[str, Any]:
    """Return the [start] of a pose: position, quaternion, and the angles of joints that are not straight."""
    root = pose.world_from_root
    quaternion = root.rotation.as_quat().round(6).tolist()
    start = {"frame": frame, "position_m": root.translation.round(4).tolist(), "quaternion_xyzw": quaternion}
    angles = np.degrees(angles_of(pose, model.n_joints)).round(1).tolist()
    bent = {segment.name: xyz for segment, xyz in zip(model.segments[1:], angles, strict=True) if any(xyz)}
    return {**start, "joint_angles_deg": bent} if bent else start


def standing_pose(model: BodyModel, rig: Rig) -> Pose:
    """Return the pose to begin with by hand: upright, joints straight, where the cameras look."""
    root = RigidTransform.from_components(middle_of_view(rig), Rotation.identity())
    return Pose(world_from_root=root, joint_angles=np.zeros((model.n_joints, 3)))


def write_start(session: Session, start: dict[str, Any]) -> None:
    """Write a [start] into the trial, in the place of any other. Raises TrialError."""
    session.set_table("start", {**dict.fromkeys(_WAYS), **start}, "first pose set")


def keep_start(session: Session, start: dict[str, Any], what: str) -> None:
    """Keep a [start] that is made on the page until it is used."""
    draft = {"start": start, "over": session.project().table("start"), "clicks": _clicks_text(session, start)}
    session.keep_draft(_DRAFT, draft, what)


def has_start(session: Session, start: dict[str, Any]) -> bool:
    """Whether the trial has this [start]."""
    table = session.project().table("start")
    return all(table.get(key) == value for key, value in start.items())


def read_draft_start(session: Session) -> dict[str, Any] | None:
    """Return the [start] that was made on a page last; None where there is none, or the trial got another since."""
    draft = session.draft(_DRAFT)
    try:
        start, over = draft["start"], draft["over"]
        StartTable(**start)
    except (KeyError, TypeError, ValueError):
        return None
    return start if over == session.project().table("start") or has_start(session, start) else None


def is_newer_than_clicks(session: Session, start: dict[str, Any]) -> bool:
    """Whether the landmarks of its frame are clicked as they were when the drafted [start] was made."""
    return session.draft(_DRAFT).get("clicks") == _clicks_text(session, start)


def read_draft_pose(model: BodyModel, start: dict[str, Any] | None) -> Pose | None:
    """Return the pose of a drafted [start]; None where it is none of this body."""
    if start is None or "position_m" not in start:
        return None
    try:
        return pose_of(model, start)
    except (AirborneError, KeyError, ValueError):
        return None


def _clicks_text(session: Session, start: dict[str, Any]) -> str | None:
    return read_if_there(session.file(points_name(start["frame"])))


def can_be_clicked(model: BodyModel) -> bool:
    """Say whether clicks of a body's landmarks determine its pose: a thing's must have three that are not on a line."""
    points = np.array([mark.position_m for mark in model.landmarks])
    return model.has_joints or int(np.linalg.matrix_rank(points - points.mean(axis=0), tol=_ON_A_LINE_M)) > 1


def fit_clicks(model: BodyModel, rig: Rig, clicked: Clicked) -> tuple[Pose | None, str]:
    """Fit a body to clicked landmarks: its pose, None where they do not determine it, and what there is to say."""
    px = np.stack([np.stack([clicked.at(name, camera) for camera in rig.names]) for name in clicked.names])
    try:
        first = fit_to_pixels(model, rig, "clicks", names=clicked.names, px=px, weights=np.ones(px.shape[:-1]))
    except AirborneError as error:
        return None, str(error)
    return first.pose, " ".join(note.removeprefix("clicks: ") for note in first.notes)
