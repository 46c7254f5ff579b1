"""The command `find` in a process of its own: its buttons, its answer, and what it leaves to choose from."""

from __future__ import annotations

import json
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from nicegui import ui

from airborne.io.text import read_json
from airborne.motion.run_folder import CANDIDATES
from airborne.studio.commands import STOPPED, Command
from airborne.studio.pages.layout import complain, in_thread
from airborne.studio.session import Session
from airborne.studio.writing import FOLDER

_UNDECIDED = 3  # the exit code of `airborne find`
_LOOK_EVERY_S = 0.5  # at a search that goes on


@dataclass(eq=False)
class FindControls:
    """One window's buttons of a search; the search itself belongs to all windows."""

    session: Session
    what: str  # is looked for
    show: Callable[[dict[str, Any]], Awaitable[None]]  # takes the answer, or a candidate with its frame
    candidates: tuple[dict[str, Any], ...] = ()  # where the search was undecided

    def build(self) -> None:
        """Lay out the buttons, the choices, and the line that says what was found."""
        with ui.element("div").classes("row-line"):
            self.find = ui.button("Find it", on_click=self.search).props("unelevated")
            self.spinner = ui.spinner()
            self.seconds = ui.label().classes("small")
            self.halt = ui.button("Stop", on_click=self.stop).props("flat dense")
        self.choices = ui.refreshable(self._list_candidates)
        self.choices()
        self.note = ui.label().classes("small")
        self.timer = ui.timer(_LOOK_EVERY_S, self.watch, active="find" in self.session.commands)
        self._show_search()

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
            await self.show(found)
        elif command.code == _UNDECIDED:
            document = read_json(self.session.folder / FOLDER / "find" / CANDIDATES)
            self.candidates = tuple({**each, "frame": document["frame"]} for each in document["candidates"])
            self.note.set_text("The pictures do not decide between these; choose the right one.")
            await self.show(self.candidates[0])
        elif command.code != STOPPED:
            complain(command.complaint())
        self.choices.refresh()

    def _show_search(self) -> None:
        """Show the buttons that the search has now."""
        command = self.session.commands.get("find")
        is_running = command is not None and command.is_running
        self.find.set_visibility(not is_running)
        for each in (self.spinner, self.seconds, self.halt):
            each.set_visibility(is_running)
        self.seconds.set_text(f"looking for the {self.what}: {command.seconds:.0f} s" if command is not None else "")

    def _list_candidates(self) -> None:
        for number, each in enumerate(self.candidates, start=1):
            text = f"{number}: {each['probability']:.0%}"
            ui.button(text, on_click=partial(self.show, each)).props("flat dense")
