"""The step Digitise: named points clicked frame by frame, by one person, to compare a run or other people with."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from nicegui import ui

from airborne.body import BodyModel
from airborne.cameras import Rig
from airborne.errors import AirborneError, count
from airborne.evaluation import DigitisedPoints, format_clicked_frames
from airborne.studio.clicks import Clicked
from airborne.studio.digitising import (
    Repetition,
    add_points,
    clicks_of_frame,
    count_clicks,
    default_points,
    list_repetitions,
    parse_repetition,
    predict_click,
    read_digitising,
    record_text,
    set_frame,
    without_point,
)
from airborne.studio.pages.compare_clicks import ClickComparison
from airborne.studio.pages.layout import name_missing_steps, page_frame, two_columns
from airborne.studio.pages.point_list import PointList
from airborne.studio.pages.points_panel import CAMERA_COLOURS, CHOSEN_COLOUR, PREDICTED_COLOUR, PointsPanel
from airborne.studio.pages.slow_work import complain, in_thread, show_errors, work
from airborne.studio.pictures import ShownTrial
from airborne.studio.session import Session
from airborne.studio.view import Item, Mark
from airborne.types import Array, Mask

_HELP = (
    "Click the chosen point in each camera; C shows one camera alone. Grey marks show where to expect the point, "
    "from your own clicks before and after. For an unbiased comparison with a run, leave the epipolar help off."
)
_EMPTY = "There are no points to click yet. Name one below, such as one end of the body, and press Add."
_DRAFT = "points"  # their name among the drafts
_AFTER = {"point": "next point", "frame": "next frame", "stay": "nothing"}


async def digitise_page(session: Session) -> None:
    """Let one person digitise points, and compare."""
    async with page_frame(session, "Digitise", "Where do you see it?", _HELP) as changed:
        if name_missing_steps(session, changed, "Videos"):
            return
        shown = await work("indexing the videos", session.shown)
        if shown is None:
            return
        try:
            model = await in_thread(session.project().model, says="reading the body")
        except AirborneError:  # points can be digitised before there is a body
            model = None
        with show_errors():
            panel = DigitisePanel(session, shown, model)
            changed.append(panel.reread)
            panel.build()


class DigitisePanel(PointsPanel):
    """One window's digitising; each person's repetition has a table of its own."""

    def __init__(self, session: Session, shown: ShownTrial, model: BodyModel | None) -> None:
        """Begin with the clicks that lie in the folder, or with none."""
        super().__init__(session, shown, Clicked((), None, {}), "")
        known = list_repetitions(session.folder)
        self.who = known[-1] if known else Repetition("A", 1)
        self.model, self.frame = model, session.frame
        self.extra = self._kept()  # points that were named here
        self.rig: Rig | None = None  # for the epipolar help
        self.then = "point"
        self.table = self._read()
        self.chosen = self.names[0] if self.names else ""
        self.clicked = self._of_frame()

    @property
    def names(self) -> tuple[str, ...]:
        """The points of the table, those of the body, and those named here."""
        return self.table.points

    @property
    def file(self) -> str:
        """The table of the person and repetition."""
        return self.who.file

    def text(self, clicked: Clicked) -> str:
        """Return the whole table, with the clicks of the frame in view."""
        cameras = self.shown.names
        return format_clicked_frames(set_frame(self.table, self.frame, clicked, cameras), cameras)

    def build(self) -> None:
        """Lay out the pictures, who digitises, the points, and what can be compared."""
        wide, side = two_columns()
        with wide:
            self.build_views(self.frame)
        with side:
            with ui.element("div").classes("card"):
                self._build_who()
            self.list = PointList(self.shown.names, self.choose, empty=_EMPTY)
            with ui.element("div").classes("card"):
                self._build_points()
                ClickComparison(self.session, self.model, self.shown.names, lambda: (self.who, self.table))
        self.show()

    def _build_who(self) -> None:
        with ui.element("div").classes("row-line"):
            operator = ui.input("operator", value=self.who.operator).props("dense outlined").style("width: 90px")
            number = ui.number("repetition", value=self.who.number, min=1, max=99, format="%d")
            number.props("dense outlined").style("width: 85px")
            change = ui.button("Change", on_click=lambda: self.change_who(operator.value or "", number.value))
            change.props("flat dense")
        self.note = ui.label().classes("small")
        with ui.element("div").classes("row-line tools"):
            then = ui.select(_AFTER, label="after a click").bind_value(self, "then")
            then.props("outlined dense options-dense").style("width: 138px")
            help_on = ui.switch("epipolar help", value=False, on_change=lambda event: self.set_help(bool(event.value)))
            help_on.props("dense")

    def _build_points(self) -> None:
        with ui.element("div").classes("row-line tools"):
            name = ui.input("new point").props("dense outlined").style("width: 114px")
            ui.button("Add", on_click=lambda: self.add(name)).props("flat dense")
            ui.button("Drop", on_click=self.drop).props("flat dense").tooltip("the chosen point, one of your own")
            ui.button("Remove", on_click=self.remove).props("flat dense").tooltip("the chosen click")

    async def turn_to(self, frame: int) -> None:
        """Show the clicks of another frame."""
        if frame != self.frame:
            self.frame = frame
            self.session.go(frame=frame)
            self.selected = None
            self.clicked = self._of_frame()
            self.show()

    async def reread(self) -> None:
        """Show the clicks that the table holds now: undo or another window may have changed it."""
        with show_errors():
            extra, self.extra = self.extra, self._kept()
            table = self._read()
            cameras = self.shown.names
            if self.chosen not in table.points:
                self.chosen, self.selected = next(iter(table.points), ""), None
            before, now = (format_clicked_frames(each, cameras) for each in (self.table, table))
            if extra != self.extra or before != now:
                self.table, self.clicked = table, clicks_of_frame(table, self.frame, cameras)
                self.show()

    async def pick(self, pane: int, u: float, v: float, near: str | None) -> None:
        """Set the chosen point in a camera, and go on as the user wants to."""
        if not self.chosen:
            complain("name a point first")
            return
        before = self.clicked
        await super().pick(pane, u, v, near)
        if self.clicked is before or self.then == "stay":
            return
        if self.then == "frame":
            self.view.go(self.frame + 1)
        elif all(np.isfinite(self.px(self.chosen, self.shown.names)[:, 0])):
            await self.choose(self.after(self.chosen, 1))

    async def solve(self) -> None:
        """Read back what was written."""
        self.table = self._read()
        self.show()

    async def change_who(self, operator: str, number: float | None) -> None:
        """Digitise as somebody else, or once more."""
        with show_errors():
            self.who = parse_repetition(operator, number)
            self.table, self.selected = self._read(), None
            self.clicked = self._of_frame()
            self.show()

    async def set_help(self, is_on: bool) -> None:
        """Show the epipolar curves of the chosen point's clicks, or no more; that it was on is noted for good."""
        with show_errors():
            self.rig = await in_thread(self.session.rig, says="calibrating the cameras") if is_on else None
            if is_on:
                self.session.edit(self.who.record, record_text(self.who), "epipolar help used")
        self.show()

    async def add(self, field: ui.input) -> None:
        """Add a point of the user's own, named in a field."""
        name = (field.value or "").strip()
        if not name.replace("_", "").replace("-", "").isalnum() or len(name) > 40:
            complain("a point's name is 1 to 40 letters, digits, hyphens and underscores")
            return
        if name in self.names:
            complain(f"{name} is among the points already; it is chosen now")
        else:
            with show_errors():
                self.session.keep_draft(_DRAFT, [*self.extra, name], f"{name} added to the points")
                self.extra = self._kept()
        field.value = ""
        self.table = add_points(self.table, [name])
        self.clicked = self._of_frame()
        await self.choose(name)

    async def drop(self) -> None:
        """Take the chosen point off the list, unless it is the body's or has clicks."""
        name, cameras = self.chosen, self.shown.names
        if not name or name in default_points(self.model):
            complain(f"{name} is a point of the body, which stays" if name else "choose a point first")
        elif n_clicks := count_clicks(self.table, name):
            complain(f"{name} has {count(n_clicks, 'click')}; remove these first, then the point")
        elif len(self.names) == 1 and len(self.table.index):
            complain(f"{name} is the only point of {self.file}; add another first")
        else:
            with show_errors():
                left = without_point(self.table, name)
                if len(left.index):
                    self.session.edit(self.file, format_clicked_frames(left, cameras), f"{name} dropped")
                extra = [each for each in self.extra if each != name]
                self.session.keep_draft(_DRAFT, extra, f"{name} dropped from the points")
            await self.reread()

    def show(self) -> None:
        """Show marks, curves and lists as they are now."""
        items: list[Item] = [] if self.rig is None else list(self.epipolar_items(self.chosen, self.rig))
        marks = sorted(self._marks(), key=lambda mark: mark.get("colour") != CHOSEN_COLOUR)
        self.view.show_over(marks, items, self.selected)
        self.list.show(self.names, self.chosen, self._off_px)
        n_frames = int(np.isfinite(self.table.px).any(axis=(1, 2, 3)).sum())
        n_clicks = sum(count_clicks(self.table, name) for name in self.names)
        self.note.set_text(f"frame {self.frame}; {count(n_clicks, 'click')} in {count(n_frames, 'frame')}: {self.file}")

    def _marks(self) -> Iterator[Mark]:
        for name in self.names:
            for pane, camera in enumerate(self.shown.names):
                u, v = map(float, self.at(name, camera))
                colour = CHOSEN_COLOUR if name == self.chosen else CAMERA_COLOURS[pane % len(CAMERA_COLOURS)]
                if np.isfinite(u):
                    yield {"id": f"{name}|{camera}", "pane": pane, "u": u, "v": v, "label": name, "colour": colour}
                    continue
                u, v = map(float, predict_click(self.table, self.frame, name, pane))
                if np.isfinite(u):
                    label = f"{name}?" if name == self.chosen else ""
                    yield {"pane": pane, "u": u, "v": v, "label": label, "colour": PREDICTED_COLOUR}

    def _off_px(self, name: str) -> tuple[Mask, Array]:
        """Say in which cameras a point is clicked; with the help, how far from where the cameras agree [px]."""
        if self.rig is not None:
            return self.off_px(name, self.rig)
        px = self.px(name, self.shown.names)
        return np.isfinite(px[:, 0]), np.full(len(px), np.nan)

    def _kept(self) -> list[str]:
        draft = self.session.draft(_DRAFT)
        return [name for name in draft if isinstance(name, str)] if isinstance(draft, list) else []

    def _read(self) -> DigitisedPoints:
        points = (*default_points(self.model), *self.extra)
        return read_digitising(self.session.file(self.file), self.shown.names, points)

    def _of_frame(self) -> Clicked:
        return clicks_of_frame(self.table, self.frame, self.shown.names)
