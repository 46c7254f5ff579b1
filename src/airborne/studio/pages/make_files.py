"""Files made of a run when they are asked for: exports for other programs, a film of a stretch."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import quote

from nicegui import ui

from airborne.errors import AirborneError
from airborne.motion.run_folder import FOLDERS
from airborne.run.export import EXPORT_FORMATS
from airborne.studio.commands import STOPPED, Command
from airborne.studio.pages.layout import complain, errors_shown
from airborne.studio.session import Session

_LOOK_EVERY_S = 0.5  # at a command that goes on


class Making:
    """One run's buttons; the commands belong to this window."""

    def __init__(self, session: Session, folder: Path) -> None:
        """Lay them out, with links to what is there."""
        self._session, self._folder = session, folder
        self._command: Command | None = None
        ui.label("For other programs").classes("soft")
        with ui.element("div").classes("row-line"):
            self._formats = ui.select(list(EXPORT_FORMATS), label="formats", value=["c3d"], multiple=True)
            self._formats.props("outlined dense options-dense").style("min-width: 160px")
            self._buttons = [ui.button("Export", on_click=self.export).props("outline")]
            if any((folder / FOLDERS[2]).glob("overlay_*.mp4")):
                self._film()
            self._says = ui.label().classes("small soft")
        self._links = ui.refreshable(self._list_files)
        self._links()
        ui.timer(_LOOK_EVERY_S, self.look)

    def export(self) -> None:
        """Start `airborne export`."""
        with errors_shown():
            if not self._formats.value:
                raise AirborneError("choose a format, such as c3d")
            self._start("export", self._folder.name, *(f"--{kind}" for kind in self._formats.value))

    def film(self) -> None:
        """Start `airborne film`."""
        path = f"{self._folder.name}/{FOLDERS[2]}/film.{self._kind.value}"
        ends = [("--first", self._first.value), ("--last", self._last.value)]
        words = [word for name, value in ends if value is not None for word in (name, str(int(value)))]
        self._start("film", self._folder.name, "-o", path, *words)

    def look(self) -> None:
        """Say how a command goes."""
        if self._command is None:
            return
        if self._command.is_running:
            self._says.set_text(f"{self._command.line}: {self._command.seconds:.0f} s")
            return
        command, self._command = self._command, None
        for button in self._buttons:
            button.enable()
        self._says.set_text("done" if command.code == 0 else "")
        if command.code not in (0, STOPPED):
            complain(command.complaint())
        self._links.refresh()

    def _film(self) -> None:
        self._first = ui.number("first frame", min=0, precision=0).props("outlined dense").style("width: 110px")
        self._last = ui.number("last frame", min=0, precision=0).props("outlined dense").style("width: 110px")
        self._kind = ui.select(["mp4", "gif"], label="film", value="mp4").props("outlined dense options-dense")
        self._buttons.append(ui.button("Make a film", on_click=self.film).props("outline"))

    def _start(self, *words: str) -> None:
        if self._command is None:
            self._command = Command(words, self._session.folder)
            for button in self._buttons:
                button.disable()

    def _list_files(self) -> None:
        made = sorted([*(self._folder / "export").glob("*"), *(self._folder / FOLDERS[2]).glob("film.*")])
        with ui.element("div").classes("row-line"):
            for path in made:
                address = f"/file/{quote(self._folder.name)}/{path.parent.name}/{quote(path.name)}"
                link = ui.element("a").props(f'href="{address}" target="_blank" rel="noopener"').classes("plain")
                with link:
                    ui.label(path.name)
