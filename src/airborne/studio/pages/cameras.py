"""The step Cameras: a calibration file, or surveyed points clicked in every camera's picture."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable, Hashable, Mapping, Sequence
from typing import Any

from nicegui import ui

from airborne.calibration.sources.court import Net
from airborne.cameras import Camera, Rig
from airborne.errors import AirborneError, count
from airborne.studio.calibrating import NETS, court_text, read_deviations, read_findings
from airborne.studio.calibrations import ENDINGS, Calibrations, list_calibrations
from airborne.studio.clicks import Surveys, list_surveys
from airborne.studio.folder import file_stamp, files_inside, outer_files
from airborne.studio.pages.calibrate import CalibratePanel
from airborne.studio.pages.camera_names import CameraNames, use_calibration
from airborne.studio.pages.control_points import ControlPointsPanel
from airborne.studio.pages.layout import name_missing_steps, name_outer_links, page_frame, show_findings, two_columns
from airborne.studio.pages.slow_work import in_thread, show_errors, work
from airborne.studio.pictures import ShownTrial
from airborne.studio.session import Session
from airborne.studio.stage import draw_cameras

_HELP = (
    "To use a calibration from another program, put its file beside the videos. Or click surveyed "
    "points, or those of a court: at least six in each camera, spread over the space in which the body moves; "
    "residuals are drawn ten times as long. Or calibrate with a board or a wand."
)
_NOTHING = (
    "The folder holds neither a calibration of these cameras nor a table of surveyed points (point,x_m,y_m,z_m). "
    "Put one there; or click the points of a court, or calibrate with a board or a wand."
)


async def cameras_page(session: Session) -> None:
    """Let the user choose a calibration file, or a survey and click its points."""
    async with page_frame(session, "Cameras", "Where are the cameras?", _HELP) as changed:
        if name_missing_steps(session, changed, "Videos"):
            return
        shown = await work("indexing the videos", session.shown)
        if shown is None:
            return
        page = _Page(session, shown)
        await page.build()
        changed.append(page.reread)


class _Page:
    """One window's choice of a calibration and what it shows, which follow the trial whoever changes it."""

    def __init__(self, session: Session, shown: ShownTrial) -> None:
        self.session, self.shown = session, shown
        self.panel: ControlPointsPanel | None = None
        self.stamps: Hashable = None  # of the files that were looked at
        self.built: Hashable = None  # what the page was built of
        self._one_at_a_time = asyncio.Lock()

    async def build(self) -> None:
        """Lay out what can be chosen, and what the trial has."""
        name_outer_links(outer_files(self.session.folder, *ENDINGS))
        self.notes = ui.element("div").style("display: contents")
        with ui.element("div").classes("row-line"):
            self.chooser = ui.element("div").style("display: contents")
            CalibratePanel(self.session, self.shown).build()
        self.area = ui.element("div").style("display: contents")
        await self.reread()

    async def reread(self) -> None:
        """Show what the trial and its folder hold now: undo, another window or another program may have changed it."""
        async with self._one_at_a_time:
            with self.area:  # stays, while the choice that called this may go
                await self._reread()

    async def _reread(self) -> None:
        session = self.session
        if self.panel is not None and not await self.panel.reread():
            self.panel = None
        own = None if self.panel is None else self.panel.file  # its clicks make no other calibration
        paths = files_inside(session.folder, *ENDINGS)
        stamps = tuple(file_stamp(path) for path in paths if path.name != own)
        if stamps == self.stamps:
            return
        self.stamps = stamps
        project = session.project()
        wanted, table = {each.calibrated_as or each.name for each in project.cameras}, project.table("calibration")
        surveys = await in_thread(list_surveys, session.folder, says="reading the surveys")
        files = await in_thread(list_calibrations, session.folder, wanted, says="reading the calibrations")
        chosen = file_stamp(session.folder / str(table["file"])) if "file" in table else None
        built = repr((table, files, surveys, chosen))
        if built != self.built:
            self.built = built
            self._show_choices(table, files, surveys)
            await self._show_calibration(table, surveys)

    def _show_choices(self, table: dict[str, Any], files: Calibrations, surveys: Surveys) -> None:
        self.notes.clear()
        with self.notes:
            for name, reason in surveys.refused.items():
                ui.label(f"{name} is refused as surveyed points: {reason}").classes("warn")
            if not (files.usable or files.renamed or surveys.usable or surveys.refused or table):
                ui.label(_NOTHING).classes("warn")
        self.chooser.clear()
        names_form = CameraNames(self.session, self.reread)
        with self.chooser:
            _chooser(self.session, files, surveys.usable, names_form, on_use=self.reread)
        self.area.clear()
        names_form.build()
        _show_refused(self.session, files)

    async def _show_calibration(self, table: dict[str, Any], surveys: Surveys) -> None:
        self.panel = None
        points, file = str(table.get("control_points", "")), str(table.get("file", ""))
        try:
            if points and points not in surveys.refused:  # else the page says so already
                self.panel = await ControlPointsPanel.open(self.session, self.shown, points)
            elif file and not points:
                rig = await in_thread(self.session.rig, says="reading the calibration")
                _show_rig(rig, _findings_of(self.session, file), _deviations_of(self.session, file))
        except AirborneError as error:
            ui.label(str(error)).classes("bad")


def _chooser(
    session: Session,
    files: Calibrations,
    surveys: Sequence[str],
    names_form: CameraNames,
    *,
    on_use: Callable[[], Awaitable[None]],
) -> None:
    table = session.project().table("calibration")

    async def use(key: str, name: str) -> None:
        if session.project().table("calibration").get(key) == name:
            return
        if key == "file" and name in files.renamed:
            names_form.show(name, files.renamed[name])
            return
        calibrated_as = {each.name: each.calibrated_as for each in session.project().cameras} if key == "file" else {}
        use_calibration(session, {"file": None, "control_points": None, key: name}, calibrated_as)
        await on_use()

    async def use_court(net: Net) -> None:
        with show_errors():
            if not (session.folder / _court_file(net)).exists():
                session.edit(_court_file(net), court_text(net), "points of a court")
            await use("control_points", _court_file(net))

    both = [*files.usable, *files.renamed]
    for key, names, label in (("file", both, "calibration file"), ("control_points", list(surveys), "surveyed points")):
        if names:
            present = table.get(key)
            ui.select(
                names,
                label=label,
                value=present if present in names else None,
                on_change=lambda event, key=key: use(key, event.value),
            ).props("outlined dense options-dense").style("min-width: 220px")
    present = next((net for net in NETS if table.get("control_points") == _court_file(net)), None)
    court = ui.select(NETS, label="volleyball court", value=present, on_change=lambda event: use_court(event.value))
    court.props("outlined dense options-dense").style("min-width: 200px")


def _court_file(net: Net) -> str:
    return f"court_{net}.csv"


def _show_refused(session: Session, files: Calibrations) -> None:
    """Say which files hold no calibration of these cameras, and why."""
    refused = {name: reason for name, reason in files.refused.items() if name != session.path.name}
    if refused:
        title = f"{count(len(refused), 'other file')}: no calibration of these cameras"
        with ui.expansion(title, value=not (files.usable or files.renamed)).props("dense"):
            for name, reason in refused.items():
                ui.label(reason if name in reason else f"{name}: {reason}").classes("soft small")


def _findings_of(session: Session, file: str) -> dict[str, list[str]]:
    """Return what the diagnosis of a calibration found, by the trial's own cameras; "" holds what concerns all."""
    found: dict[str, list[str]] = {}
    with show_errors():
        found = read_findings(session.folder, file)
    own = {each.name: found.get(each.calibrated_as or each.name, []) for each in session.project().cameras}
    return {"": found.get("", []), **own}


def _deviations_of(session: Session, file: str) -> dict[str, dict[str, float]]:
    """Return the standard deviations that a calibration's report knows, by the trial's own cameras."""
    known: dict[str, dict[str, float]] = {}
    with show_errors():
        known = read_deviations(session.folder, file)
    return {each.name: known.get(each.calibrated_as or each.name, {}) for each in session.project().cameras}


def _describe(camera: Camera, sd: Mapping[str, float]) -> str:
    """Say where a camera is, and its focal length, each ± its standard deviation where that is known."""
    place = ", ".join(_with_sd(at, sd.get(f"{axis}_m"), 2) for axis, at in zip("xyz", camera.centre, strict=True))
    focal = _with_sd(camera.K[0, 0], sd.get("fx_px"), 0)
    return f"at {place} m; focal length {focal} px; {camera.size[0]}×{camera.size[1]} px"


def _with_sd(value: float, sd: float | None, digits: int) -> str:
    """Write a number, with two digits of its standard deviation."""
    if not sd:
        return f"{value:z.{digits}f}"
    digits = max(0, 1 - math.floor(math.log10(sd)))
    return f"{value:z.{digits}f} ± {sd:.{digits}f}"


def _show_rig(rig: Rig, findings: Mapping[str, Sequence[str]], deviations: Mapping[str, Mapping[str, float]]) -> None:
    wide, side = two_columns()
    with wide:
        draw_cameras(rig)
    with side, ui.element("div").classes("card"):
        show_findings(findings.get("", ()))
        for camera in rig:
            ui.label(camera.name).classes("name")
            ui.label(_describe(camera, deviations.get(camera.name, {}))).classes("soft small")
            show_findings(findings.get(camera.name, ()))
