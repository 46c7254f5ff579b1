"""The start of players: found by the command `find`, shown as lines of their legs over the pictures."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from nicegui import ui

from airborne.cameras import Rig
from airborne.errors import count
from airborne.studio.outlines import legs_items, player_colours
from airborne.studio.pages.find_controls import FindControls
from airborne.studio.pages.layout import two_columns
from airborne.studio.pages.slow_work import show_errors
from airborne.studio.pictures import ShownTrial
from airborne.studio.session import Session
from airborne.studio.starts import keep_start, read_draft_start
from airborne.studio.trial_edits import with_players
from airborne.studio.view import CameraViews

_USE = "Use these players"
_HELP = (
    "Players at the net are searched for where they stand; this takes a minute or two. The world's axes must be those "
    "of the court: the origin under the middle of the net, x along the net."
)


@dataclass(eq=False)
class FindPlayersPanel:
    """One window's players who are looked for."""

    session: Session
    shown: ShownTrial
    rig: Rig
    frame: int  # in view
    at: int = -1  # the frame of the players
    joints_m: dict[str, dict[str, list[float]]] = field(default_factory=dict)  # player -> joint -> position
    kept: dict[str, Any] | None = None  # the [start] of these players, as it is kept

    async def build(self) -> None:
        """Lay out the pictures and what can be done."""
        ui.label(_HELP).classes("help")
        self.controls = FindControls(self.session, "players", _USE, self.show_found)
        wide, side = two_columns()
        with wide:
            self.view = CameraViews(self.shown, frame=self.frame, on_frame=self.turn_to)
        with side, ui.element("div").classes("card"):
            self.controls.build()
            self.use = ui.button(_USE, on_click=self.write).props("unelevated")
        self.use.set_visibility(False)
        if (start := self._read_draft()) is not None:
            self.show_players(start)

    async def reread(self) -> None:
        """Show who is kept now, and say whether the trial has them: undo or another window may have changed it."""
        if (kept := self._read_draft()) != self.kept:
            self.controls.says = ""
            self.show_players(kept)
        self.controls.say()

    def _read_draft(self) -> dict[str, Any] | None:
        start = read_draft_start(self.session)
        players = [] if start is None else start.get("player") or []
        return start if players and all("joints_m" in each for each in players) else None

    def turn_to(self, frame: int) -> None:
        """Show the players in their own frame only."""
        self.frame = frame
        self.session.go(frame=frame)
        cameras, items = self.rig.select(self.shown.names).cameras, []
        colours = player_colours({name: next(iter(each.values()))[1] for name, each in self.joints_m.items()})
        for name, joints_m in self.joints_m.items() if frame == self.at else ():
            items += legs_items(name, joints_m, cameras, colours[name])
        self.view.show_over((), items)

    async def show_found(self, each: dict[str, Any]) -> None:
        """Show players who were found, ready to be used."""
        players = each.get("player") or each["players"]
        players = [{"name": player["name"], "joints_m": player["joints_m"]} for player in players]
        start = {"frame": int(each["frame"]), "player": players}
        with show_errors():
            keep_start(self.session, start, "players found")
        self.show_players(start)

    def show_players(self, start: dict[str, Any] | None) -> None:
        """Show the players of a [start], ready to be used, or nobody."""
        self.kept = start
        self.at = -1 if start is None else int(start["frame"])
        self.joints_m = {} if start is None else {each["name"]: each["joints_m"] for each in start["player"]}
        self.use.set_visibility(bool(self.joints_m))
        if start is not None:
            self.view.go(self.at)
        self.turn_to(self.frame if start is None else self.at)
        self.controls.tell(start)

    def write(self) -> None:
        """Write the players into the trial."""
        players = {name: {"joints_m": joints_m} for name, joints_m in self.joints_m.items()}
        with show_errors():
            self.session.edit_trial(
                lambda text: with_players(text, self.at, players), f"{count(len(players), 'player')} set"
            )
            ui.notify("the players are written into the trial", type="positive")
