"""Correct a run: grab a joint in a view and drag it; that is a key at this frame, from which it is tracked again."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from nicegui import ui

from airborne.body import Pose
from airborne.cameras import Camera
from airborne.errors import TrialError
from airborne.studio.commands import Command
from airborne.studio.dragging import landmarks_of_grip, landmarks_px
from airborne.studio.pages.command_watch import CommandWatch
from airborne.studio.pages.layout import errors_shown, in_thread
from airborne.studio.pages.mask_cameras import MaskPanel
from airborne.studio.pages.pose_hand import PoseHand
from airborne.studio.pictures import ShownTrial
from airborne.studio.runs import count_rows, run_body, run_rig, run_rows
from airborne.studio.session import Session
from airborne.studio.trial_edits import with_clicks, with_key
from airborne.studio.view import CameraViews, Curves, Drag, Mark
from airborne.trial.keys import KeyTable
from airborne.trial.settings import KEY_METHODS
from airborne.types import Array

_LOOK_EVERY_S = 1.0  # at a run that is tracked again
_JOINT_COLOUR, _CLICK_COLOUR = "#ffffff", "#f0e442"


class Correction:
    """One window's corrections of a run of one body; they are written into the trial as they are made."""

    def __init__(self, session: Session, shown: ShownTrial, folder: Path) -> None:
        """Begin with nothing to grab, until the switch is on."""
        self.session, self.shown, self.folder = session, shown, folder
        self.view: CameraViews | None = None
        self.curves: Curves | None = None
        self._n_rows = count_rows(folder)[0]  # that are shown
        cameras = run_rig(folder).select(shown.names).cameras
        self.hand = PoseHand(run_body(folder), cameras, lambda pose: self._marks(pose, {}))
        self._seen = self._tracked = self._held()  # when this window looked last; when it last tracked

    @property
    def frame(self) -> int:
        """The frame in view in this window."""
        return self.session.frame if self.view is None else self.view.frame

    def build(self) -> None:
        """Lay out the switch, and what leaves a camera out."""
        with ui.element("div").classes("row-line"):
            self.switch = ui.switch("Correct", on_change=lambda: self.turn_to(self.frame))
        self.masks = MaskPanel(self.session, self.shown, lambda: self.frame, self._note_change)
        self.masks.area.bind_visibility_from(self.switch, "value")

    def build_watch(self) -> None:
        """Lay out the button that tracks again, and what there is to say: where the pictures do not shrink for it."""
        with ui.element("div").classes("row-line"):
            self.again = ui.button("Track again around it", on_click=self.track).props("unelevated")
            self.watch = CommandWatch(self.session, "track", self.show_anew, words="tracking")
            self.watch.buttons = [self.again]
        self.again.set_visibility(False)
        ui.timer(_LOOK_EVERY_S, self.look)

    async def look(self) -> None:
        """Show what the run has tracked again since, while it goes on."""
        if self.watch.is_running:
            n_rows, _ = await in_thread(count_rows, self.folder, says="")
            if n_rows != self._n_rows:
                self._n_rows = n_rows
                self._refresh()

    def _refresh(self) -> None:
        if self.view is not None and self.curves is not None:
            self.view.run_method("refresh")
            self.curves.run_method("load")

    async def turn_to(self, frame: int) -> None:
        """Show the body of a frame and its joints, to be grabbed."""
        if self.view is None:
            return
        with errors_shown():
            await self.hand.place_next(run_rows(self.folder).pose(frame) if self.switch.value else None)
            self._show(frame)

    async def reread(self) -> None:
        """Show what the trial holds now: undo or another window may have changed it."""
        self.masks.list.refresh()
        held = self._held()
        if held == self._seen:
            self._show(self.frame)
            return
        self._seen = held
        self.watch.says.set_text("" if held == self._tracked else "the corrections have changed")
        self.again.set_visibility(held != self._tracked)
        await self.turn_to(self.frame)

    def _held(self) -> tuple[Any, Any]:
        """Return the keys and masks that the trial holds."""
        tables = self.session.project().tables
        return tables.get("key"), tables.get("mask")

    def _show(self, frame: int) -> None:
        if self.view is not None:
            is_on = bool(self.switch.value)
            marks = self._marks(self.hand.pose, self._clicks_of_key(frame)) if is_on else []
            self.view.show_over(marks, [*self.masks.items(frame), *self.hand.items()])

    def move(self, mark: str, u: float, v: float) -> None:
        """Write where a joint is as a click of the frame's key."""
        name, camera = mark.rsplit("|", 1)
        self._write(self.frame, {name: np.array([u, v])}, camera, name)

    async def drag(self, drag: Drag) -> None:
        """Let the body follow the pointer; at the end, write what was moved into the frame's key."""
        if self.view is None or not await self.hand.follow(self.view, drag) or not drag.has_ended:
            return
        camera, pose, grip = self.hand.cameras[drag.pane], self.hand.pose, self.hand.grip
        assert pose is not None and grip is not None
        if drag.mark is not None:
            name = drag.mark.rsplit("|", 1)[0]
            self._write(drag.frame, {name: np.array(drag.px)}, camera.name, name)
        elif drag.turns:
            self._write_turn(drag.frame, pose)
        else:
            names = landmarks_of_grip(self.hand.model, grip)
            clicks = landmarks_px(self.hand.model, pose, camera, names)
            self._write(drag.frame, dict(clicks), camera.name, self.hand.model.segments[grip.segment].name)

    def _write_turn(self, frame: int, pose: Pose) -> None:
        """Write the body's orientation into the frame's key."""
        x, y, z, w = (round(float(each), 5) for each in pose.world_from_root.rotation.as_quat())
        others = {"rotation_matrix": None, "somersault_tilt_twist_deg": None}
        values = {**others, "quaternion_xyzw": [x, y, z, w]}
        sd = _default_sd("sd_deg")
        self._edit(frame, lambda text: with_key(text, frame, values), f"body turned, frame {frame}", f", ± {sd:g}°")

    def _write(self, frame: int, clicks: dict[str, Array], camera: str, what: str) -> None:
        """Write where a camera sees landmarks of the body into the frame's key."""
        sd_px = _default_sd("sd_px")
        view = next(each for each in self.hand.cameras if each.name == camera)
        plain = {name: px.tolist() for name, px in clicks.items()}
        self._edit(
            frame,
            lambda text: with_clicks(text, frame, camera, plain),
            f"{what} corrected in {camera}, frame {frame}",
            f", ± {sd_px:g} px{_across(view, self.hand.pose, sd_px)}",
        )

    def _edit(self, frame: int, change: Callable[[str], str], what: str, sd: str) -> None:
        with errors_shown():
            trial = self.session.project().trial()
            if frame <= trial.start.frame:
                raise TrialError(f"frame {trial.start.frame} is the start; correct it in the step First pose")
            if trial.track.method not in KEY_METHODS:
                raise TrialError(f"method '{trial.track.method}' reads no corrections; use {', '.join(KEY_METHODS)}")
            self.session.edit_trial(change, what)
            self._note_change(what + sd)

    def _note_change(self, what: str) -> None:
        """Say what was written, and offer to track again."""
        self._seen = self._held()
        self.watch.says.set_text(what)
        self.again.set_visibility(True)
        self._show(self.frame)

    def track(self) -> None:
        """Track again what the corrections touch, as `airborne track --resume` does."""
        self._tracked = self._held()
        self.watch.start("track", self.session.path.name, "-o", self.folder.name, "--resume")
        self.again.set_visibility(False)

    async def show_anew(self, command: Command) -> None:
        """Show what came of it."""
        self.watch.says.set_text("tracked again")
        self._refresh()
        await self.turn_to(self.frame)

    def _clicks_of_key(self, frame: int) -> dict[str, Any]:
        """Return the clicks that the frame's key holds: landmark -> camera -> (2,) [px]."""
        keys = self.session.project().tables.get("key", [])
        clicked = next((key.get("points_px") for key in keys if key.get("frame") == frame), None)
        return clicked if isinstance(clicked, dict) else {}

    def _marks(self, pose: Pose | None, clicked: dict[str, Any]) -> list[Mark]:
        """Return the landmarks of a pose in every view, in their place those that are clicked."""
        model = self.hand.model
        points = np.full((len(model.landmarks), 3), np.nan) if pose is None else model.with_pose(pose).landmarks
        marks: list[Mark] = []
        for landmark, point in zip(model.landmarks, points, strict=True):
            own = clicked.get(landmark.name, {})
            for pane, camera in enumerate(self.hand.cameras):
                u, v = map(float, own.get(camera.name, camera.px_from_world(point)))
                if np.isfinite([u, v]).all():
                    mark: Mark = {
                        "id": f"{landmark.name}|{camera.name}",
                        "pane": pane,
                        "u": u,
                        "v": v,
                        "holds": pose is not None,
                    }
                    colour, label = (_CLICK_COLOUR, landmark.name) if camera.name in own else (_JOINT_COLOUR, "")
                    marks.append({**mark, "label": label, "colour": colour})
        return marks


def _default_sd(key: str) -> float:
    """Return the deviation that a key has where it names none."""
    return float(KeyTable.model_fields[key].default)


def _across(camera: Camera, pose: Pose | None, sd_px: float) -> str:
    """Say how far across the line of sight a deviation is at the body."""
    if pose is None:
        return ""
    depth_m = camera.camera_from_world.apply(pose.world_from_root.translation)[2]
    return f" ({1e3 * sd_px * depth_m / camera.K[0, 0]:.0f} mm at the body)"
