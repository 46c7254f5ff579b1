"""[start]: where the body or the players are at the first frame."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator
from scipy.spatial.transform import RigidTransform

from airborne.body import Pose
from airborne.errors import TrialError
from airborne.trial.players import PlayerTable
from airborne.trial.pose_forms import BY_HAND, PoseForms

ONLY_BYSTANDERS = "every player is a bystander; give one of them the points of the legs too"


class StartTable(PoseForms):
    """The first pose: set by hand, or found from positions of the body's landmarks; or those of several players."""

    find: bool = False  # the body, or the players, are looked for, from `frame` on
    near_net: bool = True  # of players that are looked for: those at the net alone
    frame: Annotated[int, Field(ge=0)] = 0
    player: list[PlayerTable] = []

    @model_validator(mode="after")
    def _check_start(self) -> StartTable:
        ways = [self.joints_m, self.points_px, self.detections]
        given = (
            sum(value is not None for value in ways)
            + bool(BY_HAND & self.model_fields_set)
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
        if names and all(player.is_bystander for player in self.player):
            raise ValueError(ONLY_BYSTANDERS)
        if BY_HAND & self.model_fields_set:
            if self.position_m is None:
                raise ValueError("position_m is missing: give where the root's origin is")
            if self.rotation is None:
                raise ValueError("give rotation_matrix, quaternion_xyzw or somersault_tilt_twist_deg, one of them")
        return self

    @property
    def source_files(self) -> list[str]:
        """The files and folders that define it, and those of the players."""
        return [*super().source_files, *(name for player in self.player for name in player.source_files)]

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
        if self.position_m is None or self.rotation is None:
            raise TrialError("the root's position is not set by hand; use airborne.run.first_pose")
        return RigidTransform.from_components(self.position_m, self.rotation)
