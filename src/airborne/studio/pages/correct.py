"""Correct a run: grab a joint in a view and drag it; that is a key at this frame, from which it is tracked again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from nicegui import ui

from airborne.cameras import read_rig
from airborne.errors import TrialError
from airborne.motion.run_folder import CALIBRATION
from airborne.studio.commands import STOPPED, Command
from airborne.studio.outlines import run_body, run_motion
from airborne.studio.pages.layout import complain, errors_shown
from airborne.studio.pictures import ShownTrial
from airborne.studio.session import Session
from airborne.studio.trial_edits import with_click
from airborne.studio.view import CameraViews, Mark
from airborne.trial.settings import KEY_METHODS

_JOINT_COLOUR, _CLICK_COLOUR = "#ffffff", "#f0e442"
_LOOK_EVERY_S = 0.5  # at a run that goes on


class Correction:
    """One window's corrections of a run of one body; they are written into the trial as they are made."""

    def __init__(self, session: Session, shown: ShownTrial, folder: Path) -> None:
        """Begin with nothing to grab, until the switch is on."""
        self.session, self.shown, self.folder = session, shown, folder
        self.view: CameraViews | None = None
        self.command: Command | None = None

    def build(self) -> None:
        """Lay out the switch, the button that tracks again, and what there is to say."""
        with ui.element("div").classes("row-line"):
            self.switch = ui.switch("Correct", on_change=lambda: self.turn_to(self.session.frame))
            self.again = ui.button("Track again around it", on_click=self.track).props("unelevated")
            self.says = ui.label().classes("small soft")
        self.again.set_visibility(False)
        ui.timer(_LOOK_EVERY_S, self.look)

    def turn_to(self, frame: int) -> None:
        """Show the joints of a frame, to be grabbed."""
        if self.view is not None:
            with errors_shown():
                self.view.show_over(self._marks(frame) if self.switch.value else [], [])

    def move(self, mark: str, u: float, v: float) -> None:
        """Write where a joint was dragged to as a click of the frame's key."""
        name, camera = mark.rsplit("|", 1)
        frame = self.session.frame
        with errors_shown():
            trial = self.session.project().trial()
            if frame <= trial.start.frame:
                raise TrialError(f"frame {trial.start.frame} is the start; correct it in the step First pose")
            if trial.track.method not in KEY_METHODS:
                raise TrialError(f"method '{trial.track.method}' reads no corrections; use {', '.join(KEY_METHODS)}")
            what = f"{name} corrected in {camera}, frame {frame}"
            self.session.edit_trial(lambda text: with_click(text, frame, name, camera, (u, v)), what)
            self.says.set_text(what)
            self.again.set_visibility(True)
        self.turn_to(frame)

    def track(self) -> None:
        """Track again what the corrections touch, as `airborne track --resume` does."""
        running = self.session.commands.get("track")
        if running is not None and running.is_running:
            complain("a run is being tracked; wait for its end, or stop it in the step Track")
            return
        words = ["track", self.session.path.name, "-o", self.folder.name, "--resume"]
        self.command = self.session.commands["track"] = Command(words, self.session.folder)
        self.again.set_visibility(False)

    def look(self) -> None:
        """Say how the tracking goes, and show what came of it."""
        if self.command is None:
            return
        if self.command.is_running:
            self.says.set_text(f"tracking again, {self.command.seconds:.0f} s")
            return
        command, self.command = self.command, None
        if command.code in (0, STOPPED):
            self.says.set_text("tracked again" if command.code == 0 else "stopped")
        else:
            self.says.set_text("")
            complain(command.complaint())
        if self.view is not None:
            self.view.run_method("refresh")
        self.turn_to(self.session.frame)

    def _marks(self, frame: int) -> list[Mark]:
        """Return the landmarks of the run in every view, in their place those that the frame's key has clicked."""
        motion, model = run_motion(self.folder), run_body(self.folder)
        rows = np.flatnonzero((motion.index == frame) & motion.has_pose)
        rig = read_rig(self.folder / CALIBRATION).select(self.shown.names)
        points = np.full((len(model.landmarks), 3), np.nan)
        if len(rows):
            points = model.with_pose(motion.pose(rows[0])).landmarks
        keys = self.session.project().tables.get("key", [])
        clicked = next((key.get("points_px") for key in keys if key.get("frame") == frame), None)
        marks: list[Mark] = []
        for landmark, point in zip(model.landmarks, points, strict=True):
            own = clicked.get(landmark.name, {}) if isinstance(clicked, dict) else {}
            for pane, camera in enumerate(rig):
                u, v = map(float, own.get(camera.name, camera.px_from_world(point)))
                if np.isfinite([u, v]).all():
                    mark: Mark = {"id": f"{landmark.name}|{camera.name}", "pane": pane, "u": u, "v": v}
                    colour, label = (_CLICK_COLOUR, landmark.name) if camera.name in own else (_JOINT_COLOUR, "")
                    marks.append({**mark, "label": label, "colour": colour})
        return marks
