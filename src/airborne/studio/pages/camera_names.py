"""A calibration file whose cameras have other names than the trial's: which is which."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence

from nicegui import ui

from airborne.studio.calibrations import guess_name
from airborne.studio.pages.slow_work import complain, show_errors
from airborne.studio.session import Session
from airborne.studio.trial_edits import with_cameras, with_table


class CameraNames:
    """One window's choice of a name in a calibration file for each camera of the trial."""

    def __init__(self, session: Session, on_use: Callable[[], Awaitable[None]]) -> None:
        """Begin without a file; `on_use` is called when the names are written."""
        self.session, self._on_use = session, on_use

    def build(self) -> None:
        """Keep a place, which is empty until a file is chosen."""
        self.area = ui.element("div").classes("row-line")
        self.area.set_visibility(False)

    def show(self, file: str, names: Sequence[str]) -> None:
        """Ask for the names of a file's cameras."""
        self.area.clear()
        self.area.set_visibility(True)
        with self.area:
            ui.label(f"In {file} the cameras have other names. Which is which?")
            chosen = {
                camera.name: ui.select(
                    list(names), label=camera.name, value=guess_name(camera.calibrated_as or camera.name, names)
                )
                for camera in self.session.project().cameras
            }
            for choice in chosen.values():
                choice.props("outlined dense options-dense").style("min-width: 150px")

            async def write() -> None:
                await self.write(file, {name: choice.value for name, choice in chosen.items()})

            ui.button("Use these names", on_click=write).props("unelevated")

    async def write(self, file: str, chosen: dict[str, str | None]) -> None:
        """Write the file and the names into the trial."""
        if len({*chosen.values()} - {None}) < len(chosen):
            complain("choose a camera of the file for each, and none twice")
            return
        use_calibration(self.session, {"file": file, "control_points": None}, chosen)
        await self._on_use()


def use_calibration(session: Session, table: dict[str, str | None], names: dict[str, str | None]) -> None:
    """Write a calibration into the trial, and by which name each camera stands in it; None for its own."""
    cameras = [
        {"video": each.video, "calibrated_as": name if (name := names.get(each.name)) != each.name else None}
        for each in session.project().cameras
    ]
    with show_errors():
        session.edit_trial(
            lambda text: with_table(with_cameras(text, session.path.stem, cameras), "calibration", table),
            f"calibration by {table['file'] or table['control_points']}",
        )
