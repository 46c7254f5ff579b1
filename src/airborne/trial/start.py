"""[start]: where the body or the players are at the first frame."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field, model_validator
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose
from airborne.errors import TrialError
from airborne.geometry.rotations import matrix_from_angles
from airborne.io.names import CheckedPath
from airborne.trial.players import PlayerTable
from airborne.trial.table import SettingsTable, Vector


class StartTable(SettingsTable):
    """The first pose: set by hand, or found from positions of the body's landmarks; or those of several players."""

    find: bool = False  # the body is looked for, from `frame` on
    frame: Annotated[int, Field(ge=0)] = 0
    position_m: Vector | None = None
    rotation_matrix: Annotated[list[Vector], Field(min_length=3, max_length=3)] | None = None
    quaternion_xyzw: Annotated[list[float], Field(min_length=4, max_length=4)] | None = None
    somersault_tilt_twist_deg: Vector | None = None
    joint_angles_deg: dict[str, Vector] = {}  # segment -> x, y, z
    joints_m: dict[str, Vector] | CheckedPath | None = None  # landmark -> position, or a table of them
    points_px: CheckedPath | None = None  # a table of clicked points
    detections: CheckedPath | None = None  # .npz, or a folder of folders of OpenPose JSON
    detections_cameras: dict[str, str] = {}  # camera -> its array or folder
    skeleton: str | None = None  # whose points the detections are; None: as their files say
    player: list[PlayerTable] = []

    @model_validator(mode="after")
    def _check_start(self) -> StartTable:
        by_hand = {"position_m", "rotation_matrix", "quaternion_xyzw", "somersault_tilt_twist_deg", "joint_angles_deg"}
        ways = [self.joints_m, self.points_px, self.detections]
        given = (
            sum(value is not None for value in ways)
            + bool(by_hand & self.model_fields_set)
            + bool(self.player)
            + self.find
        )
        if given != 1:
            raise ValueError(
                "give a position_m and a rotation, or joints_m, points_px, detections or find = true, one of them; "
                "of several players [[start.player]] tables"
            )
        names = [player.name for player in self.player]
        if len(set(names)) != len(names):
            raise ValueError(f"two players share a name: {', '.join(names)}; give each its own")
        if names and not any(player.has_legs for player in self.player):
            raise ValueError("every player is a bystander; give one of them the points of the legs too")
        if self.detections_cameras and self.detections is None:
            raise ValueError("detections_cameras goes with detections")
        if self.skeleton is not None and self.detections is None:
            raise ValueError("skeleton goes with detections")
        if by_hand & self.model_fields_set:
            self._check_rotation()
        return self

    def _check_rotation(self) -> None:
        if self.position_m is None:
            raise ValueError("position_m is missing: give where the root's origin is")
        given = [self.rotation_matrix, self.quaternion_xyzw, self.somersault_tilt_twist_deg]
        if sum(value is not None for value in given) != 1:
            raise ValueError("give rotation_matrix, quaternion_xyzw or somersault_tilt_twist_deg, one of them")
        if self.quaternion_xyzw is not None and not any(self.quaternion_xyzw):
            raise ValueError("quaternion_xyzw is all zeros; give x, y, z, w of a rotation, of any length above zero")
        if self.rotation_matrix is not None:
            R = np.array(self.rotation_matrix)
            with np.errstate(all="ignore"):
                is_rotation = np.allclose(R @ R.T, np.eye(3), atol=1e-3) and np.linalg.det(R) > 0
            if not is_rotation:
                raise ValueError("rotation_matrix is not a rotation: rows must be unit, at right angles, right-handed")

    @property
    def pose(self) -> Pose:
        """The start as set by hand, joints straight.

        Raises TrialError where it depends on the body or the cameras: then `airborne.run.first_pose` finds it.
        """
        if self.position_m is None or self.joint_angles_deg:
            raise TrialError("this start needs the body and the cameras; use airborne.run.first_pose")
        return Pose(world_from_root=self.world_from_root)

    @property
    def world_from_root(self) -> RigidTransform:
        """The root's pose as set by hand; raises TrialError where it is not set."""
        if self.position_m is None:
            raise TrialError("the root's position is not set by hand; use airborne.run.first_pose")
        if self.rotation_matrix is not None:
            rotation = Rotation.from_matrix(self.rotation_matrix)
        elif self.quaternion_xyzw is not None:
            rotation = Rotation.from_quat(self.quaternion_xyzw)
        else:
            angles = np.radians(self.somersault_tilt_twist_deg or [0.0, 0.0, 0.0])
            rotation = Rotation.from_matrix(matrix_from_angles(angles))
        return RigidTransform.from_components(self.position_m, rotation)

    @property
    def source_files(self) -> list[str]:
        """The files and folders that define the start."""
        joints = self.joints_m if isinstance(self.joints_m, str) else None
        return [name for name in (joints, self.points_px, self.detections) if name is not None]
