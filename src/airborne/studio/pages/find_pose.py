"""The first pose of a thing: the command `find` in a process of its own, and its answer over the pictures."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import partial
from typing import Any

from nicegui import ui

from airborne.body import BodyModel, Pose
from airborne.cameras import Rig
from airborne.io.text import read_json
from airborne.motion.run_folder import CANDIDATES
from airborne.studio.commands import STOPPED, Command
from airborne.studio.pages.layout import complain, errors_shown, in_thread
from airborne.studio.pages.pose_hand import DRAG_HELP, PoseHand
from airborne.studio.pictures import ShownTrial
from airborne.studio.session import Session
from airborne.studio.starts import pose_of, read_pose, standing_pose, start_from_pose, write_start
from airborne.studio.view import CameraViews, Drag
from airborne.studio.writing import FOLDER

_HELP = "The body is looked for where it stands out from the empty scene, which takes a minute or two."
_UNDECIDED = 3  # the exit code of `airborne find`
_LOOK_EVERY_S = 0.5  # at a search that goes on


@dataclass(eq=False)
class FindPanel:
    """One window's search for a thing; the search itself belongs to all windows."""

    session: Session
    shown: ShownTrial
    rig: Rig
    model: BodyModel
    frame: int  # in view
    at: int = -1  # the frame of the outline
    found: dict[str, Any] | None = None  # the [start] to write
    candidates: tuple[dict[str, Any], ...] = ()  # where the search was undecided

    async def build(self) -> None:
        """Lay out the pictures and what can be done, and show the pose that the trial has."""
        ui.label(f"{_HELP} {DRAG_HELP}").classes("help")
        self.hand = PoseHand(self.model, self.rig.select(self.shown.names).cameras, lambda pose: None)
        with ui.element("div").classes("split"):
            with ui.element("div").classes("wide"):
                self.view = CameraViews(self.shown, frame=self.frame, on_frame=self.turn_to, on_drag=self.drag)
            with ui.element("div").classes("side"), ui.element("div").classes("card"):
                with ui.element("div").classes("row-line"):
                    self.find = ui.button("Find it", on_click=self.search).props("unelevated")
                    self.spinner = ui.spinner()
                    self.seconds = ui.label().classes("small")
                    self.halt = ui.button("Stop", on_click=self.stop).props("flat dense")
                    self.by_hand = ui.button("Place it by hand", on_click=self.begin_by_hand).props("flat dense")
                self.choices = ui.refreshable(self._list_candidates)
                self.choices()
                self.note = ui.label().classes("small")
                self.use = ui.button("Use this pose", on_click=self.write).props("unelevated")
        self.timer = ui.timer(_LOOK_EVERY_S, self.watch, active="find" in self.session.commands)
        self._show_search()
        self.use.set_visibility(False)
        if (stored := read_pose(self.session, self.model)) is not None:
            await self.draw(*stored)
            self.note.set_text("The outline is the pose that the trial has.")

    def turn_to(self, frame: int) -> None:
        """Show the outline in its own frame only."""
        self.frame = frame
        self.session.go(frame=frame)
        self.view.show_over((), self.hand.items() if frame == self.at else ())

    async def begin_by_hand(self) -> None:
        """Show the body upright where the cameras look, to be dragged."""
        await self.draw(self.frame, standing_pose(self.model, self.rig))

    async def drag(self, drag: Drag) -> None:
        """Let the body follow the pointer."""
        if await self.hand.follow(self.view, drag) and drag.has_ended and self.hand.pose is not None:
            self.found = start_from_pose(self.model, self.at, self.hand.pose)
            self.note.set_text("The outline is the pose that was set by hand.")
            self.use.set_visibility(True)
            self.turn_to(self.frame)

    def search(self) -> None:
        """Start `airborne find`."""
        command = self.session.commands.get("find")
        if command is not None and command.is_running:
            return
        words = ["find", self.session.path.name, "-o", f"{FOLDER}/find", "--json"]
        self.session.commands["find"] = Command(words, self.session.folder)
        self.timer.activate()
        self._show_search()

    async def stop(self) -> None:
        """Stop the search."""
        command = self.session.commands.get("find")
        if command is not None:
            await in_thread(command.stop)

    async def watch(self) -> None:
        """Look whether the search has ended, and show what it found."""
        command = self.session.commands.get("find")
        self._show_search()
        if command is None or command.is_running:
            return
        self.timer.deactivate()
        if command.code == 0:
            found = json.loads(command.output())
            self.candidates = ()
            self.note.set_text(found["note"])
            await self.show_found(found)
        elif command.code == _UNDECIDED:
            document = read_json(self.session.folder / FOLDER / "find" / CANDIDATES)
            self.candidates = tuple({**each, "frame": document["frame"]} for each in document["candidates"])
            self.note.set_text("The pictures do not decide between these poses; choose the right one.")
            await self.show_found(self.candidates[0])
        elif command.code != STOPPED:
            complain(command.complaint())
        self.choices.refresh()

    async def show_found(self, each: dict[str, Any]) -> None:
        """Show a pose that was found, ready to be used."""
        self.found = {key: each[key] for key in ("frame", "position_m", "quaternion_xyzw")}
        self.use.set_visibility(True)
        await self.draw(int(each["frame"]), pose_of(each))

    async def draw(self, frame: int, pose: Pose) -> None:
        """Show a pose's outline in its frame."""
        self.at = frame
        self.hand.place(pose)
        self.view.go(frame)
        self.turn_to(frame)

    def write(self) -> None:
        """Write the pose that was found into the trial."""
        if self.found is not None:
            with errors_shown():
                write_start(self.session, self.found)
                ui.notify("the first pose is written into the trial", type="positive")

    def _show_search(self) -> None:
        """Show the buttons that the search has now."""
        command = self.session.commands.get("find")
        is_running = command is not None and command.is_running
        self.find.set_visibility(not is_running)
        self.by_hand.set_visibility(not is_running)
        for each in (self.spinner, self.seconds, self.halt):
            each.set_visibility(is_running)
        self.seconds.set_text(f"looking for the body: {command.seconds:.0f} s" if command is not None else "")

    def _list_candidates(self) -> None:
        for number, each in enumerate(self.candidates, start=1):
            text = f"pose {number}: {each['probability']:.0%}"
            ui.button(text, on_click=partial(self.show_found, each)).props("flat dense")
