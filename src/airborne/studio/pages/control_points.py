"""Clicking surveyed points: their residuals as they are made, and where the others must lie."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from nicegui import ui

from airborne.calibration.from_points import Calibration, calibrate
from airborne.calibration.sources.court import court_lines
from airborne.cameras import Rig
from airborne.cameras.finding import Finding
from airborne.errors import AirborneError, count
from airborne.export.palette import SKY_BLUE
from airborne.studio.clicks import Clicked, count_clicked, read_survey
from airborne.studio.pages.layout import show_findings, two_columns
from airborne.studio.pages.point_list import PointList
from airborne.studio.pages.points_panel import CAMERA_COLOURS, CHOSEN_COLOUR, PREDICTED_COLOUR, PointsPanel
from airborne.studio.pages.slow_work import complain
from airborne.studio.pictures import ShownTrial
from airborne.studio.plan import plan_svg
from airborne.studio.project import FEWEST_POINTS
from airborne.studio.session import Session
from airborne.studio.stage import draw_cameras, draw_rays
from airborne.studio.view import Item, Mark
from airborne.types import Array, Mask

_CLICKED = SKY_BLUE
_LINE_POINTS = 60  # of a court's line, which a lens bends


class ControlPointsPanel(PointsPanel):
    """One window's work at a table of surveyed points; the clicks are in the file."""

    def __init__(self, session: Session, shown: ShownTrial, file: str, clicked: Clicked) -> None:
        """Begin with the first point of a table."""
        super().__init__(session, shown, clicked, clicked.names[0])
        self._file = file
        self.fits: dict[str, tuple[bytes, Calibration | str]] = {}  # camera -> of which clicks, and it

    @classmethod
    async def open(cls, session: Session, shown: ShownTrial, file: str) -> ControlPointsPanel:
        """Build the panel. Raises AirborneError where the table cannot be used."""
        panel = cls(session, shown, file, read_survey(session.project().file(file)))
        panel.build()
        await panel.solve()
        return panel

    @property
    def names(self) -> tuple[str, ...]:
        """The surveyed points."""
        return self.clicked.names

    @property
    def file(self) -> str:
        """The table of surveyed points."""
        return self._file

    async def reread(self) -> bool:
        """Show what the table holds now: another window, undo or another program may have changed it.

        Say whether it can still be used.
        """
        try:
            clicked = read_survey(self.session.project().file(self.file))
        except AirborneError:
            return False
        if self.text(clicked) != self.text(self.clicked):
            self.clicked = clicked
            await self.solve()
        return True

    def build(self) -> None:
        """Lay out the pictures and the list of points."""
        wide, side = two_columns()
        with wide:
            self.build_views(self.session.frame)
        with side:
            self.state = ui.refreshable(self._list_state)
            with ui.element("div").classes("card"):
                self.state()
                self.plan = ui.html(sanitize=False)
                self.place = ui.label().classes("soft small")
                with ui.element("div").classes("row-line tools"):
                    ui.button("Remove the click", on_click=self.remove).props("flat dense")
                    ui.button("See them in 3D", on_click=self.draw_scene).props("flat dense")
                self.scene = ui.element("div").style("height: 260px; display: flex")
                self.scene.set_visibility(False)
            self.list = PointList(self.shown.names, self.choose)

    def draw_scene(self) -> None:
        """Show the cameras that are solved, the points, and the rays by which each camera sees those clicked in it."""
        rigs = [fit.rig for _, fit in self.fits.values() if isinstance(fit, Calibration)]
        if not rigs or self.clicked.world is None:
            complain(f"no camera is solved yet; click {FEWEST_POINTS} points in one")
            return
        self.scene.clear()
        self.scene.set_visibility(True)
        cameras = tuple(camera for rig in rigs for camera in rig)
        with self.scene:
            scene = draw_cameras(Rig(cameras))
        for pane, camera in enumerate(cameras):
            is_clicked = np.isfinite(self.clicked.px[camera.name][:, 0])
            draw_rays(scene, camera, self.clicked.world[is_clicked], CAMERA_COLOURS[pane % len(CAMERA_COLOURS)])

    async def solve(self) -> None:
        """Solve the cameras whose clicks have changed, and show all again."""
        self.show()
        for camera in self.shown.names:
            px = self.clicked.px.get(camera)
            if px is None or count_clicked(self.clicked, camera) < FEWEST_POINTS:
                self.fits.pop(camera, None)
            elif self.fits.get(camera, (b"",))[0] != px.tobytes():
                fit = await self.latest.do("solving the camera", _fit, self.clicked, camera, self.shown.sizes)
                if fit is None:
                    return
                self.fits[camera] = px.tobytes(), fit
        self.show()

    def show(self) -> None:
        """Show marks and lists as they are now."""
        marks = [mark for pane, camera in enumerate(self.shown.names) for mark in self._marks(pane, camera)]
        lines = [item for pane, camera in enumerate(self.shown.names) for item in self._court(pane, camera)]
        self.view.show_over(sorted(marks, key=lambda mark: mark.get("colour") != CHOSEN_COLOUR), lines, self.selected)
        self.list.show(self.clicked.names, self.chosen, self._off_px, self._findings_of_points())
        self._show_plan()
        self.state.refresh()

    def _show_plan(self) -> None:
        """Mark the chosen point among all, from above."""
        assert self.clicked.world is not None
        row, points = self.clicked.names.index(self.chosen), self.clicked.world
        lines = court_lines(dict(zip(self.clicked.names, points, strict=True)))
        self.plan.set_content(plan_svg(points, row, lines))
        x, y, z = points[row]
        self.place.set_text(f"From above; the point is at x {x:.2f}, y {y:.2f}, z {z:.2f} m")

    def _marks(self, pane: int, camera: str) -> list[Mark]:
        marks: list[Mark] = []
        seen_at = self.predict(camera)
        for row, name in enumerate(self.clicked.names):
            u, v = map(float, self.clicked.at(name, camera))
            to = seen_at[row] if seen_at is not None else np.full(2, np.nan)
            if np.isfinite(u):
                colour = CHOSEN_COLOUR if name == self.chosen else _CLICKED
                mark: Mark = {"id": f"{name}|{camera}", "pane": pane, "u": u, "v": v, "label": name, "colour": colour}
                marks.append({**mark, "to": to.tolist()} if np.isfinite(to).all() else mark)
            elif np.isfinite(to).all():
                label = f"{name}?" if name == self.chosen else ""
                marks.append({"pane": pane, "u": to[0], "v": to[1], "label": label, "colour": PREDICTED_COLOUR})
        return marks

    def _court(self, pane: int, camera: str) -> Iterator[Item]:
        """Draw the lines of a court as a solved camera sees them, where its points have their names."""
        fit = self.fits.get(camera, (b"", ""))[1]
        assert self.clicked.world is not None
        for ends in court_lines(dict(zip(self.clicked.names, self.clicked.world, strict=True))):
            if isinstance(fit, Calibration):
                own = fit.rig[camera]
                px = own.px_from_world(ends[0] + np.linspace(0, 1, _LINE_POINTS)[:, None] * (ends[1] - ends[0]))
                inside = np.isfinite(px).all(axis=1) & (abs(px / own.size - 0.5) < 1).all(axis=1)
                yield {"pane": pane, "points": px[inside].round(1).tolist(), "colour": PREDICTED_COLOUR, "width": 1.0}

    def predict(self, camera: str) -> Array | None:
        """Return where a solved camera sees every point: (n, 2) [px]."""
        fit = self.fits.get(camera, (b"", ""))[1]
        assert self.clicked.world is not None
        return fit.rig[camera].px_from_world(self.clicked.world) if isinstance(fit, Calibration) else None

    def _off_px(self, name: str) -> tuple[Mask, Array]:
        """Say of a point whether it is clicked, and how far from where the camera sees it, in each camera [px]."""
        px = self.px(name, self.shown.names)
        row, none = self.clicked.names.index(name), np.full(2, np.nan)
        seen_at = [self.predict(camera) for camera in self.shown.names]
        to = np.stack([none if each is None else each[row] for each in seen_at])
        return np.isfinite(px[:, 0]), np.linalg.norm(to - px, axis=1)

    def _list_state(self) -> None:
        for camera in self.shown.names:
            fit, model = self.fits.get(camera, (b"", ""))[1], ""
            n = count_clicked(self.clicked, camera)
            if isinstance(fit, Calibration):
                own = fit.fits[0]
                left_out = f"{own.held_out_rms_px[own.model]:.2f} px where each is predicted from the others"
                text, model = f"{n} points; residual {own.rms_px:.2f} px RMS, {left_out}", own.model
                tone = "warn" if self._findings(camera) else "soft"
            elif fit:
                text, tone = fit, "bad"
            elif n >= FEWEST_POINTS:
                text, tone = f"{n} points, solving", "soft"
            else:
                text, tone = f"{count(n, 'point')} of the {FEWEST_POINTS} that are needed", "warn"
            with ui.element("div"):
                with ui.element("div").classes("row-line tools"):
                    ui.label(camera).classes("name")
                    ui.label(text).classes(f"{tone} small").tooltip(model)
                show_findings(each.sentence for each in self._findings(camera) if not each.points)

    def _findings(self, camera: str) -> tuple[Finding, ...]:
        fit = self.fits.get(camera, (b"", ""))[1]
        return fit.findings if isinstance(fit, Calibration) else ()

    def _findings_of_points(self) -> dict[str, str]:
        """Return what was found about points, in all cameras."""
        found: dict[str, str] = {}
        for each in (each for camera in self.shown.names for each in self._findings(camera)):
            for name in each.points:
                found[name] = f"{found[name]}; {each.sentence}" if name in found else each.sentence
        return found


def _fit(clicked: Clicked, camera: str, sizes: dict[str, tuple[int, int]]) -> Calibration | str:
    """Calibrate one camera; what is wrong with its points as a line."""
    try:
        return calibrate(clicked.control_points([camera]), {camera: sizes[camera]})
    except AirborneError as error:
        return str(error)
