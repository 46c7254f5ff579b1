"""The first pose of a body: landmarks clicked with the epipolar curves' help, the body fitted as they are made."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from nicegui import ui

from airborne.body import BodyModel, Pose
from airborne.cameras import Rig
from airborne.studio.clicks import Clicked
from airborne.studio.pages.fit_pose import FitButton
from airborne.studio.pages.layout import two_columns
from airborne.studio.pages.point_list import PointList
from airborne.studio.pages.points_panel import CAMERA_COLOURS, PointsPanel
from airborne.studio.pages.pose_hand import DRAG_HELP, KEPT, SET_BY_HAND, STORED, PoseHand
from airborne.studio.pages.pose_stage import PoseStage
from airborne.studio.pages.slow_work import show_errors
from airborne.studio.pictures import ShownTrial
from airborne.studio.session import Session
from airborne.studio.starts import (
    POSE_COLOUR,
    fit_clicks,
    has_start,
    is_newer_than_clicks,
    keep_start,
    points_name,
    read_draft_pose,
    read_draft_start,
    read_points,
    read_pose,
    standing_pose,
    start_from_pose,
    write_start,
)
from airborne.studio.view import Drag, Mark

_NEEDED = ("hip_left", "hip_right", "shoulder_left", "shoulder_right")
_HELP = (
    "Choose a landmark and click it in two cameras or more: a click draws, in the others, the curve on which it lies, "
    "within two standard deviations."
)
_NEEDED_OF_PERSON = "Both hips and both shoulders are needed."
_NEEDED_OF_THING = "Three landmarks that are not on one line are needed."


class ClickPanel(PointsPanel):
    """One window's clicks in the frame in view; each frame has a table of its own."""

    def __init__(self, session: Session, shown: ShownTrial, rig: Rig, model: BodyModel, frame: int) -> None:
        """Begin at a frame, its clicks not read yet."""
        landmarks = [landmark.name for landmark in model.landmarks]
        needed = [name for name in _NEEDED if name in landmarks]
        self._landmarks = [*needed, *(name for name in landmarks if name not in needed)]
        super().__init__(session, shown, Clicked((), None, {}), self._landmarks[0])
        self.rig, self.model, self.frame = rig, model, frame
        self.hand = PoseHand(model, rig.select(shown.names).cameras, lambda pose: None)
        self.is_by_hand = False  # the pose, not fitted to the clicks
        self.kept: dict[str, Any] | None = None  # the [start] of the pose that was made by hand in this frame
        self.outline: list[dict[str, Any]] = []  # of the pose
        self.says = ""

    @property
    def names(self) -> list[str]:
        """The landmarks that can be clicked, those that are needed first."""
        return self._landmarks

    @property
    def file(self) -> str:
        """The table of the frame in view."""
        return points_name(self.frame)

    async def build(self) -> None:
        """Lay out the pictures and the list of landmarks, and show the clicks that there are."""
        needed = _NEEDED_OF_PERSON if self.model.has_joints else _NEEDED_OF_THING
        ui.label(f"{_HELP} {needed} {DRAG_HELP}").classes("help")
        wide, side = two_columns()
        with wide:
            self.build_views(self.frame, on_drag=self.drag)
        with side:
            with ui.element("div").classes("card"):
                self.note = ui.label().classes("small")
                self.use = ui.button("Use this pose", on_click=self.write).props("unelevated")
                with ui.element("div").classes("row-line tools"):
                    ui.button("Remove the chosen click", on_click=self.remove).props("flat dense")
                    ui.button("Place it by hand", on_click=self.begin_by_hand).props("flat dense")
                    FitButton(
                        self.session,
                        self.hand,
                        frame_of=lambda: self.frame,
                        on_fit=self.take_pose,
                        settle=self.latest.settle,
                    )
                    self.stage = PoseStage(self.rig, self.hand, self.show_pose, self.take_pose)
            self.list = PointList(self.shown.names, self.choose)
        await self.show_frame()
        stored = read_pose(self.session, self.model)
        if stored is not None and stored[0] == self.frame and (self.kept is None or has_start(self.session, self.kept)):
            self.place(stored[1], STORED)

    async def show_frame(self) -> None:
        """Show the clicks of the frame in view, and the pose made by hand in it since, or fitted to them."""
        await self.hand.place_next(None)
        self.frame = self.view.frame
        self.selected, self.outline, self.says, self.is_by_hand = None, [], "", False
        self.clicked = Clicked((), None, {})
        with show_errors():
            self.clicked, self.kept = read_points(self.session, self.frame), self._read_draft()
        pose = read_draft_pose(self.model, self.kept)
        if pose is None:
            await self.solve()
        else:
            self.place(pose, KEPT)

    def begin_by_hand(self) -> None:
        """Show the body upright where the cameras look, to be dragged."""
        self.hand.place(standing_pose(self.model, self.rig))
        self.take_pose("Drag the body or its limbs; Shift turns it.", "body placed by hand")

    def place(self, pose: Pose, says: str) -> None:
        """Show a pose that is not fitted to the clicks."""
        self.hand.place(pose)
        self.show_pose(says)

    async def drag(self, drag: Drag) -> None:
        """Let the body follow the pointer; a click that is dragged is moved at the end."""
        did_move = await self.hand.follow(self.view, drag)
        if did_move and drag.has_ended and drag.mark is None:
            self.take_pose()
        elif drag.has_ended and drag.mark is not None:
            await self.move(drag.mark, *drag.px)

    def show_pose(self, says: str = SET_BY_HAND) -> None:
        """Show the pose that the hand holds, which is not fitted to the clicks."""
        self.is_by_hand, self.says, self.outline = True, says, self.hand.items()
        self.show()

    def take_pose(self, says: str = SET_BY_HAND, what: str = "pose set by hand") -> None:
        """Keep the pose that the hand holds, and show it; it is not fitted to the clicks."""
        if self.hand.pose is None:
            return
        with show_errors():
            keep_start(self.session, start_from_pose(self.model, self.frame, self.hand.pose), what)
            self.kept = self._read_draft()
        self.show_pose(says)

    def _read_draft(self) -> dict[str, Any] | None:
        """Return the [start] that was made by hand in the frame in view, after its clicks."""
        start = read_draft_start(self.session)
        if start is None or start["frame"] != self.frame or not is_newer_than_clicks(self.session, start):
            return None
        return start

    async def turn_to(self, frame: int) -> None:
        """Show the clicks of another frame."""
        if frame != self.frame:
            self.session.go(frame=frame)
            await self.show_frame()

    async def reread(self) -> None:
        """Show the clicks and the pose that are kept of the frame now: undo or another window may have changed them."""
        with show_errors():
            clicked = read_points(self.session, self.frame)
            if self._read_draft() != self.kept:
                await self.show_frame()
            elif clicked.text(self.shown.names) != self.clicked.text(self.shown.names):
                self.clicked = clicked
                await self.solve()

    async def solve(self) -> None:
        """Fit the body to the clicks, or say what is missing; the clicks are shown at once."""
        self.is_by_hand, self.kept, self.says = (
            False,
            self._read_draft(),
            "fitting the body" if self.clicked.names else "",
        )
        self.show()
        if not self.clicked.names:
            return
        frame = self.frame
        solved = await self.latest.do("fitting the body", fit_clicks, self.model, self.rig, self.clicked)
        if solved is not None and not self.is_by_hand and frame == self.frame:  # set, or gone on, since
            pose, self.says = solved
            self.hand.place(pose)
            self.outline = self.hand.items()
            self.show()

    def write(self) -> None:
        """Write the clicks' frame and table into the trial, or the pose that was set by hand."""
        start: dict[str, Any] = {"frame": self.frame, "points_px": self.file}
        if self.is_by_hand and self.hand.pose is not None:
            start = start_from_pose(self.model, self.frame, self.hand.pose)
            if start != self.kept:  # a drag that is still going on: what is written is what is kept
                self.take_pose(self.says)
        with show_errors():
            write_start(self.session, start)
            ui.notify("the first pose is written into the trial", type="positive")

    def show(self) -> None:
        """Show marks, curves, outline and buttons as they are now."""
        marks = sorted(self._marks(), key=lambda mark: mark.get("colour") != POSE_COLOUR)
        items: list[Any] = [*self.epipolar_items(self.chosen, self.rig), *self.outline]
        self.view.show_over(marks, items, self.selected)
        self.note.set_text(self.says or f"No landmark is clicked in frame {self.frame} yet.")
        self.use.set_visibility(bool(self.outline))
        self.stage.show(self.hand.pose if self.outline else None)
        self.list.show(self.names, self.chosen, partial(self.off_px, rig=self.rig))

    def _marks(self) -> Iterator[Mark]:
        for name in self.clicked.names:
            to = self.consensus_px(name, self.rig)
            for pane, camera in enumerate(self.shown.names):
                u, v = map(float, self.at(name, camera))
                if np.isfinite(u):
                    colour = POSE_COLOUR if name == self.chosen else CAMERA_COLOURS[pane % len(CAMERA_COLOURS)]
                    mark: Mark = {
                        "id": f"{name}|{camera}",
                        "pane": pane,
                        "u": u,
                        "v": v,
                        "label": name,
                        "colour": colour,
                        "holds": True,
                    }
                    yield {**mark, "to": to[pane].tolist()} if np.isfinite(to[pane]).all() else mark
