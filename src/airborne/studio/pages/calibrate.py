"""Cameras calibrated from what was filmed: a board or a wand, by the command `calibrate`; its pictures and findings."""

from __future__ import annotations

from typing import Any
from urllib.parse import quote

from nicegui import ui

from airborne.calibration.sources.boards import DICTIONARIES, read_board
from airborne.errors import AirborneError
from airborne.evaluation import read_clicked_frames
from airborne.studio.calibrating import (
    CALIBRATED,
    SOURCES,
    board_text,
    guess_video,
    list_boards,
    list_pictures,
    list_wands,
    read_findings,
    read_report,
    sources_text,
    wand_text,
    write_calibration_report,
)
from airborne.studio.commands import Command
from airborne.studio.digitising import list_repetitions
from airborne.studio.pages.command_watch import CommandWatch
from airborne.studio.pages.layout import show_findings
from airborne.studio.pages.slow_work import show_errors
from airborne.studio.pictures import ShownTrial
from airborne.studio.project import list_videos
from airborne.studio.session import Session

_BOARD = "board.toml"  # of a new one
_HELP = (
    "Show the board to each camera close by, tilted, and in every corner of its picture; then to two cameras at once, "
    "until all are linked. Or wave a wand, a dark stick with two balls of a colour that nothing else has: it is found "
    "automatically."
)
_PICTURES_HELP = "Points should cover each camera's image, and their arrows should point in all directions."
_FILMED = "found in the videos"  # of a wand, instead of its table
_WAND_HELP = (
    "If the wand is not found, click its two ends in about twenty frames in the step Digitise. Or track them in DLTdv, "
    "easyWand or Argus, and put that table (…xypts.csv) beside the videos."
)


class CalibratePanel:
    """One window's choice of a board or a wand; the calibration itself belongs to all windows."""

    def __init__(self, session: Session, shown: ShownTrial) -> None:
        """Begin with what the folder holds."""
        self.session, self.shown = session, shown
        self.videos = {name: guess_video(session.project(), name) for name in shown.names}

    def build(self) -> None:
        """Lay out the button that opens it, both ways, and what came of it."""
        folder = self.session.folder
        boards, wands = list_boards(folder), list_wands(folder)
        name = 'aria-label="calibrate with a board or a wand"'
        with ui.dialog().props(name) as dialog, ui.card().style("max-width: min(1100px, 92vw)"):
            ui.html("<h2>Calibrate with a board or a wand</h2>", sanitize=False)
            ui.label(_HELP).classes("help small")
            with ui.element("div").classes("row-line"):
                self._video_choices()
            ui.html("<h2>A board</h2>", sanitize=False)
            with ui.element("div").classes("row-line"):
                self.board = ui.select(boards, label="board", value=boards[0] if boards else None)
                self.board.props("outlined dense options-dense").style("min-width: 180px")
                board = ui.button("Calibrate with the board", on_click=self.use_board).props("unelevated")
            self._board_form()
            ui.html("<h2>A wand</h2>", sanitize=False)
            with ui.element("div").classes("row-line"):
                self.wand = ui.select([*wands, _FILMED], label="wand", value=[*wands, _FILMED][0])
                self.wand.props("outlined dense options-dense").style("min-width: 180px")
                self.length = ui.number("length of the wand [m]", min=0.05, max=10, value=0.5, step=0.001)
                self.length.props("outlined dense").style("width: 170px")
                wand = ui.button("Calibrate with the wand", on_click=self.use_wand).props("unelevated")
            ui.label(_WAND_HELP).classes("soft small").style("white-space: normal")
            with ui.element("div").classes("row-line"):
                self.watch = CommandWatch(self.session, "calibrate", self.take, words="calibrating")
                self.watch.buttons = [board, wand]
            self.results = ui.refreshable(self._show_results)
            self.results()
            ui.button("Close", on_click=dialog.close).props("flat")
        ui.button("With a board or a wand", on_click=dialog.open).props("outline")

    def use_board(self) -> None:
        """Start the calibration with a board."""
        with show_errors():
            if self.board.value is None:
                raise AirborneError("describe the board first: columns, rows and the size of a square")
            media = {name: {"video": video} for name, video in self.videos.items()}
            self._start({"board": {"file": self.board.value}}, media)

    def use_wand(self) -> None:
        """Start the calibration with a wand."""
        with show_errors():
            length = {"length_m": float(self.length.value or 0)}
            folder, name = self.session.folder, str(self.wand.value)
            if name == _FILMED:
                self._start({"wand": length}, {camera: {"video": video} for camera, video in self.videos.items()})
                return
            media = {camera: {"size": list(size)} for camera, size in self.shown.sizes.items()}
            if name in (each.file for each in list_repetitions(folder)):
                clicks = read_clicked_frames(self.session.file(name), self.shown.names)
                name = f"wand_{name}"
                self.session.edit(name, wand_text(self.session.project(), clicks), "a wand's ends clicked")
            self._start({"wand": {"file": name, **length}}, media)

    def take(self, command: Command) -> None:
        """Use the calibration that was made."""
        with show_errors():
            values = {"file": CALIBRATED, "control_points": None}
            self.session.set_table("calibration", values, f"calibration by {CALIBRATED}")
            write_calibration_report(self.session.folder, command.output())
        self.results.refresh()

    def _start(self, source: dict[str, Any], media: dict[str, dict[str, Any]]) -> None:
        self.session.edit(SOURCES, sources_text(self.session.project(), source, media), "sources of a calibration")
        self.watch.start("calibrate", SOURCES, "-o", CALIBRATED, writes=CALIBRATED, what="cameras calibrated")

    def _video_choices(self) -> None:
        names = [path.name for path in list_videos(self.session.folder)]
        for camera in self.shown.names:
            choice = ui.select(names, label=f"video of {camera}", value=self.videos[camera])
            choice.bind_value(self.videos, camera)
            choice.props("outlined dense options-dense").style("min-width: 150px")

    def _board_form(self) -> None:
        ui.label("Describe another board:").classes("small")
        with ui.element("div").classes("row-line"):
            numbers = [
                ui.number(label, value=value, min=0, step=step).props("outlined dense").style("width: 110px")
                for label, value, step in (
                    ("columns", 7, 1),
                    ("rows", 5, 1),
                    ("square [mm]", 40, 0.1),
                    ("marker [mm]", 30, 0.1),
                )
            ]
            dictionary = ui.select(list(DICTIONARIES), label="dictionary", value="DICT_4X4_50")
            dictionary.props("outlined dense options-dense").style("min-width: 170px")

            def write() -> None:
                columns, rows, square_mm, marker_mm = (float(each.value or 0) for each in numbers)
                with show_errors():
                    more = {"marker_mm": marker_mm, "dictionary": str(dictionary.value)}
                    text = board_text(int(columns), int(rows), square_mm, **more)
                    self.session.edit(_BOARD, text, "board described")
                    read_board(self.session.file(_BOARD))
                    self.board.set_options(list_boards(self.session.folder), value=_BOARD)

            ui.button("Describe a new board", on_click=write).props("outline")
        ui.label("For a chessboard, count the inner corners, and give 0 mm for the markers.").classes("soft small")

    def _show_results(self) -> None:
        """Show what the last calibration said, and where each camera saw points."""
        if text := read_report(self.session.folder):
            ui.label(text).classes("report")
        with show_errors():
            findings = read_findings(self.session.folder, CALIBRATED)
            show_findings(findings.get("", []))
            if pictures := list_pictures(self.session.folder):
                ui.label(_PICTURES_HELP).classes("soft small")
            with ui.element("div").classes("files"):
                for path in pictures:
                    camera = path.stem.removeprefix("residuals_")
                    with ui.element("div"):
                        address = f"/calibration/{quote(path.name)}?{path.stat().st_mtime_ns}"
                        picture = ui.element("img").props(f"src={address}")
                        picture._props["alt"] = f"where points were seen: {camera}"
                        show_findings(findings.get(camera, []))
