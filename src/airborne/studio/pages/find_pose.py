"""The first pose of a body: found by the command `find`, or placed by hand over the pictures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from nicegui import ui

from airborne.body import BodyModel, Pose
from airborne.cameras import Rig
from airborne.studio.pages.find_controls import FindControls
from airborne.studio.pages.fit_pose import FitButton
from airborne.studio.pages.layout import two_columns
from airborne.studio.pages.pose_hand import DRAG_HELP, KEPT, SET_BY_HAND, STORED, PoseHand
from airborne.studio.pages.pose_stage import PoseStage
from airborne.studio.pages.slow_work import show_errors
from airborne.studio.pictures import ShownTrial
from airborne.studio.session import Session
from airborne.studio.starts import (
    keep_start,
    pose_of,
    read_draft_pose,
    read_draft_start,
    read_pose,
    standing_pose,
    start_from_pose,
    write_start,
)
from airborne.studio.view import CameraViews, Drag

_HELP = "The body is searched for where it stands out from the empty scene; this takes a minute or two."
_USE = "Use this pose"
_START = ("frame", "position_m", "quaternion_xyzw", "joint_angles_deg")  # what is written of an answer


@dataclass(eq=False)
class FindPanel:
    """One window's pose of a body that is looked for."""

    session: Session
    shown: ShownTrial
    rig: Rig
    model: BodyModel
    frame: int  # in view
    at: int = -1  # the frame of the outline
    found: dict[str, Any] | None = None  # the [start] to write

    async def build(self) -> None:
        """Lay out the pictures and what can be done, and show the pose that the trial has."""
        ui.label(f"{_HELP} {DRAG_HELP}").classes("help")
        self.hand = PoseHand(self.model, self.rig.select(self.shown.names).cameras, lambda pose: None)
        self.controls = FindControls(self.session, "body", _USE, self.show_found)
        wide, side = two_columns()
        with wide:
            self.view = CameraViews(self.shown, frame=self.frame, on_frame=self.turn_to, on_drag=self.drag)
        with side, ui.element("div").classes("card"):
            self.controls.build()
            self.use = ui.button(_USE, on_click=self.write).props("unelevated")
            with ui.element("div").classes("row-line tools"):
                ui.button("Place it by hand", on_click=self.begin_by_hand).props("flat dense")
                FitButton(self.session, self.hand, frame_of=lambda: self.at, on_fit=self.take_pose)
                self.stage = PoseStage(self.rig, self.hand, lambda: self.turn_to(self.frame), self.take_pose)
        await self.show_kept()

    async def show_kept(self) -> None:
        """Show the pose that was made here last, or the one that the trial has."""
        self.found = read_draft_start(self.session)
        pose, stored = read_draft_pose(self.model, self.found), read_pose(self.session, self.model)
        self.use.set_visibility(pose is not None)
        if self.found is not None and pose is not None:
            await self.draw(self.found["frame"], pose)
            self.controls.says = self.controls.says or KEPT
            self.controls.tell(self.found)
        elif stored is not None:
            await self.draw(*stored)
            self.controls.note.set_text(STORED)
        else:
            self.at = -1
            self.hand.place(None)
            self.turn_to(self.frame)

    async def reread(self) -> None:
        """Show what is kept now, and say whether the trial has it: undo or another window may have changed it."""
        if read_draft_start(self.session) != self.found:
            self.controls.says = ""
            self.controls.tell(None)
            await self.show_kept()
        elif self.found is not None:
            self.controls.say()

    def turn_to(self, frame: int) -> None:
        """Show the outline in its own frame only."""
        self.frame = frame
        self.session.go(frame=frame)
        self.view.show_over((), self.hand.items() if frame == self.at else ())
        self.stage.show(self.hand.pose if frame == self.at else None)

    async def begin_by_hand(self) -> None:
        """Show the body upright where the cameras look, to be dragged."""
        await self.draw(self.frame, standing_pose(self.model, self.rig))
        self.take_pose(what="body placed by hand")

    async def drag(self, drag: Drag) -> None:
        """Let the body follow the pointer."""
        if await self.hand.follow(self.view, drag) and drag.has_ended:
            self.take_pose()

    def take_pose(self, says: str = SET_BY_HAND, what: str = "pose set by hand") -> None:
        """Keep the pose that the hand holds, and show it, ready to be used."""
        if self.hand.pose is not None:
            self.found = start_from_pose(self.model, self.at, self.hand.pose)
            with show_errors():
                keep_start(self.session, self.found, what)
            self.use.set_visibility(True)
            self.turn_to(self.frame)
            self.controls.says = says
            self.controls.tell(self.found)

    async def show_found(self, each: dict[str, Any]) -> None:
        """Show a pose that was found, ready to be used."""
        self.found = {key: each[key] for key in _START if key in each}
        with show_errors():
            keep_start(self.session, self.found, "pose found")
        self.use.set_visibility(True)
        await self.draw(int(each["frame"]), pose_of(self.model, each))
        self.controls.tell(self.found)

    async def draw(self, frame: int, pose: Pose) -> None:
        """Show a pose's outline in its frame."""
        self.at = frame
        self.hand.place(pose)
        self.view.go(frame)
        self.turn_to(frame)

    def write(self) -> None:
        """Write the pose that was found into the trial."""
        if self.found is not None:
            with show_errors():
                write_start(self.session, self.found)
                ui.notify("the first pose is written into the trial", type="positive")
