"""The step Cameras: a calibration file, or surveyed points clicked in every camera's picture."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from nicegui import ui

from airborne.calibration.sources.court import Net
from airborne.cameras import Camera, Rig
from airborne.errors import count
from airborne.studio.calibrating import NETS, court_text, read_deviations, read_findings
from airborne.studio.calibrations import ENDINGS, Calibrations, list_calibrations
from airborne.studio.clicks import list_surveys
from airborne.studio.folder import outer_files
from airborne.studio.pages.calibrate import CalibratePanel
from airborne.studio.pages.camera_names import CameraNames, use_calibration
from airborne.studio.pages.control_points import ControlPointsPanel
from airborne.studio.pages.layout import (
    errors_shown,
    in_thread,
    name_missing_steps,
    name_outer_links,
    page_frame,
    show_findings,
    work,
)
from airborne.studio.session import Session
from airborne.studio.stage import draw_cameras

_HELP = (
    "To use a calibration from another program, put its file beside the videos and reload this page. Or click surveyed "
    "points, or those of a court: at least six in each camera, spread over the space in which the body moves; "
    "residuals are drawn ten times as long. Or calibrate with a board or a wand."
)


async def cameras_page(session: Session) -> None:
    """Let the user choose a calibration file, or a survey and click its points."""
    async with page_frame(session, "Cameras", "Where are the cameras?", _HELP) as changed:
        project = session.project()
        if name_missing_steps(session, "camera"):
            return
        shown = await work("indexing the videos", session.shown)
        if shown is None:
            return
        wanted = {camera.calibrated_as or camera.name for camera in project.cameras}
        files = await in_thread(list_calibrations, session.folder, wanted, says="reading the calibrations")
        name_outer_links(outer_files(session.folder, *ENDINGS))
        surveys = await in_thread(list_surveys, session.folder, says="reading the surveys")
        table = project.table("calibration")
        if not (files.usable or files.renamed or surveys or table):
            ui.label(
                "The folder holds neither a calibration of these cameras nor a table of surveyed points "
                "(point,x_m,y_m,z_m). Put one there and reload this page; or click the points of a court, or calibrate "
                "with a board or a wand."
            ).classes("warn")
        names_form = CameraNames(session)
        with ui.element("div").classes("row-line"):
            _chooser(session, files, surveys, names_form)
            CalibratePanel(session, shown).build()
        names_form.build()
        _show_refused(session, files)
        if table.get("control_points"):
            panel = await ControlPointsPanel.open(session, shown, str(table["control_points"]))
            if panel is not None:
                changed.append(panel.reread)
        elif table.get("file"):
            rig = await work("reading the calibration", session.rig)
            if rig is not None:
                _show_rig(rig, _findings_of(session, str(table["file"])), _deviations_of(session, str(table["file"])))


def _chooser(session: Session, files: Calibrations, surveys: list[str], names_form: CameraNames) -> None:
    table = session.project().table("calibration")

    def use(key: str, name: str) -> None:
        if table.get(key) == name:
            return
        if key == "file" and name in files.renamed:
            names_form.show(name, files.renamed[name])
            return
        calibrated_as = {each.name: each.calibrated_as for each in session.project().cameras} if key == "file" else {}
        use_calibration(session, {"file": None, "control_points": None, key: name}, calibrated_as)

    def use_court(net: Net) -> None:
        name = f"court_{net}.csv"
        with errors_shown():
            if not (session.folder / name).exists():
                session.edit(name, court_text(net), "points of a court")
            use("control_points", name)

    both = [*files.usable, *files.renamed]
    for key, names, label in (("file", both, "calibration file"), ("control_points", surveys, "surveyed points")):
        if names:
            present = table.get(key)
            ui.select(
                names,
                label=label,
                value=present if present in names else None,
                on_change=lambda event, key=key: use(key, event.value),
            ).props("outlined dense options-dense").style("min-width: 220px")
    court = ui.select(NETS, label="volleyball court", on_change=lambda event: use_court(event.value))
    court.props("outlined dense options-dense").style("min-width: 200px")


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
    with errors_shown():
        found = read_findings(session.folder, file)
    own = {each.name: found.get(each.calibrated_as or each.name, []) for each in session.project().cameras}
    return {"": found.get("", []), **own}


def _deviations_of(session: Session, file: str) -> dict[str, dict[str, float]]:
    """Return the standard deviations that a calibration's report knows, by the trial's own cameras."""
    known: dict[str, dict[str, float]] = {}
    with errors_shown():
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
        return f"{value:.{digits}f}"
    digits = max(0, 1 - math.floor(math.log10(sd)))
    return f"{value:.{digits}f} ± {sd:.{digits}f}"


def _show_rig(rig: Rig, findings: Mapping[str, Sequence[str]], deviations: Mapping[str, Mapping[str, float]]) -> None:
    with ui.element("div").classes("split"):
        with ui.element("div").classes("wide"):
            draw_cameras(rig)
        with ui.element("div").classes("side"), ui.element("div").classes("card"):
            show_findings(findings.get("", ()))
            for camera in rig:
                ui.label(camera.name).classes("name")
                ui.label(_describe(camera, deviations.get(camera.name, {}))).classes("soft small")
                show_findings(findings.get(camera.name, ()))
