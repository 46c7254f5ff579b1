"""Digitised points beside a run: errors, and how well run and people agree."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from nicegui import ui

from airborne.body import BodyModel
from airborne.errors import ResultError
from airborne.evaluation import DigitisedPoints
from airborne.motion.run_folder import holds_players
from airborne.run.evaluate import assess, evaluate_agreement
from airborne.studio.digitising import (
    JOINTS_ENDING,
    Repetition,
    joint_paths_text,
    list_other_clicks,
    list_repetitions,
    read_digitising,
)
from airborne.studio.pages.slow_work import work
from airborne.studio.project import list_runs
from airborne.studio.runs import run_rows
from airborne.studio.session import Session

_THESE = "these"


class ClickComparison:
    """One window's buttons that compare one person's clicks, or those of another table, with a run."""

    def __init__(
        self,
        session: Session,
        model: BodyModel | None,
        cameras: Sequence[str],
        clicks: Callable[[], tuple[Repetition, DigitisedPoints]],
    ) -> None:
        """Lay them out; `clicks` tells who digitises in these cameras now, and what."""
        self.session, self.cameras, self.clicks = session, cameras, clicks
        self.is_person = model is not None and model.has_joints  # landmarks are compared one by one, things as poses
        runs = [run for run in list_runs(session.folder) if not holds_players(run)]
        if not runs:
            ui.label("Once there is a run, the clicks can be compared with it here.").classes("soft small")
            return
        with ui.element("div").classes("row-line tools"):
            choice = ui.select([run.name for run in runs], label="run", value=runs[0].name)
            choice.props("outlined dense options-dense").style("width: 106px")
            others = list_other_clicks(session.folder)
            self._whose = ui.select([_THESE, *others], label="clicks", value=_THESE)
            self._whose.props("outlined dense options-dense").style("width: 118px").set_visibility(bool(others))
            compare = ui.button("Compare", on_click=lambda: self.show(self._compare, session.folder / choice.value))
            compare.props("flat dense")
            agree = ui.button("Agreement", on_click=lambda: self.show(self._agree, session.folder / choice.value))
            whom = "these clicks" if self.is_person else "everyone who digitised"
            agree.props("flat dense").tooltip(f"between the run and {whom}")

    async def show(self, compare: Callable[[Path], str], run: Path) -> None:
        """Compare a run with these clicks, and show what comes of it."""
        found = await work("comparing", lambda: compare(run))
        if found is not None:
            _show_tables(found)

    def _compare(self, run: Path) -> str:
        """Say how far a run is from these clicks, in its summary and report too."""
        if self.is_person:
            return assess(run, None, None, self._write_paths(run))["joints"].describe()
        return assess(run, None, self._file())["digitised"].describe()

    def _agree(self, run: Path) -> str:
        """Say how well a run agrees with the clicks, and of a thing all people and repetitions with each other."""
        if self.is_person:
            return evaluate_agreement(run, joints=self._write_paths(run)).describe()
        others = [self.session.folder / each.file for each in list_repetitions(self.session.folder)]
        first = self._file()
        others = [path for path in others if path != first]
        return evaluate_agreement(run, digitised=first, operators=others).describe()

    def _file(self) -> Path:
        """Return the table that was chosen. Raises ResultError where it is not there."""
        name = self.clicks()[0].file if self._whose.value == _THESE else str(self._whose.value)
        if not (path := self.session.file(name)).is_file():
            raise ResultError("there are no clicks to compare yet; click some points first")
        return path

    def _write_paths(self, run: Path) -> Path:
        """Write where the clicked landmarks are in space, and return the file's path."""
        file = self._file()
        table = self.clicks()[1] if self._whose.value == _THESE else read_digitising(file, self.cameras, ())
        name = f"{file.stem}{JOINTS_ENDING}"
        text = joint_paths_text(table, self.session.rig(), run_rows(run))
        self.session.edit(name, text, "paths of the clicked joints")
        return self.session.file(name)


def _show_tables(text: str) -> None:
    """Show a comparison's tables."""
    with ui.dialog(value=True).props("aria-label=comparison") as dialog, ui.card().style("max-width: 90vw"):
        ui.label(text).style("white-space: pre; overflow: auto; font: 12px ui-monospace, monospace")
        ui.button("Close", on_click=dialog.close).props("flat")
