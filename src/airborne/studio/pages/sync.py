"""Cameras on one clock: by hand, two of them at the same event, or by the command `sync`."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from nicegui import ui
from nicegui.events import KeyEventArguments

from airborne.errors import count
from airborne.studio.commands import Command
from airborne.studio.pages.command_watch import CommandWatch
from airborne.studio.pages.layout import page_frame, two_columns
from airborne.studio.pages.points_panel import CAMERA_COLOURS
from airborne.studio.pages.slow_work import show_errors, work
from airborne.studio.pictures import ShownTrial
from airborne.studio.session import Session
from airborne.studio.sync_evidence import WAYS, curves_svg, level_curves
from airborne.studio.trial_edits import with_cameras
from airborne.studio.view import CameraViews
from airborne.sync.offsets import fit_line

_HELP = (
    "Step each camera to the same event, a foot that lands or a ball that is hit, and press E. "
    "Several events narrow the offset down: each gives it to within half a frame."
)
_MOMENT = "steps the other camera to the moment of the clock's picture, by the offset that the trial has"
_DRAFT = "events"  # their name among the drafts: the two videos -> pairs of pictures
_WAYS = {"motion": "motion", "flash": "a flash", "sound": "sound", "tracking": "tracking the body"}


async def sync_page(session: Session) -> None:
    """Let the user find the offset of each camera from the first one's clock."""
    async with page_frame(session, "Videos", "Are the cameras synchronised?", _HELP, task="sync") as changed:
        if len(session.project().cameras) < 2:
            ui.label("Choose two cameras or more first, in the step Videos.").classes("warn")
            return
        shown = await work("indexing the videos", session.shown)
        if shown is not None:
            panel = _Panel(session, shown)
            panel.build()
            changed.append(panel.reread)


class _Panel:
    """One window's events, of the clock and one other camera."""

    def __init__(self, session: Session, shown: ShownTrial) -> None:
        self.session, self.shown = session, shown
        self.other, self.at = 1, [0, 0]  # the other camera's number, and the pictures in view
        self.events: list[tuple[int, int]] = []  # pictures of the clock and of the other camera

    def build(self) -> None:
        """Lay out both pictures, the events and what follows from them."""
        ui.keyboard(on_key=self.press)
        with ui.element("div").classes("row-line"):
            names = dict(enumerate(self.shown.names[1:], start=1))
            choice = ui.select(names, label="camera", value=1, on_change=lambda event: self.choose(event.value))
            choice.props("outlined dense options-dense").style("min-width: 160px")
            ui.button("Same event", on_click=self.add).props("unelevated")
            ui.button("Remove the last event", on_click=self.take_back).props("flat dense")
            ui.button("Show the same moment", on_click=self.show_moment).props("flat dense").tooltip(_MOMENT)
            self.use = ui.button("Use this offset", on_click=self.write).props("unelevated")
            self.says = ui.label().classes("small")
        left, self.right = two_columns("wide")
        with left:
            self.labels = [ui.label().classes("small name")]
            CameraViews(self.shown, frame=0, camera=0, on_frame=lambda number: self.turn(0, number))
        with ui.element("div").classes("row-line"):
            ui.label("Or find it automatically:").classes("soft")
            way = ui.select(_WAYS, label="from", value="motion").props("outlined dense options-dense")
            way.style("min-width: 160px")
            find = ui.button("Find the offsets", on_click=lambda: self.start(way.value)).props("outline")
            self.watch = CommandWatch(self.session, "sync", self.show_answer, words="looking for the offsets")
            self.watch.buttons = [find]
            self.watch.says.style("white-space: pre-line")
        self.evidence = ui.element("div").classes("row-line")
        self.choose(1)

    def choose(self, other: int) -> None:
        """Show another camera beside the clock."""
        self.other, self.at = other, [self.at[0], 0]
        self.events = self._kept()
        self.right.clear()
        with self.right:
            self.labels = [self.labels[0], ui.label().classes("small name")]
            self.view = CameraViews(self.shown, frame=0, camera=other, on_frame=lambda number: self.turn(1, number))
        self.show()

    def turn(self, side: int, number: int) -> None:
        """Note the picture in view."""
        self.at[side] = number
        self.show()

    def press(self, event: KeyEventArguments) -> None:
        """Add an event by key."""
        if event.action.keydown and event.key == "e":
            self.add()

    def add(self) -> None:
        """Say that both pictures show the same event."""
        self._keep([*self.events, (self.at[0], self.at[1])], "event added")

    def take_back(self) -> None:
        """Forget the last event."""
        self._keep(self.events[:-1], "event taken back")

    async def reread(self) -> None:
        """Show the events that are kept now: undo or another window may have changed them."""
        self.events = self._kept()
        self.show()

    def _keep(self, events: list[tuple[int, int]], what: str) -> None:
        with show_errors():
            known = self.session.draft(_DRAFT)
            known = known if isinstance(known, dict) else {}
            self.session.keep_draft(_DRAFT, {**known, self._both: events}, f"{what}, {self.shown.names[self.other]}")
            self.events = events
        self.show()

    def _kept(self) -> list[tuple[int, int]]:
        """Return the events of the clock and the other camera that were kept last, where their videos have them."""
        draft = self.session.draft(_DRAFT)
        events = draft.get(self._both) if isinstance(draft, dict) else None
        counts = [len(self.shown.indexes[k]) for k in (0, self.other)]
        try:
            pairs = [(int(a), int(b)) for a, b in events or ()]
        except (TypeError, ValueError):
            return []
        return [pair for pair in pairs if all(0 <= at < n for at, n in zip(pair, counts, strict=True))]

    @property
    def _both(self) -> str:
        """The two videos, and how their pictures are counted."""
        cameras = [self.session.project().cameras[k] for k in (0, self.other)]
        return ", ".join(f"{camera.video} {camera.fields}" for camera in cameras)

    def write(self) -> None:
        """Write the offset into the camera's table."""
        offset_s, sd_s = self.offset()
        table = self.session.project().cameras[self.other]
        cameras: list[dict[str, object]] = [{"video": each.video} for each in self.session.project().cameras]
        cameras[self.other] |= {"offset_s": round(offset_s, 6), "offset_sd_s": round(sd_s, 6)}
        with show_errors():
            what = f"offset of {table.name}: {1e3 * offset_s:+.1f} ms"
            self.session.edit_trial(lambda text: with_cameras(text, self.session.folder.name, cameras), what)
            ui.notify(f"written: {what}", type="positive")

    def offset(self) -> tuple[float, float]:
        """Return what to add to the other camera's times, and its deviation [s]."""
        here, there = self.shown.sources[0], self.shown.sources[self.other]
        pairs = [(here.trial_time(self.time(0, a)), self.time(self.other, b)) for a, b in self.events]
        offsets = [float(a - there.trial_time(b)) + there.offset_s for a, b in pairs]
        periods = [1 / float(self.shown.indexes[k].facts.image_rate) for k in (0, self.other)]
        sd_s = np.hypot(periods[0], periods[1]) / np.sqrt(12)  # an event lies anywhere in its picture's period
        sds = np.full(len(pairs), sd_s)
        offset_s, sd_s, *_ = fit_line(np.zeros(len(pairs)), np.array(offsets), sds, with_drift=False)
        return offset_s, sd_s

    async def show_moment(self) -> None:
        """Step the other camera to what it saw when the clock's picture was taken, by the offset that the trial has."""
        shown = await work("indexing the videos", self.session.shown)  # with the offsets of now
        if shown is None:
            return
        here, there = shown.sources[0], shown.sources[self.other]
        moment = here.trial_time(self.time(0, self.at[0]))
        pictures = range(len(self.shown.indexes[self.other]))
        times = [abs(there.trial_time(self.time(self.other, number)) - moment) for number in pictures]
        self.view.go(times.index(min(times)))

    def time(self, camera: int, number: int) -> Fraction:
        """Return when a camera's picture was taken, since its first."""
        times, unit = self.shown.indexes[camera].times()
        return Fraction(int(times[number]), unit)

    def show(self) -> None:
        """Show pictures' numbers, and what the events say."""
        for side, camera in enumerate((0, self.other)):
            if side < len(self.labels):
                clock = ", the clock" if camera == 0 else ""
                time_s = float(self.time(camera, self.at[side]))
                text = f"{self.shown.names[camera]}{clock}: picture {self.at[side]}, {time_s:.3f} s"
                self.labels[side].set_text(text)
        self.use.set_visibility(bool(self.events))
        if not self.events:
            camera = self.session.project().cameras[self.other]
            sd = f" ± {1e3 * camera.offset_sd_s:.1f}" if camera.offset_sd_s else ""  # 0 where nobody estimated it
            self.says.set_text(f"The trial has {1e3 * camera.offset_s:+.1f}{sd} ms for {camera.name}.")
            return
        offset_s, sd_s = self.offset()
        text = f"{count(len(self.events), 'event')}: {1e3 * offset_s:+.1f} ± {1e3 * sd_s:.1f} ms"
        self.says.set_text(text)

    def start(self, way: str) -> None:
        """Start `airborne sync`."""
        trial = self.session.path.name
        self.watch.start("sync", trial, "--by", way, writes=trial, what="offsets found")

    async def show_answer(self, command: Command) -> None:
        """Show what it has found, and the two pictures of one moment by that."""
        self.watch.says.set_text(command.output().strip())
        await self.show_moment()
        await self.show_curves(next((way for way in WAYS if f"--by {way}" in command.line), None))

    async def show_curves(self, way: str | None) -> None:
        """Show what the cameras saw or heard about the moment that tells most, on the clock that was found."""
        self.evidence.clear()
        if way is None:
            return
        curves = await work("reading the curves", lambda: level_curves(way, self.session.shown().sources))
        if curves is not None:
            with self.evidence:
                ui.html(curves_svg(curves, CAMERA_COLOURS), sanitize=False)
                with ui.element("div"):
                    ui.label(f"{WAYS[way]}, one second of it: the curves must rise together").classes("small soft")
                    for name, colour in zip(self.shown.names, CAMERA_COLOURS, strict=False):
                        with ui.element("div").classes("row-line small"):
                            ui.element("span").style(f"width: 22px; height: 3px; background: {colour}")
                            ui.label(name)
