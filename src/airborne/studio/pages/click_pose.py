"""The first pose of a person: landmarks clicked with the epipolar curves' help, the body fitted as they are made."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from nicegui import ui
from nicegui.events import KeyEventArguments

from airborne.body import BodyModel
from airborne.cameras import Rig
from airborne.cameras.epipolar import epipolar_curve
from airborne.studio.clicks import Clicked
from airborne.studio.pages.layout import Latest, complain, errors_shown
from airborne.studio.pages.point_list import PointList
from airborne.studio.pictures import ShownTrial
from airborne.studio.session import Session
from airborne.studio.starts import POSE_COLOUR, fit_clicks, points_name, read_points, write_start
from airborne.studio.view import CameraViews, Item, Mark
from airborne.types import Array, Mask

_CLICK_SD_PX = 1.0  # of a careful click, right and down: the band is two of these
_COLOURS = ("#56b4e9", "#e69f00", "#cc79a7", "#009e73", "#0072b2", "#d55e00")  # of cameras, in order
_NEEDED = ("hip_left", "hip_right", "shoulder_left", "shoulder_right")
_HELP = (
    "Go to the frame where tracking shall start. Choose a landmark and click it in two cameras or more: a click draws, "
    "in the others, the curve on which it lies, give or take two deviations. Both hips and both shoulders are needed."
)


@dataclass(eq=False)
class ClickPanel:
    """One window's clicks in the frame in view; each frame has a table of its own."""

    session: Session
    shown: ShownTrial
    rig: Rig
    model: BodyModel
    frame: int  # in view
    chosen: str = ""  # the landmark that the next click sets
    selected: str | None = None  # the mark that arrow keys move: "landmark|camera"
    clicked: Clicked = field(default_factory=lambda: Clicked((), None, {}))
    outline: list[dict[str, Any]] = field(default_factory=list)  # of the body fitted to the clicks
    says: str = ""
    latest: Latest = field(default_factory=Latest)

    @property
    def landmarks(self) -> list[str]:
        """The landmarks that can be clicked, those that are needed first."""
        names = [landmark.name for landmark in self.model.landmarks]
        needed = [name for name in _NEEDED if name in names]
        return [*needed, *(name for name in names if name not in needed)]

    async def build(self) -> None:
        """Lay out the pictures and the list of landmarks, and show the clicks that there are."""
        self.chosen = self.landmarks[0]
        ui.label(_HELP).classes("help")
        ui.keyboard(on_key=self.step)
        with ui.element("div").classes("split"):
            with ui.element("div").classes("wide"):
                self.view = CameraViews(
                    self.shown,
                    frame=self.frame,
                    on_frame=self.turn_to,
                    on_pick=self.pick,
                    on_move=self.move,
                    on_select=self.select,
                )
                self.view.start_picking()
            with ui.element("div").classes("side"):
                with ui.element("div").classes("card"):
                    self.note = ui.label().classes("small")
                    self.use = ui.button("Use this pose", on_click=self.write).props("unelevated")
                    ui.button("Take the chosen click back", on_click=self.remove).props("flat dense")
                self.list = PointList(self.shown.names, self.choose)
        self.show()
        await self.reread()

    async def turn_to(self, frame: int) -> None:
        """Show the clicks of another frame."""
        if frame != self.frame:
            self.frame = frame
            self.session.go(frame=frame)
            self.selected = None
            self.show()
            await self.reread()

    async def reread(self) -> None:
        """Show the clicks that the frame's table holds now: undo or another window may have changed it."""
        with errors_shown():
            clicked = read_points(self.session, self.frame)
            if clicked.text(self.shown.names) != self.clicked.text(self.shown.names):
                self.clicked = clicked
                await self.fit()

    async def pick(self, pane: int, u: float, v: float, near: str | None) -> None:
        """Set the chosen landmark in a camera; where it is set already, a click close to a mark chooses that."""
        camera = self.shown.names[pane]
        if near is not None and np.isfinite(self._at(self.chosen, camera)[0]):
            self.select(near)
            return
        self.selected = f"{self.chosen}|{camera}"
        await self.save(self.clicked.click(self.chosen, camera, (u, v)), f"{self.chosen} clicked in {camera}")

    async def move(self, mark: str, u: float, v: float) -> None:
        """Move a click."""
        name, camera = mark.rsplit("|", 1)
        self.chosen, self.selected = name, mark
        await self.save(self.clicked.click(name, camera, (u, v)), f"{name} moved in {camera}")

    async def remove(self) -> None:
        """Take the chosen click back."""
        if self.selected is None:
            complain("choose a click first: click on its mark")
            return
        name, camera = self.selected.rsplit("|", 1)
        self.selected = None
        await self.save(self.clicked.click(name, camera, (np.nan, np.nan)), f"{name} taken back in {camera}")

    def select(self, mark: str | None) -> None:
        """Choose a mark, or none."""
        self.selected = mark
        if mark is not None:
            self.chosen = mark.rsplit("|", 1)[0]
        self.show()

    async def choose(self, name: str) -> None:
        """Choose the landmark that the next clicks set."""
        self.chosen, self.selected = name, None
        self.show()

    async def step(self, event: KeyEventArguments) -> None:
        """Choose the next landmark, or the one before."""
        if event.action.keydown and event.key in ("n", "p"):
            row = self.landmarks.index(self.chosen) + (1 if event.key == "n" else -1)
            await self.choose(self.landmarks[row % len(self.landmarks)])

    async def save(self, clicked: Clicked, what: str) -> None:
        """Write the clicks beside the trial and fit the body to them."""
        with errors_shown():
            self.session.edit(points_name(self.frame), clicked.text(self.shown.names), what)
            self.clicked = clicked
        await self.fit()

    async def fit(self) -> None:
        """Fit the body to the clicks, or say what is missing; the clicks are shown at once."""
        self.outline, self.says = [], "fitting the body" if self.clicked.names else ""
        self.show()
        if not self.clicked.names:
            return
        solved = await self.latest.do(fit_clicks, self.model, self.rig, self.shown.names, self.clicked)
        if solved is not None:
            outline, self.says = solved
            self.outline = outline or []
            self.show()

    def write(self) -> None:
        """Write the clicks' frame and table into the trial."""
        with errors_shown():
            write_start(self.session, {"frame": self.frame, "points_px": points_name(self.frame)})
            ui.notify("the first pose is written into the trial", type="positive")

    def show(self) -> None:
        """Show marks, curves, outline and buttons as they are now."""
        marks = sorted(self._marks(), key=lambda mark: mark.get("colour") != POSE_COLOUR)
        items: list[Any] = [*self._curves(), *self.outline]
        self.view.show_over(marks, items, self.selected)
        self.note.set_text(self.says or f"No landmark is clicked in frame {self.frame} yet.")
        self.use.set_visibility(bool(self.outline))
        self.list.show(self.landmarks, self.chosen, self._off_px)

    def _curves(self) -> Iterator[Item]:
        """Yield the epipolar curves of the chosen landmark's clicks, with their bands."""
        for k, camera in enumerate(self.shown.names):
            px = self._at(self.chosen, camera)
            for pane, other in enumerate(self.shown.names):
                if other == camera or not np.isfinite(px).all():
                    continue
                curve, sd = epipolar_curve(self.rig[camera], px, self.rig[other], _CLICK_SD_PX)
                if len(curve) < 2:
                    continue
                tangent = np.gradient(curve, axis=0)
                across = np.stack([-tangent[:, 1], tangent[:, 0]], 1) / np.linalg.norm(tangent, axis=1, keepdims=True)
                wide = 2 * sd[:, None] * across
                band = np.concatenate([curve + wide, (curve - wide)[::-1]])
                colour = _COLOURS[k % len(_COLOURS)]
                yield {"pane": pane, "points": band.round(2).tolist(), "closed": True, "fill": colour + "33"}
                yield {"pane": pane, "points": curve.round(2).tolist(), "colour": colour, "width": 1}

    def _marks(self) -> Iterator[Mark]:
        for name in self.clicked.names:
            to = self._consensus_px(name)
            for pane, camera in enumerate(self.shown.names):
                u, v = map(float, self._at(name, camera))
                if np.isfinite(u):
                    colour = POSE_COLOUR if name == self.chosen else _COLOURS[pane % len(_COLOURS)]
                    mark: Mark = {
                        "id": f"{name}|{camera}",
                        "pane": pane,
                        "u": u,
                        "v": v,
                        "label": name,
                        "colour": colour,
                    }
                    yield {**mark, "to": to[pane].tolist()} if np.isfinite(to[pane]).all() else mark

    def _at(self, name: str, camera: str) -> Array:
        return self.clicked.at(name, camera) if name in self.clicked.names else np.full(2, np.nan)

    def _consensus_px(self, name: str) -> Array:
        """Return where the cameras see the point they agree on best: (cameras, 2) [px], NaN with fewer than two."""
        px = np.stack([self._at(name, camera) for camera in self.rig.names])
        point = self.rig.points_from_px(px)
        return np.stack([self.rig[camera].px_from_world(point) for camera in self.shown.names])

    def _off_px(self, name: str) -> tuple[Mask, Array]:
        """Say of a landmark whether it is clicked, and how far from where the cameras agree, in each camera [px]."""
        px = np.stack([self._at(name, camera) for camera in self.shown.names])
        return np.isfinite(px[:, 0]), np.linalg.norm(self._consensus_px(name) - px, axis=1)
