"""The forms in which a trial says where a body is at a frame: shared by [start] and [[key]]."""

from __future__ import annotations

import numpy as np
from pydantic import model_validator
from scipy.spatial.transform import Rotation

from airborne.geometry.rotations import matrix_from_angles
from airborne.io.names import CheckedPath
from airborne.trial.table import ClickTable, Matrix, Quaternion, SettingsTable, Vector

BY_HAND = frozenset(
    {"position_m", "rotation_matrix", "quaternion_xyzw", "somersault_tilt_twist_deg", "joint_angles_deg"}
)

FARTHEST_M = 100.0  # of a coordinate: no court is larger


class PoseForms(SettingsTable):
    """A body at a frame: a pose by hand, positions or clicked pixels of its landmarks, or detections of a network."""

    position_m: Vector | None = None
    rotation_matrix: Matrix | None = None
    quaternion_xyzw: Quaternion | None = None
    somersault_tilt_twist_deg: Vector | None = None
    joint_angles_deg: dict[str, Vector] = {}  # segment -> x, y, z
    joints_m: dict[str, Vector] | CheckedPath | None = None  # landmark -> position, or a table of them
    points_px: ClickTable | CheckedPath | None = None  # landmark -> camera -> u, v, or a table
    detections: CheckedPath | None = None  # .npz, or a folder of folders of OpenPose JSON
    detections_cameras: dict[str, str] = {}  # camera -> its array or folder
    skeleton: str | None = None  # whose points the detections are; None: as their files say

    @model_validator(mode="after")
    def _check_detections(self) -> PoseForms:
        if self.detections_cameras and self.detections is None:
            raise ValueError("detections_cameras goes with detections")
        if self.skeleton is not None and self.detections is None:
            raise ValueError("skeleton goes with detections")
        return self

    @model_validator(mode="after")
    def _check_rotation(self) -> PoseForms:
        given = [self.rotation_matrix, self.quaternion_xyzw, self.somersault_tilt_twist_deg]
        if sum(value is not None for value in given) > 1:
            raise ValueError("give rotation_matrix, quaternion_xyzw or somersault_tilt_twist_deg, one of them")
        if self.quaternion_xyzw is not None and not any(self.quaternion_xyzw):
            raise ValueError("quaternion_xyzw is all zeros; give x, y, z, w of a rotation, of any length above zero")
        if self.rotation_matrix is not None:
            R = np.array(self.rotation_matrix)
            with np.errstate(all="ignore"):
                is_rotation = np.allclose(R @ R.T, np.eye(3), atol=1e-3) and np.linalg.det(R) > 0
            if not is_rotation:
                raise ValueError("rotation_matrix is not a rotation: rows must be unit, at right angles, right-handed")
        return self

    @model_validator(mode="after")
    def _check_places(self) -> PoseForms:
        named = self.joints_m if isinstance(self.joints_m, dict) else {}
        for name, place in {"position_m": self.position_m, **named}.items():
            if place is not None and max(map(abs, place)) > FARTHEST_M:
                raise ValueError(f"{name} = {list(place)} lies over {FARTHEST_M:g} m away; give metres")
        return self

    @property
    def rotation(self) -> Rotation | None:
        """The root's orientation as set by hand: world from root; None where it is not set."""
        if self.rotation_matrix is not None:
            return Rotation.from_matrix(self.rotation_matrix)
        if self.quaternion_xyzw is not None:
            return Rotation.from_quat(self.quaternion_xyzw)
        if self.somersault_tilt_twist_deg is not None:
            return Rotation.from_matrix(matrix_from_angles(np.radians(self.somersault_tilt_twist_deg)))
        return None

    @property
    def source_files(self) -> list[str]:
        """The files and folders that define it."""
        return [name for name in (self.joints_m, self.points_px, self.detections) if isinstance(name, str)]
