"""A ruler: two points, each clicked in two pictures or more, are so far apart."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from nicegui import ui

from airborne.cameras import Rig
from airborne.studio.clicks import Clicked, measure_between, read_clicked
from airborne.studio.pages.layout import name_missing_steps, page_frame, two_columns
from airborne.studio.pages.point_list import PointList
from airborne.studio.pages.points_panel import CAMERA_COLOURS, CHOSEN_COLOUR, CLICK_SD_PX, PointsPanel
from airborne.studio.pages.slow_work import show_errors, work
from airborne.studio.pictures import ShownTrial
from airborne.studio.session import Session
from airborne.studio.view import Mark
from airborne.types import Array

_FILE, _ENDS = "ruler.csv", ("from", "to")
_HELP = (
    "Click one end in two cameras or more, press N, and click the other end. "
    "The standard deviation counts clicks that are 1 px off; errors of the calibration come on top."
)


async def ruler_page(session: Session) -> None:
    """Let the user measure a distance in the pictures."""
    async with page_frame(session, "Body", "How long is it?", _HELP, task="ruler") as changed:
        if name_missing_steps(session, changed, "Videos", "Cameras"):
            return
        shown = await work("indexing the videos", session.shown)
        rig = await work("calibrating the cameras", session.rig)
        if shown is None or rig is None:
            return
        panel = RulerPanel(session, shown, rig)
        changed.append(panel.reread)
        await panel.build()


class RulerPanel(PointsPanel):
    """One window's ruler; its clicks are in a table of the folder."""

    def __init__(self, session: Session, shown: ShownTrial, rig: Rig) -> None:
        """Begin with the first end."""
        super().__init__(session, shown, Clicked((), None, {}), _ENDS[0])
        self.rig = rig

    @property
    def names(self) -> tuple[str, ...]:
        """The two ends."""
        return _ENDS

    @property
    def file(self) -> str:
        """The table of the clicks."""
        return _FILE

    async def build(self) -> None:
        """Lay out the pictures, the ends and their distance."""
        wide, side = two_columns()
        with wide:
            self.build_views(self.session.frame)
        with side:
            with ui.element("div").classes("card"):
                self.says = ui.label().classes("name")
                ui.button("Remove the chosen click", on_click=self.remove).props("flat dense")
            self.list = PointList(self.shown.names, self.choose)
        await self.reread()

    async def reread(self) -> None:
        """Show the clicks that the table holds now."""
        with show_errors():
            path = self.session.file(_FILE)
            self.clicked = read_clicked(path) if path.is_file() else Clicked((), None, {})
            self.show()

    async def solve(self) -> None:
        """Show the distance."""
        self.show()

    def show(self) -> None:
        """Show marks, curves, the ruler and what it says."""
        places = [self.rig.points_from_px(self.px(name, self.rig.names)) for name in _ENDS]
        items = [*self.epipolar_items(self.chosen, self.rig), *self._line(np.array(places))]
        self.view.show_over(list(self._marks()), items, self.selected)
        self.list.show(_ENDS, self.chosen, partial(self.off_px, rig=self.rig))
        if not np.isfinite(places).all():
            self.says.set_text("Click each end in at least two cameras.")
            return
        clicks = [self.px(name, self.rig.names) for name in _ENDS]
        far_m, sd_m = measure_between(self.rig, *clicks, sd_px=CLICK_SD_PX)
        self.says.set_text(f"{far_m:.3f} m, sd {1e3 * sd_m:.0f} mm")

    def _line(self, places: Array) -> Iterator[Any]:
        if np.isfinite(places).all():
            along = places[0] + np.linspace(0, 1, 20)[:, None] * (places[1] - places[0])  # bent by the lens
            for pane, camera in enumerate(self.shown.names):
                line = self.rig[camera].px_from_world(along)
                if np.isfinite(line).all():
                    yield {"pane": pane, "points": line.round(1).tolist(), "colour": CHOSEN_COLOUR, "width": 2}

    def _marks(self) -> Iterator[Mark]:
        for name in self.clicked.names:
            for pane, camera in enumerate(self.shown.names):
                u, v = map(float, self.at(name, camera))
                if np.isfinite(u):
                    colour = CHOSEN_COLOUR if name == self.chosen else CAMERA_COLOURS[pane % len(CAMERA_COLOURS)]
                    yield {
                        "id": f"{name}|{camera}", "pane": pane, "u": u, "v": v, "label": name, "colour": colour,
                    }  # fmt: skip
