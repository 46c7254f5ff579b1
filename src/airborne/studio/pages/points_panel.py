"""What panels of clicked points share: the pictures, the point that the next click sets, the table that keeps it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from nicegui import ui
from nicegui.events import KeyEventArguments

from airborne.cameras import Rig
from airborne.cameras.epipolar import epipolar_curve
from airborne.export.palette import BLUE, GREEN, ORANGE, PURPLE, SKY_BLUE, VERMILION, YELLOW
from airborne.studio.clicks import Clicked
from airborne.studio.pages.slow_work import Latest, complain, show_errors
from airborne.studio.pictures import ShownTrial
from airborne.studio.session import Session
from airborne.studio.view import CameraViews, Drag, Item
from airborne.types import Array, Mask

CAMERA_COLOURS = (SKY_BLUE, ORANGE, PURPLE, GREEN, BLUE, VERMILION)  # in order
CHOSEN_COLOUR = YELLOW
PREDICTED_COLOUR = "#c8cdd3"  # where a point that is not clicked may be
CLICK_SD_PX = 1.0  # of a careful click, right and down: the band is two of these


class PointsPanel:
    """One window's clicks of named points in the cameras' pictures; what follows from them is each panel's own."""

    def __init__(self, session: Session, shown: ShownTrial, clicked: Clicked, chosen: str) -> None:
        """Begin with these clicks; the next sets the chosen point."""
        self.session, self.shown, self.clicked, self.chosen = session, shown, clicked, chosen
        self.selected: str | None = None  # the mark that arrow keys move: "point|camera"
        self.latest = Latest()

    @property
    def names(self) -> Sequence[str]:
        """The points that can be clicked, in order."""
        raise NotImplementedError

    @property
    def file(self) -> str:
        """The name of the table, in the trial's folder."""
        raise NotImplementedError

    def text(self, clicked: Clicked) -> str:
        """Return what the table shall hold."""
        return clicked.text(self.shown.names)

    async def solve(self) -> None:
        """Compute what follows from the clicks, and show all again."""
        raise NotImplementedError

    def show(self) -> None:
        """Show marks and lists as they are now."""
        raise NotImplementedError

    def build_views(self, frame: int, on_drag: Callable[[Drag], Any] | None = None) -> None:
        """Lay out the pictures; keys choose points."""
        ui.keyboard(on_key=self.press, ignore=["input", "select", "textarea"])
        self.view = CameraViews(
            self.shown,
            frame=frame,
            on_frame=self.turn_to,
            on_pick=self.pick,
            on_move=self.move,
            on_select=self.select,
            on_drag=on_drag,
        )
        self.view.start_picking()

    async def turn_to(self, frame: int) -> None:
        """Note the frame in view."""
        self.session.turn_to(frame)

    async def pick(self, pane: int, u: float, v: float, near: str | None) -> None:
        """Set the chosen point in a camera; where it is set already, a click close to a mark chooses that."""
        camera = self.shown.names[pane]
        if near is not None and np.isfinite(self.at(self.chosen, camera)[0]):
            await self.select(near)
            return
        self.selected = f"{self.chosen}|{camera}"
        await self.save(self.clicked.click(self.chosen, camera, (u, v)), f"{self.chosen} clicked in {camera}")

    async def move(self, mark: str, u: float, v: float) -> None:
        """Move a click."""
        name, camera = mark.rsplit("|", 1)
        self.chosen, self.selected = name, mark
        await self.save(self.clicked.click(name, camera, (u, v)), f"{name} moved in {camera}")

    async def remove(self) -> None:
        """Remove the chosen click."""
        if self.selected is None:
            complain("choose a click first: click on its mark")
            return
        name, camera = self.selected.rsplit("|", 1)
        self.selected = None
        await self.save(self.clicked.click(name, camera, (np.nan, np.nan)), f"{name} removed in {camera}")

    async def select(self, mark: str | None) -> None:
        """Choose a mark, or none."""
        self.selected = mark
        if mark is not None:
            self.chosen = mark.rsplit("|", 1)[0]
        self.show()

    async def choose(self, name: str) -> None:
        """Choose the point that the next clicks set."""
        self.chosen, self.selected = name, None
        self.show()

    async def press(self, event: KeyEventArguments) -> None:
        """Choose the next point by key, or the one before; or remove the chosen click."""
        if event.action.keydown and event.key in ("n", "p") and self.names:
            await self.choose(self.after(self.chosen, 1 if event.key == "n" else -1))
        elif event.action.keydown and event.key == "Delete" and self.selected is not None:
            await self.remove()

    def after(self, name: str, n: int) -> str:
        """Return the point n places after another; the first follows the last."""
        return self.names[(self.names.index(name) + n) % len(self.names)]

    async def save(self, clicked: Clicked, what: str) -> None:
        """Write the table, and what follows from it."""
        with show_errors():
            self.session.edit(self.file, self.text(clicked), what)
            self.clicked = clicked
        await self.solve()

    def at(self, name: str, camera: str) -> Array:
        """Return where a point is clicked in a camera: (2,) [px], NaN where it is not."""
        return self.clicked.at(name, camera) if name in self.clicked.names else np.full(2, np.nan)

    def px(self, name: str, cameras: Sequence[str]) -> Array:
        """Return where a point is clicked: (cameras, 2) [px], NaN where it is not."""
        return np.stack([self.at(name, camera) for camera in cameras])

    def off_px(self, name: str, rig: Rig) -> tuple[Mask, Array]:
        """Say of a point whether it is clicked, and how far from where the cameras agree, in each camera [px]."""
        px = self.px(name, self.shown.names)
        return np.isfinite(px[:, 0]), np.linalg.norm(self.consensus_px(name, rig) - px, axis=1)

    def consensus_px(self, name: str, rig: Rig) -> Array:
        """Return where the cameras see the point they agree on best: (cameras, 2) [px], NaN with fewer than two."""
        point = rig.points_from_px(self.px(name, rig.names))
        return np.stack([rig[camera].px_from_world(point) for camera in self.shown.names])

    def epipolar_items(self, name: str, rig: Rig) -> Iterator[Item]:
        """Yield the epipolar curves of a point's clicks in the other cameras, with their bands."""
        for k, camera in enumerate(self.shown.names):
            px = self.at(name, camera)
            for pane, other in enumerate(self.shown.names):
                if other == camera or not np.isfinite(px).all():
                    continue
                curve, sd = epipolar_curve(rig[camera], px, rig[other], CLICK_SD_PX)
                if len(curve) < 2:
                    continue
                tangent = np.gradient(curve, axis=0)
                across = np.stack([-tangent[:, 1], tangent[:, 0]], 1) / np.linalg.norm(tangent, axis=1, keepdims=True)
                wide = 2 * sd[:, None] * across
                band = np.concatenate([curve + wide, (curve - wide)[::-1]])
                colour = CAMERA_COLOURS[k % len(CAMERA_COLOURS)]
                yield {"pane": pane, "points": band.round(2).tolist(), "closed": True, "fill": colour + "33"}
                yield {"pane": pane, "points": curve.round(2).tolist(), "colour": colour, "width": 1}
