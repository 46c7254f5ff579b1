"""The step Results: a finished run's headline numbers, its report and its tables."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

from nicegui import ui

from airborne.errors import ResultError, count, format_digits
from airborne.export.methods_text import describe_corrections, describe_methods
from airborne.motion.run_folder import REPORT, note_if_unfinished, read_summary
from airborne.run.folder import list_tables
from airborne.run.self_check import alarms
from airborne.studio.pages.layout import name_outer_links, page_frame
from airborne.studio.pages.make_files import Making
from airborne.studio.pages.slow_work import in_thread
from airborne.studio.project import list_outer_runs, list_runs
from airborne.studio.runs import note_if_older
from airborne.studio.session import Session

_HELP = "The report is one file, to send or to print. The tables open in any spreadsheet."
_CHECKED = "Self-check of size, cameras and times"
_NUMBERS = {
    "n_frames": "frames",
    "n_tracked": "tracked",
    "n_uncertain": "uncertain",
    "n_lost": "lost",
    "median_position_sd_mm": "median sd of position [mm]",
    "median_rotation_sd_deg": "median sd of rotation [°]",
    "method": "method",
}


async def results_page(session: Session) -> None:
    """Show every run of the folder, the newest first."""
    async with page_frame(session, "Results", "What are the results?", _HELP, scrolls=True):
        runs = list_runs(session.folder)
        name_outer_links(list_outer_runs(session.folder))
        if not runs:
            ui.label("There is no run yet; see the step Track.").classes("warn")
        for each in runs:
            found = await in_thread(_read_run, each, says=f"reading {each.name}")
            with ui.element("div").classes("card"):
                _run_card(session, each, found)


class _Found(NamedTuple):
    """What a run's folder holds."""

    note: str | None  # where it is not finished
    summary: dict[str, Any] | ResultError | None  # None where it is not finished
    tables: list[str]


def _read_run(folder: Path) -> _Found:
    note, tables = note_if_unfinished(folder), list_tables(folder)
    try:
        return _Found(note, None if note else read_summary(folder), tables)
    except ResultError as error:
        return _Found(note, error, tables)


def _run_card(session: Session, folder: Path, found: _Found) -> None:
    ui.label(folder.name).classes("name")
    if found.note is not None:
        ui.label(found.note).classes("warn small")
    if (folder / REPORT).is_file():
        _link(folder, REPORT, "Open the report")
    if isinstance(found.summary, ResultError):
        ui.label(str(found.summary)).classes("bad small")
    elif found.summary is not None:
        _numbers(found.summary)
    ui.label("Tables").classes("soft")
    with ui.element("div").classes("row-line"):
        for name in found.tables:
            _link(folder, name, name + note_if_older(folder, folder / name))
    Making(session, folder)


def _numbers(summary: dict[str, Any]) -> None:
    values = summary | summary.get("method", {})  # the method's name is among its settings
    with ui.element("table").classes("plain"):
        for key, words in _NUMBERS.items():
            if isinstance(value := values.get(key), int | float | str):
                with ui.element("tr"):
                    for tag, text in (
                        ("th", words),
                        ("td", format_digits(value, 3) if isinstance(value, float) else str(value)),
                    ):
                        with ui.element(tag):
                            ui.label(text)
    if jumps := summary.get("jumps"):
        from airborne.export.players_report import describe_jump  # which imports Matplotlib

        for jump in jumps:
            ui.label(describe_jump(jump)).classes("small")
    findings = summary.get("self_check") or []
    alarming = alarms(findings)
    for text in summary.get("warnings") or []:
        if text not in alarming:  # which stand below
            ui.label(text).classes("warn small")
    for text in describe_corrections(summary):
        ui.label(text).classes("small")
    if findings:
        with ui.expansion(
            f"{_CHECKED}: {count(len(alarming), 'alarm') if alarming else 'no alarm'}", value=bool(alarming)
        ).props("dense"):
            for finding in findings:
                ui.label(finding["sentence"]).classes("bad small" if finding["is_alarm"] else "soft small")
    with ui.expansion("For a methods section").props("dense"):
        ui.label(describe_methods(summary)).classes("small").style("max-width: 90ch; user-select: text")


def _link(folder: Path, name: str, text: str) -> None:
    address = f"/file/{quote(folder.name)}/{quote(name)}"
    with ui.element("a").props(f'href="{address}" target="_blank" rel="noopener"').classes("plain"):
        ui.label(text)
