"""Files made of a run when they are asked for: exports for other programs, a film of a stretch."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import quote

from nicegui import ui

from airborne.motion.run_folder import EXPORTS, VIDEOS
from airborne.run.export import EXPORT_FORMATS
from airborne.run.film import check_order
from airborne.studio.commands import Command
from airborne.studio.pages.command_watch import CommandWatch
from airborne.studio.pages.slow_work import show_errors
from airborne.studio.runs import note_if_older
from airborne.studio.session import Session


class Making:
    """One run's buttons."""

    def __init__(self, session: Session, folder: Path) -> None:
        """Lay them out, with links to what is there."""
        self._folder = folder
        ui.label("For other programs").classes("soft")
        with ui.element("div").classes("row-line"):
            self._formats = ui.select(list(EXPORT_FORMATS), label="formats (none: all)", value=[], multiple=True)
            self._formats.props("outlined dense options-dense").style("min-width: 220px")
            buttons = [ui.button("Export", on_click=self.export).props("outline")]
        if any((folder / VIDEOS).glob("overlay_*.mp4")):
            ui.label("A film").classes("soft")
            with ui.element("div").classes("row-line"):
                buttons.append(self._film())
        with ui.element("div").classes("row-line"):
            self._watch = CommandWatch(session, f"files of {folder.name}", self.show_files, words="working")
            self._watch.buttons = buttons
        self._links = ui.refreshable(self._list_files)
        self._links()

    def export(self) -> None:
        """Start `airborne export`."""
        self._watch.words = "exporting"
        with show_errors():
            self._watch.start("export", self._folder.name, *(f"--{kind}" for kind in self._formats.value))

    def film(self) -> None:
        """Start `airborne film`."""
        first, last = self._first.value, self._last.value
        ends = [(name, f"{n:.0f}") for name, n in (("first", first), ("last", last)) if n is not None]
        stem = "_".join(["film", *(name + n for name, n in ends)])  # each stretch is kept
        path = f"{self._folder.name}/{VIDEOS}/{stem}.{self._kind.value}"
        words = [word for name, n in ends for word in (f"--{name}", n)]
        self._watch.words = "drawing the film"
        with show_errors():
            check_order(first, last)
            self._watch.start("film", self._folder.name, "-o", path, *words)

    def show_files(self, command: Command) -> None:
        """Show what was made."""
        self._watch.says.set_text(f"done: {command.line}")
        self._links.refresh()

    def _film(self) -> ui.button:
        self._first = ui.number("first frame", min=0, precision=0).props("outlined dense").style("width: 110px")
        self._last = ui.number("last frame", min=0, precision=0).props("outlined dense").style("width: 110px")
        self._kind = ui.select(["mp4", "gif"], label="kind", value="mp4").props("outlined dense options-dense")
        return ui.button("Make a film", on_click=self.film).props("outline")

    def _list_files(self) -> None:
        made = sorted([*(self._folder / EXPORTS).glob("*"), *(self._folder / VIDEOS).glob("film*")])
        with ui.element("div").classes("row-line"):
            for path in made:
                address = f"/file/{quote(self._folder.name)}/{path.parent.name}/{quote(path.name)}"
                link = ui.element("a").props(f'href="{address}" target="_blank" rel="noopener"').classes("plain")
                with link:
                    ui.label(path.name + note_if_older(self._folder, path))
