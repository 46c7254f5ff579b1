"""The start of players: found by the command `find`, shown as lines of their legs over the pictures."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from nicegui import ui

from airborne.cameras import Rig
from airborne.errors import count
from airborne.studio.outlines import legs_items, player_colours
from airborne.studio.pages.find_controls import FindControls
from airborne.studio.pages.layout import errors_shown
from airborne.studio.pictures import ShownTrial
from airborne.studio.session import Session
from airborne.studio.trial_edits import with_players
from airborne.studio.view import CameraViews

_USE = "Use these players"
_HELP = (
    "Players at the net are looked for where they stand, which takes a minute or two. The world must be the court's: "
    "its origin under the middle of the net, x along the net."
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

    async def build(self) -> None:
        """Lay out the pictures and what can be done."""
        ui.label(_HELP).classes("help")
        self.controls = FindControls(self.session, "players", _USE, self.show_found)
        with ui.element("div").classes("split"):
            with ui.element("div").classes("wide"):
                self.view = CameraViews(self.shown, frame=self.frame, on_frame=self.turn_to)
            with ui.element("div").classes("side"), ui.element("div").classes("card"):
                self.controls.build()
                self.use = ui.button(_USE, on_click=self.write).props("unelevated")
        self.use.set_visibility(False)

    async def reread(self) -> None:
        """Say whether the trial has what is in view."""
        self.controls.say()

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
        self.at = int(each["frame"])
        self.joints_m = {player["name"]: player["joints_m"] for player in each.get("player") or each["players"]}
        self.use.set_visibility(bool(self.joints_m))
        self.view.go(self.at)
        self.turn_to(self.at)
        players = [{"name": name, "joints_m": joints_m} for name, joints_m in self.joints_m.items()]
        self.controls.tell({"frame": self.at, "player": players})

    def write(self) -> None:
        """Write the players into the trial."""
        players = {name: {"joints_m": joints_m} for name, joints_m in self.joints_m.items()}
        with errors_shown():
            self.session.edit_trial(
                lambda text: with_players(text, self.at, players), f"{count(len(players), 'player')} set"
            )
            ui.notify("the players are written into the trial", type="positive")
