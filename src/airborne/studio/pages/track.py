"""The step Track: `airborne track` in a process of its own, its overlays as they come."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from nicegui import ui

from airborne.errors import STOPPED, UNTRACKED, AirborneError, ResultError, TrialError, count
from airborne.motion.run_folder import JOINTS, MOTION, SUMMARY, read_summary
from airborne.studio.commands import Command
from airborne.studio.pages.layout import name_missing_steps, page_frame
from airborne.studio.pages.slow_work import complain, in_thread, show_errors, work
from airborne.studio.pages.track_settings import TrackSettingsBar
from airborne.studio.pictures import ShownTrial
from airborne.studio.project import find_run, list_runs
from airborne.studio.run_names import check_run_name, next_run_name
from airborne.studio.runs import count_rows, describe_progress
from airborne.studio.session import Session
from airborne.studio.view import CameraViews, Curves

_LOOK_EVERY_S = 1.0  # at a run that goes on
_HELP = (
    "Tracking runs in a process of its own: go on working, or close the browser. "
    "A run that is stopped keeps its frames and goes on where it was. To try another method, name another folder."
)


async def track_page(session: Session) -> None:
    """Start, watch, stop and resume a run."""
    async with page_frame(session, "Track", "Follow the body", _HELP) as changed:
        if name_missing_steps(session, changed, "Videos", "Cameras", "Body"):
            return
        shown = await work("indexing the videos", session.shown)
        if shown is None:
            return
        try:
            settings = TrackSettingsBar(session, len(shown.clock))
        except AirborneError as error:
            complain(error)
            return
        _Panel(session, shown, settings).build()

        async def reread() -> None:
            settings.reread()

        changed.append(reread)


@dataclass(eq=False)
class _Panel:
    """One window that watches the run."""

    session: Session
    shown: ShownTrial
    settings: TrackSettingsBar
    n_done: int = -1  # frames of the run, when it was looked at last
    is_finished: bool = False  # and whether it was, by whomever
    n_before: int = 0  # of them, when it was resumed
    ended: Command | None = None  # the run whose end was told
    curves: Curves | None = None  # once there are frames
    _was_running: bool = False
    _begun_s: float = 0.0  # after which the first frame was tracked
    _problem: str = ""  # of the folder's name

    def build(self) -> None:
        """Lay out the bar, the pictures, and a look at the run every second."""
        runs = list_runs(self.session.folder)
        command = self._command
        self.ended = None if self._is_running else command
        name = command.words[3] if command is not None else runs[0].name if runs else "results"
        with ui.element("div").classes("row-line"):
            self.name = ui.input("folder of the run", value=name, on_change=self.rename)
            self.name.props("outlined dense").style("width: 200px")
            self.settings.build()
            self.begin = ui.button("Track", on_click=lambda: self.start()).props("unelevated")
            self.resume = ui.button("Go on", on_click=lambda: self.start("--resume")).props("unelevated")
            self.again = ui.button("Track again", on_click=self.ask).props("outline")
            self.halt = ui.button("Stop", on_click=self.stop).props("unelevated color=grey-8")
            self.bar = (
                ui.linear_progress(0, show_value=False, size="10px")
                .props("rounded aria-label=progress animation-speed=200")
                .style("width: 220px")
            )
            self.says = ui.label().classes("small soft")
            self._show_buttons()
            if self.ended is not None and self.ended.code not in (0, STOPPED):
                self._tell(self.ended.complaint(), is_wrong=True)
        self.view = CameraViews(
            self.shown, frame=self.session.frame, overlay=self._overlay, on_frame=self.session.turn_to
        )
        self.area = ui.element("div").style("display: contents")
        ui.timer(_LOOK_EVERY_S, self.look)

    @property
    def folder(self) -> Path:
        """The run's folder. Raises TrialError where what is given cannot be one."""
        return check_run_name(self.session.folder, self._name)

    @property
    def _name(self) -> str:
        return self.name.value or ""

    @property
    def _overlay(self) -> str:
        return "" if self._problem else f"/overlay/{quote(self._name)}/{{frame}}"

    @property
    def _curves(self) -> str:
        state = f"frames={self.n_done}&finished={self.is_finished}"  # another address for each state of a run
        return f"/curves/{quote(self._name)}?{state}"

    @property
    def _command(self) -> Command | None:
        return self.session.commands.get("track")

    @property
    def _is_running(self) -> bool:
        return self._command is not None and self._command.is_running

    def _read_run(self) -> tuple[int, int | None, bool]:
        """Return how many frames the run holds so far, which is the newest, and whether it is finished."""
        run, command = find_run(self.session.folder, self._name), self._command
        if run is None or (
            command is not None
            and command.is_running
            and "--overwrite" in command.words
            and not any(command.has_written(run / name) for name in (MOTION, JOINTS))
        ):
            return 0, None, False  # what is there is the run before
        return *count_rows(run), (run / SUMMARY).is_file()

    def _watch_run(self) -> tuple[int, int | None, bool]:
        """Read the run; a terminal, or another studio, may have begun one."""
        if not self._is_running:
            self.session.watch_tracking()
        return self._read_run()

    def start(self, *options: str) -> None:
        """Start `airborne track`."""
        if self._is_running:
            return
        with show_errors():
            self.session.project().trial()
            words = ["track", self.session.path.name, "-o", self.folder.name, *options]
            self.n_before = self._read_run()[0] if "--resume" in options else 0
            self.session.commands["track"] = Command(words, self.session.folder)
            self.n_done = -1
            self._show_buttons()

    async def ask(self) -> None:
        """Track again once it is clear what becomes of the run that is there."""
        old, n_done = self._name, (await in_thread(self._read_run, says=""))[0]
        new = next_run_name(self.session.folder, old)
        with ui.dialog().props('aria-label="track again"') as dialog, ui.card():
            held = f"{old} holds a run of {count(n_done, 'frame')}." if n_done else f"{old} holds a run."
            ui.label(f"{held} Track into {new} and keep it, or replace it?")
            with ui.element("div").classes("row-line"):
                ui.button(f"Keep it, track into {new}", on_click=lambda: dialog.submit("keep")).props("unelevated")
                ui.button("Replace it", on_click=lambda: dialog.submit("replace")).props("outline")
                ui.button("Cancel", on_click=lambda: dialog.submit(None)).props("flat")
        answer = await dialog
        dialog.delete()
        if answer == "keep":
            self.name.value = new
            self.start()
        elif answer == "replace":
            self.start("--overwrite")

    async def rename(self) -> None:
        """Show the run of another name."""
        self.n_done = -1
        self._tell("")
        self._show_buttons()
        self.view.set_overlay(self._overlay)
        await self.look()

    async def stop(self) -> None:
        """Stop the run; its frames stay."""
        if self._command is not None:
            await in_thread(self._command.stop, says="stopping")
        self._show_buttons()

    async def look(self) -> None:
        """Show how far the run is, and its newest frame unless the user looks at another."""
        n_done, newest, is_finished = await in_thread(self._watch_run, says="")
        command = self._command
        if self._is_running != self._was_running:  # another window has started it, or it has ended
            self._show_buttons()
        if command is not None and command.is_running:
            self._say_progress(command, n_done)
        elif command is not None and command is not self.ended:
            self.ended = command
            self._say_end(command)
        if (n_done, is_finished) != (self.n_done, self.is_finished):
            is_first, self.n_done, self.is_finished = self.n_done <= 0, n_done, is_finished
            self.view.run_method("refresh")
            self._show_curves()
            if newest is not None and self._is_running:
                self.view.lead(newest, anew=is_first)
            self._show_buttons()

    def _show_curves(self) -> None:
        """Show how far the run is over its frames, and how the body and each of its joints went."""
        self.area.set_visibility(self.n_done > 0)
        if self.curves is not None and self.n_done > 0:
            self.curves.show(self._curves)
        elif self.n_done > 0:
            with self.area:
                self.curves = Curves(self._curves, frame=self.view.frame).style("height: 220px")

    def _say_progress(self, command: Command, n_rows: int) -> None:
        n_frames, n_done, left = self.settings.n_frames, max(n_rows, command.n_done()), ""
        if n_done <= self.n_before:
            self._begun_s = command.seconds  # what goes before, opening videos and looking for the start, is no pace
        elif (n_own := n_done - self.n_before) > 2 and n_done < n_frames:
            left = f", about {(command.seconds - self._begun_s) / n_own * (n_frames - n_done):.0f} s left"
        self.bar.value = n_done / max(n_frames, 1)
        said = command.progress()
        is_other = said.startswith(("fitting", "drawing")) or (not n_done and said.startswith("looking"))
        stage = said if is_other else describe_progress(n_done, n_frames)
        self._tell(f"{stage}, {command.seconds:.0f} s{left}")

    def _say_end(self, command: Command) -> None:
        if command.code == 0:
            self._tell(command.output().splitlines()[0])
            ui.notify("tracked; the report is in the step Results", type="positive")
        elif command.code == STOPPED:
            self._tell("stopped")
        else:
            said = self._say_untracked(command) if command.code == UNTRACKED else command.complaint()
            self._tell(said, is_wrong=True)
            complain(said)
        self._show_buttons()

    def _say_untracked(self, command: Command) -> str:
        """Say how many frames of a whole run were tracked, hardly any, and the first reason that it has for that."""
        counts = command.output().partition("\n")[0]
        with suppress(ResultError):
            return ". ".join([counts, *read_summary(self.folder).get("warnings", [])[:1]])
        return counts

    def _tell(self, text: str, *, is_wrong: bool = False) -> None:
        """Show a line beside the buttons, until there is another."""
        self.says.text = text
        self.says.classes("warn" if is_wrong else "soft", remove="soft" if is_wrong else "warn")

    def _show_buttons(self) -> None:
        """Show what can be done about the run now."""
        self._was_running = is_running = self._is_running
        problem = ""
        is_begun = is_finished = False
        if is_running and self._command is not None:
            self.name.value = self._command.words[3]
        else:
            try:
                folder = self.folder
                is_begun, is_finished = (
                    any((folder / name).is_file() for name in (MOTION, JOINTS)),
                    (folder / SUMMARY).is_file(),
                )
            except TrialError as error:
                problem = str(error)
        self.name.set_enabled(not is_running)
        self.settings.set_enabled(not is_running)
        self.bar.set_visibility(is_running)
        self.halt.set_visibility(is_running)
        self.begin.set_visibility(not is_running and not is_begun)
        self.begin.set_enabled(not problem)
        self.resume.set_visibility(not is_running and is_begun and not is_finished)
        self.again.set_visibility(not is_running and is_begun)
        if problem or self._problem:
            self._tell(problem, is_wrong=bool(problem))
        self._problem = problem
