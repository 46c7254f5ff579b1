"""A hand at a pose: what is taken in one picture follows the pointer there, and the outline in all pictures."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from airborne.body import BodyModel, Pose
from airborne.cameras import Camera
from airborne.studio.dragging import Grip, Pin, drag_pose, grip_at, grip_landmark, turn_with
from airborne.studio.outlines import outline_items
from airborne.studio.pages.slow_work import in_thread
from airborne.studio.starts import POSE_COLOUR
from airborne.studio.view import CameraViews, Drag, Mark

DRAG_HELP = "Drag a limb, or the whole body by its trunk; Shift turns it. A drag in a second picture sets the distance."
SET_BY_HAND = "The pose was set by hand."
KEPT = "The outline is the pose that was made here last."
STORED = "The outline is the pose that the trial has."
_FINE_PX = 1000  # wide: while larger pictures are dragged over, the outline has half their resolution


class PoseHand:
    """One window's hand at the pose of a body; it remembers where earlier drags of the same limb have put it."""

    def __init__(self, model: BodyModel, cameras: Sequence[Camera], marks: Callable[[Pose], list[Mark] | None]) -> None:
        """Begin without a pose; `marks` are those of a pose while it is dragged, None: as they are."""
        self.model, self.cameras, self._marks = model, tuple(cameras), marks
        self.pose: Pose | None = None
        self.colour = POSE_COLOUR  # of its outline
        self.before: list[dict[str, Any]] = []  # the outline of another pose, beside it
        self._taken: Pose | None = None  # the pose when the drag began
        self._grip: Grip | None = None
        self._number = -1  # of the drag
        self._pins: dict[str, Pin] = {}  # camera -> where the last drag there left its point
        self._one_at_a_time = asyncio.Lock()

    @property
    def grip(self) -> Grip | None:
        """What was taken last."""
        return self._grip

    def place(self, pose: Pose | None) -> None:
        """Begin with a pose."""
        self.pose, self._pins, self._number, self.before = pose, {}, -1, []

    async def place_next(self, pose: Pose | None) -> None:
        """Begin with a pose once the movement on its way has been made: that is of the pose before."""
        async with self._one_at_a_time:
            self.place(pose)

    def items(self) -> list[dict[str, Any]]:
        """Return the pose's outline, where it can be grabbed."""
        if self.pose is None:
            return []
        own = outline_items(self.model.with_pose(self.pose), self.cameras, self.colour, grab=True)
        return [*self.before, *own]

    async def follow(self, view: CameraViews, drag: Drag) -> bool:
        """Move the body with the pointer; say whether there was anything to move.

        On the way it is shown, and where the drag has ended it is the panel's to show.
        """
        async with self._one_at_a_time:
            did_move, drawn = await in_thread(self._move, drag, says="")
        view.follow(drag, *drawn)
        return did_move

    def _move(self, drag: Drag) -> tuple[bool, tuple[list[Mark] | None, list[dict[str, Any]] | None]]:
        if self.pose is None:
            return False, (None, None)
        camera = self.cameras[drag.pane]
        if drag.number != self._number:
            self._number, self._taken, self.before = drag.number, self.pose, []
            self._grip = self._take(drag, camera)
        if self._grip is None or self._taken is None:
            return False, (None, None)
        pin = Pin(self._grip, camera, np.array(drag.px))
        others = [each for name, each in self._pins.items() if name != camera.name]
        self.pose = drag_pose(self.model, self.pose, self._taken, [*others, pin])
        if drag.has_ended:
            if not drag.turns:
                self._pins[camera.name] = pin
            return True, (None, None)
        step = 2 if max(each.size[0] for each in self.cameras) > _FINE_PX else 1
        posed = self.model.with_pose(self.pose)
        return True, (self._marks(self.pose), outline_items(posed, self.cameras, self.colour, step=step, grab=True))

    def _take(self, drag: Drag, camera: Camera) -> Grip | None:
        assert self.pose is not None
        if drag.mark is not None:
            grip: Grip | None = grip_landmark(self.model, drag.mark.rsplit("|", 1)[0])
        else:
            grip = grip_at(self.model.with_pose(self.pose), camera, np.array(drag.start))
        if grip is None:
            return None
        grip = turn_with(grip) if drag.turns else grip
        if any(not np.array_equal(pin.grip.free, grip.free) for pin in self._pins.values()):
            self._pins = {}  # another limb
        return grip
