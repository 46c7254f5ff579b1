"""The start of players: torso, hips, knees and ankles of one player after the other, clicked in the pictures."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
from nicegui import ui

from airborne.body.legs import LEG_POINTS, RODS
from airborne.cameras import Rig
from airborne.errors import AirborneError, count
from airborne.io.names import check_column
from airborne.studio.clicks import Clicked
from airborne.studio.outlines import legs_items, player_colours
from airborne.studio.pages.layout import two_columns
from airborne.studio.pages.point_list import PointList
from airborne.studio.pages.points_panel import CHOSEN_COLOUR, PointsPanel
from airborne.studio.pages.slow_work import complain, in_thread, show_errors
from airborne.studio.pictures import ShownTrial
from airborne.studio.session import Session
from airborne.studio.starts import player_file, read_clicked_players, read_start_players
from airborne.studio.trial_edits import with_players
from airborne.studio.view import Mark
from airborne.tracking.players import PlayerStart
from airborne.types import Array

_POINTS = ("torso", *LEG_POINTS, "foot_left", "foot_right")
_NEEDED = _POINTS[:7]
_STORED_COLOUR = "#f5f6f7"  # of players whom the trial has
_HELP = (
    "Go to the frame where tracking starts. Click each player's torso, midway between hips and shoulders, and the "
    "joints of the legs, in two cameras or more. A player with only the torso clicked is not tracked; tracking "
    "only knows that this body may hide the others."
)


class PlayersPanel(PointsPanel):
    """One window's clicks of all players in the frame in view; each player has a table of each frame."""

    def __init__(self, session: Session, shown: ShownTrial, rig: Rig, frame: int) -> None:
        """Begin with the players that the folder has tables of in a frame, or the first one."""
        super().__init__(session, shown, Clicked((), None, {}), _POINTS[0])
        self.rig, self.frame = rig, frame
        self.players: dict[str, Clicked] = {}
        self.start_frame = 0
        self.starts: dict[str, PlayerStart] = {}  # that the trial has
        self.player = "player1"

    @property
    def names(self) -> tuple[str, ...]:
        """The points of a player, those that are needed first."""
        return _POINTS

    @property
    def file(self) -> str:
        """The table of the chosen player's clicks in the frame in view."""
        return player_file(self.player, self.frame)

    async def build(self) -> None:
        """Lay out the pictures and the list of points."""
        ui.label(_HELP).classes("help")
        wide, side = two_columns()
        with wide:
            self.build_views(self.frame)
        with side:
            with ui.element("div").classes("card"):
                self.choice = ui.select([], label="player", on_change=lambda event: self.take(event.value))
                self.choice.props("outlined dense options-dense")
                with ui.element("div").classes("row-line"):
                    self.new = ui.input("another player's name").props("outlined dense").style("width: 195px")
                    ui.button("Add", on_click=self.add).props("outline")
                self.note = ui.label().classes("small")
                self.use = ui.button("Use these players", on_click=self.write).props("unelevated")
                ui.button("Remove the chosen click", on_click=self.remove).props("flat dense")
            self.list = PointList(self.shown.names, self.choose)
        await self.reread()

    async def turn_to(self, frame: int) -> None:
        """Show the clicks of another frame."""
        if frame != self.frame:
            self.frame = frame
            self.session.go(frame=frame)
            self.selected = None
            await self.reread()

    async def reread(self) -> None:
        """Show the clicks that the tables hold now."""
        with show_errors():
            self.players = read_clicked_players(self.session.folder, self.frame)
            self.players.setdefault(self.player, Clicked((), None, {}))
            self.clicked = self.players[self.player]
            self.start_frame, self.starts = await in_thread(
                read_start_players, self.session, self.rig, says="reading the players"
            )
            self.choice.set_options(list(self.players), value=self.player)
            self.show()

    async def add(self) -> None:
        """Begin with another player."""
        try:
            unused = (f"player{n}" for n in itertools.count(1) if f"player{n}" not in self.players)
            name = check_column((self.new.value or next(unused)).strip())
        except ValueError as error:
            complain(str(error))
            return
        self.new.set_value("")
        self.player = name
        self.chosen, self.selected = _POINTS[0], None
        await self.reread()

    async def take(self, name: str | None) -> None:
        """Choose a player."""
        if name is not None and name != self.player:
            self.player, self.clicked = name, self.players[name]
            self.chosen, self.selected = _POINTS[0], None
            self.show()

    async def solve(self) -> None:
        """Show the clicks, and the legs that they give."""
        self.players[self.player] = self.clicked
        self.show()

    def write(self) -> None:
        """Write the players into the trial."""
        files = {name: player_file(name, self.frame) for name in self.players if self._is_ready(name)}
        unready = [name for name, clicked in self.players.items() if name not in files and clicked.names]
        with show_errors():
            if not files or unready:
                missing = unready or list(self.players)
                raise AirborneError(
                    f"click the torso and all points of the legs of {', '.join(missing)} in two cameras"
                )
            stay = self.starts.values() if self.frame == self.start_frame else ()
            if not any(set(self._points(name)) >= set(_NEEDED) for name in files) and not any(
                start.has_legs for start in stay
            ):
                raise AirborneError("nobody would be tracked; click the points of a player's legs too")
            players = {name: {"points_px": file} for name, file in files.items()}
            what = f"{count(len(files), 'player')} set"
            self.session.edit_trial(lambda text: with_players(text, self.frame, players, keeps_found=True), what)
            ui.notify("the first poses are written into the trial", type="positive")

    def show(self) -> None:
        """Show marks, curves, legs and buttons as they are now."""
        places = {name: next(iter(self._points(name).values()), np.zeros(3)) for name in self.players}
        colours = player_colours({name: float(at[1]) for name, at in places.items()})
        marks = list(self._marks(colours[self.player]))
        legs = [item for name in self.players for item in self._legs(name, colours[name])]
        ready = [name for name in self.players if self._is_ready(name)]
        stored = self._legs_of_trial(ready) if self.frame == self.start_frame else ()
        self.view.show_over(marks, [*self.epipolar_items(self.chosen, self.rig), *stored, *legs], self.selected)
        own = f"The trial's start, frame {self.start_frame}: {', '.join(self.starts)}. " if self.starts else ""
        self.note.set_text(f"{own}{'Ready to use: ' + ', '.join(ready) if ready else 'No player is ready to use yet'}.")
        self.use.set_visibility(bool(ready))
        self.list.show(_POINTS, self.chosen, partial(self.off_px, rig=self.rig))

    def _legs_of_trial(self, ready: Sequence[str]) -> Iterator[Any]:
        """Yield the legs of the players whom the trial has and who are not clicked here."""
        cameras = self.rig.select(self.shown.names).cameras
        for name, start in self.starts.items():
            if name not in ready and start.has_legs:
                joints_m = {joint: at.tolist() for joint, at in start.joints_m.items()}
                yield from legs_items(name, joints_m, cameras, _STORED_COLOUR)

    def _points(self, name: str) -> dict[str, Array]:
        """Return the clicked points of a player that two cameras see: (3,) [m]."""
        clicked = self.players[name]
        found = {}
        for point in clicked.names:
            px = np.stack([clicked.at(point, camera) for camera in self.rig.names])
            place = self.rig.points_from_px(px)
            if np.isfinite(place).all():
                found[point] = place
        return found

    def _is_ready(self, name: str) -> bool:
        """Whether all points of a player are clicked, or the torso alone."""
        points, clicked = set(self._points(name)), self.players[name]
        seen = {point for point in clicked.names if any(np.isfinite(each).any() for each in _rows(clicked, point))}
        return points == seen and (points == {"torso"} or points >= set(_NEEDED))

    def _legs(self, name: str, colour: str) -> Iterator[Any]:
        points = self._points(name)
        for a, b in RODS:
            ends = [points[LEG_POINTS[k]] for k in (a, b) if LEG_POINTS[k] in points]
            if len(ends) == 2:
                for pane, camera in enumerate(self.shown.names):
                    line = self.rig[camera].px_from_world(np.array(ends))
                    if np.isfinite(line).all():
                        yield {"pane": pane, "points": line.round(1).tolist(), "colour": colour, "width": 2}
        if "torso" in points:
            for pane, camera in enumerate(self.shown.names):
                u, v = self.rig[camera].px_from_world(points["torso"]).tolist()
                yield {"pane": pane, "points": [[u, v], [u, v]], "colour": colour, "width": 6, "text": name}

    def _marks(self, colour: str) -> Iterator[Mark]:
        for name in self.clicked.names:
            to = self.consensus_px(name, self.rig)
            for pane, camera in enumerate(self.shown.names):
                u, v = map(float, self.at(name, camera))
                if np.isfinite(u):
                    shade = CHOSEN_COLOUR if name == self.chosen else colour
                    mark: Mark = {"id": f"{name}|{camera}", "pane": pane, "u": u, "v": v, "label": name}
                    mark["colour"] = shade
                    yield {**mark, "to": to[pane].tolist()} if np.isfinite(to[pane]).all() else mark


def _rows(clicked: Clicked, point: str) -> list[Array]:
    return [clicked.at(point, camera) for camera in clicked.px]
