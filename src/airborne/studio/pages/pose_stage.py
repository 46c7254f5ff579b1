"""A pose in 3D: the body among the cameras, with handles that move and turn it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from nicegui import ui
from scipy.spatial.transform import RigidTransform

from airborne.body import Pose
from airborne.cameras import Rig
from airborne.export.views import cached_surface_arrays
from airborne.studio.pages.pose_hand import PoseHand
from airborne.studio.stage import BodyOnStage, Gizmo, draw_cameras
from airborne.tracking.image_regions import bounding_points

_BODY_MESH = "/body/mesh/{part}"
_HEIGHT = "height: 300px; width: 100%; flex: none; display: flex"
_REACH = 0.6  # of the handles, of the body's longest side
_AWAY = 1.2  # how far off the body is looked at from, of the same


class PoseStage:
    """One window's scene of the pose that a hand holds; it is drawn when it is first asked for."""

    def __init__(self, rig: Rig, hand: PoseHand, on_move: Callable[[], None], on_end: Callable[[], None]) -> None:
        """Lay out the button that opens it; `on_move` is called while it moves the hand's pose, `on_end` after that."""
        self.rig, self.hand, self._on_move, self._on_end = rig, hand, on_move, on_end
        self._body: BodyOnStage | None = None
        self._is_held = False  # by a handle, which is where the pointer has it
        self.opener = ui.button("Move and turn it in 3D", on_click=self.open).props("flat dense")
        self.area = ui.element("div").style(_HEIGHT)
        self.area.set_visibility(False)
        self.show(hand.pose)

    def open(self) -> None:
        """Draw the scene around the pose."""
        pose = self.hand.pose
        if pose is None:
            return
        posed = self.hand.model.with_pose(pose)
        size_m = float(np.ptp(bounding_points(posed, cached_surface_arrays(posed.model)), axis=0).max())
        self.area.set_visibility(True)
        with self.area:
            middle = pose.world_from_root.translation
            scene = draw_cameras(self.rig, seen_from=(middle, _AWAY * size_m))
        self._body = BodyOnStage(scene, self.hand.model, _BODY_MESH)
        self._gizmo = Gizmo(scene, _REACH * size_m, self.move)
        self.show(pose)

    def show(self, pose: Pose | None) -> None:
        """Show a pose and its handles; None hides them."""
        self.opener.set_visibility(self._body is None and pose is not None)
        if self._body is not None:
            self._body.show(pose)
            self._gizmo.visible(pose is not None)
            if pose is not None and not self._is_held:
                self._gizmo.place(pose.world_from_root)

    async def move(self, world_from_root: RigidTransform, has_ended: bool) -> None:
        """Bring the body where its handles are."""
        if self.hand.pose is None or self._body is None:
            return
        self._is_held = not has_ended
        self.hand.place(replace(self.hand.pose, world_from_root=world_from_root))
        (self._on_end if has_ended else self._on_move)()
