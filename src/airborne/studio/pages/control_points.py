"""Clicking surveyed points: their residuals as they are made, and where the others must lie."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from nicegui import ui
from nicegui.events import KeyEventArguments

from airborne.calibration.from_points import Calibration, calibrate
from airborne.errors import AirborneError
from airborne.studio.clicks import Clicked, count_clicked, read_clicked
from airborne.studio.pages.layout import Latest, complain, errors_shown
from airborne.studio.pages.point_list import PointList
from airborne.studio.pictures import ShownTrial
from airborne.studio.project import FEWEST_POINTS
from airborne.studio.session import Session
from airborne.studio.view import CameraViews, Mark
from airborne.types import Array, Mask

_CLICKED, _CHOSEN, _PREDICTED = "#56b4e9", "#f0e442", "#c8cdd3"


@dataclass(eq=False)
class ControlPointsPanel:
    """One window's work at a table of surveyed points; the clicks are in the file."""

    session: Session
    shown: ShownTrial
    file: str
    clicked: Clicked
    chosen: str  # the point that the next click sets
    selected: str | None = None  # the mark that arrow keys move: "point|camera"
    fits: dict[str, tuple[bytes, Calibration | str]] = field(default_factory=dict)  # camera -> of which clicks, and it
    latest: Latest = field(default_factory=Latest)

    @classmethod
    async def open(cls, session: Session, shown: ShownTrial, file: str) -> ControlPointsPanel | None:
        """Build the panel; complains, and returns None, where the table cannot be read."""
        try:
            clicked = read_clicked(session.project().file(file))
            if clicked.world is None:
                raise AirborneError(f"{file} has no columns x_m, y_m, z_m; expected surveyed points")
        except AirborneError as error:
            complain(error)
            return None
        panel = cls(session, shown, file, clicked, clicked.names[0])
        panel.build()
        await panel.update()
        return panel

    async def reread(self) -> None:
        """Show what the table holds now: another window, undo or another program may have changed it."""
        with errors_shown():
            clicked = read_clicked(self.session.project().file(self.file))
            if clicked.text(self.shown.names) != self.clicked.text(self.shown.names):
                self.clicked = clicked
                await self.update()

    def build(self) -> None:
        """Lay out the pictures and the list of points."""
        ui.keyboard(on_key=self.step)
        with ui.element("div").classes("split"):
            with ui.element("div").classes("wide"):
                self.view = CameraViews(
                    self.shown,
                    frame=self.session.frame,
                    on_frame=self.turn_to,
                    on_pick=self.pick,
                    on_move=self.move,
                    on_select=self.select,
                )
                self.view.start_picking()
            with ui.element("div").classes("side"):
                self.state = ui.refreshable(self._list_state)
                with ui.element("div").classes("card"):
                    self.state()
                    ui.button("Take the chosen click back", on_click=self.remove).props("flat dense")
                self.list = PointList(self.shown.names, self.choose)

    def turn_to(self, frame: int) -> None:
        """Note the frame in view."""
        self.session.go(frame=frame)

    async def pick(self, pane: int, u: float, v: float, near: str | None) -> None:
        """Set the chosen point in a camera; where it is set already, a click close to a mark chooses that."""
        camera = self.shown.names[pane]
        if near is not None and np.isfinite(self.clicked.at(self.chosen, camera)[0]):
            await self.select(near)
            return
        self.save(self.clicked.click(self.chosen, camera, (u, v)), f"{self.chosen} clicked in {camera}")
        self.selected = f"{self.chosen}|{camera}"
        await self.update()

    async def move(self, mark: str, u: float, v: float) -> None:
        """Move a click."""
        name, camera = mark.rsplit("|", 1)
        self.save(self.clicked.click(name, camera, (u, v)), f"{name} moved in {camera}")
        self.chosen, self.selected = name, mark
        await self.update()

    async def select(self, mark: str | None) -> None:
        """Choose a mark, or none."""
        self.selected = mark
        if mark is not None:
            self.chosen = mark.rsplit("|", 1)[0]
        await self.update()

    async def choose(self, name: str) -> None:
        """Choose the point that the next clicks set."""
        self.chosen, self.selected = name, None
        await self.update()

    async def step(self, event: KeyEventArguments) -> None:
        """Choose the next point, or the one before."""
        if event.action.keydown and event.key in ("n", "p"):
            row = self.clicked.names.index(self.chosen) + (1 if event.key == "n" else -1)
            await self.choose(self.clicked.names[row % len(self.clicked.names)])

    async def remove(self) -> None:
        """Take the chosen click back."""
        if self.selected is None:
            complain("choose a click first: click on its mark")
            return
        name, camera = self.selected.rsplit("|", 1)
        self.save(self.clicked.click(name, camera, (np.nan, np.nan)), f"{name} taken back in {camera}")
        self.selected = None
        await self.update()

    def save(self, clicked: Clicked, what: str) -> None:
        """Write the table."""
        with errors_shown():
            self.session.edit(self.file, clicked.text(self.shown.names), what)
            self.clicked = clicked

    async def update(self) -> None:
        """Solve the cameras whose clicks have changed, and show all again."""
        self.show()
        for camera in self.shown.names:
            px = self.clicked.px.get(camera)
            if px is None or count_clicked(self.clicked, camera) < FEWEST_POINTS:
                self.fits.pop(camera, None)
            elif self.fits.get(camera, (b"",))[0] != px.tobytes():
                fit = await self.latest.do(_fit, self.clicked, camera, self.shown.sizes)
                if fit is None:
                    return
                self.fits[camera] = px.tobytes(), fit
        self.show()

    def show(self) -> None:
        """Show marks and lists as they are now."""
        marks = [mark for pane, camera in enumerate(self.shown.names) for mark in self._marks(pane, camera)]
        self.view.show_over(sorted(marks, key=lambda mark: mark.get("colour") != _CHOSEN), (), self.selected)
        self.list.show(self.clicked.names, self.chosen, self._off_px)
        self.state.refresh()

    def _marks(self, pane: int, camera: str) -> list[Mark]:
        marks: list[Mark] = []
        seen_at = self.predict(camera)
        for row, name in enumerate(self.clicked.names):
            u, v = map(float, self.clicked.at(name, camera))
            to = seen_at[row] if seen_at is not None else np.full(2, np.nan)
            if np.isfinite(u):
                colour = _CHOSEN if name == self.chosen else _CLICKED
                mark: Mark = {"id": f"{name}|{camera}", "pane": pane, "u": u, "v": v, "label": name, "colour": colour}
                marks.append({**mark, "to": to.tolist()} if np.isfinite(to).all() else mark)
            elif np.isfinite(to).all():
                label = f"{name}?" if name == self.chosen else ""
                marks.append({"pane": pane, "u": to[0], "v": to[1], "label": label, "colour": _PREDICTED})
        return marks

    def predict(self, camera: str) -> Array | None:
        """Return where a solved camera sees every point: (n, 2) [px]."""
        fit = self.fits.get(camera, (b"", ""))[1]
        assert self.clicked.world is not None
        return fit.rig[camera].px_from_world(self.clicked.world) if isinstance(fit, Calibration) else None

    def _off_px(self, name: str) -> tuple[Mask, Array]:
        """Say of a point whether it is clicked, and how far from where the camera sees it, in each camera [px]."""
        px = np.stack([self.clicked.at(name, camera) for camera in self.shown.names])
        row, none = self.clicked.names.index(name), np.full(2, np.nan)
        seen_at = [self.predict(camera) for camera in self.shown.names]
        to = np.stack([none if each is None else each[row] for each in seen_at])
        return np.isfinite(px[:, 0]), np.linalg.norm(to - px, axis=1)

    def _list_state(self) -> None:
        for camera in self.shown.names:
            fit = self.fits.get(camera, (b"", ""))[1]
            n = count_clicked(self.clicked, camera)
            if isinstance(fit, Calibration):
                text, tone = f"{n} points, residual {fit.fits[0].rms_px:.2f} px RMS ({fit.fits[0].model})", "soft"
            elif fit:
                text, tone = fit, "bad"
            elif n >= FEWEST_POINTS:
                text, tone = f"{n} points, solving", "soft"
            else:
                text, tone = f"{n} of {FEWEST_POINTS} points at least", "warn"
            with ui.element("div"):
                ui.label(camera).classes("name")
                ui.label(text).classes(f"{tone} small")


def _fit(clicked: Clicked, camera: str, sizes: dict[str, tuple[int, int]]) -> Calibration | str:
    """Calibrate one camera; what is wrong with its points as a line."""
    try:
        return calibrate(clicked.control_points([camera]), {camera: sizes[camera]})
    except AirborneError as error:
        return str(error)
