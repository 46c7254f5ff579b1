"""The command `find` in a process of its own: its buttons, its answer, and what it leaves to choose from."""

from __future__ import annotations

import json
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from nicegui import ui

from airborne.errors import UNDECIDED, count
from airborne.io.text import read_json
from airborne.run.find import describe_probability
from airborne.studio.commands import Command
from airborne.studio.pages.command_watch import CommandWatch
from airborne.studio.session import Session
from airborne.studio.starts import FOUND, FOUND_LIST, FOUND_PICTURE, has_start


@dataclass(eq=False)
class FindControls:
    """One window's buttons of a search; the search itself belongs to all windows."""

    session: Session
    what: str  # is looked for
    use: str  # the words of the button that writes it into the trial
    show: Callable[[dict[str, Any]], Awaitable[None]]  # takes the answer, or a candidate with its frame
    candidates: tuple[dict[str, Any], ...] = ()  # where the search was undecided
    says: str = ""  # of the start in view
    start: dict[str, Any] | None = None  # that is in view, as it would be written

    def build(self) -> None:
        """Lay out the buttons, the choices, and the line that says what was found."""
        with ui.element("div").classes("row-line"):
            find = ui.button("Find it", on_click=self.search).props("unelevated")
            self.watch = CommandWatch(
                self.session,
                "find",
                self.take,
                words=f"looking for the {self.what}",
                codes=(0, UNDECIDED),
                again=True,
            )
            self.watch.buttons = [find]
        self.choices = ui.refreshable(self._list_candidates)
        self.choices()
        self.note = ui.label().classes("small")

    def search(self) -> None:
        """Start `airborne find`."""
        self.watch.start("find", self.session.path.name, "-o", FOUND, "--json")

    async def take(self, command: Command) -> None:
        """Show what the search has found."""
        if command.code == 0:
            found = json.loads(command.output())
            self.candidates = ()
            what = f"{count(len(found['player']), 'player')} found" if "player" in found else "Found"
            probability = describe_probability(found["probability"])
            says = " ".join([f"{what} in frame {found['frame']}, {probability}.", *found.pop("notes")[1:]])
        else:
            document = read_json(self.session.file(FOUND_LIST))
            self.candidates = tuple({**each, "frame": document["frame"]} for each in document["candidates"])
            found, says = self.candidates[0], "The pictures do not decide between these; choose the right one."
        if not command.is_told:  # else what was made of it since is the draft
            command.is_told, self.says = True, says
            await self.show(found)
        self.choices.refresh()

    def tell(self, start: dict[str, Any] | None) -> None:
        """Take the [start] that is in view now, None for none, and say whether the trial has it."""
        self.start = start
        self.say()

    def say(self) -> None:
        """Say what is in view, and whether the trial has it now."""
        if self.start is None:
            self.note.set_text("")
        else:
            state = (
                "The trial begins with this pose."
                if has_start(self.session, self.start)
                else f"Not yet used: press {self.use}."
            )
            self.note.set_text(f"{self.says} {state}")

    def _list_candidates(self) -> None:
        """Show the candidates as pictures, and a button for each."""
        picture = self.session.folder / FOUND_PICTURE
        if self.candidates and picture.is_file():
            address = f"/candidates?{picture.stat().st_mtime_ns}"
            with ui.element("a").props(f'href="{address}" target="_blank" rel="noopener"').classes("found"):
                image = ui.element("img").props(f'src="{address}"')
                image._props["alt"] = "the candidates, one a row, in every camera; opens larger"
        with ui.element("div").classes("row-line"):
            for number, each in enumerate(self.candidates, start=1):
                is_likely = each.get("is_plausible", True)  # of players and of what was found before, unsaid
                how = f"{100 * each['probability']:.0f} %" if is_likely else "disagrees with what moves"
                text = f"candidate {number}, {how}"
                ui.button(text, on_click=partial(self.show, each)).props("flat dense no-caps")
