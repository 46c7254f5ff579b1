"""Correct a run: grab a joint in a view and drag it; that is a key at this frame, from which it is tracked again."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
from nicegui import ui

from airborne.body import Pose
from airborne.cameras import Camera
from airborne.errors import TrialError
from airborne.studio.commands import Command
from airborne.studio.dragging import landmarks_of_grip, landmarks_px
from airborne.studio.ghosts import ghost_of
from airborne.studio.pages.command_watch import CommandWatch
from airborne.studio.pages.mask_cameras import Entry, MaskPanel
from airborne.studio.pages.pose_hand import PoseHand
from airborne.studio.pages.run_watch import RunWatch
from airborne.studio.pages.slow_work import in_thread, show_errors
from airborne.studio.pictures import ShownTrial
from airborne.studio.runs import count_frames, count_rows, describe_progress, run_body, run_rig, run_rows
from airborne.studio.session import Session
from airborne.studio.starts import POSE_COLOUR
from airborne.studio.tracked_again import RunBefore, describe_pending, describe_tracked_again, name_frames
from airborne.studio.trial_edits import with_clicks, with_key, without_key
from airborne.studio.view import CameraViews, Drag, Mark
from airborne.trial.keys import KeyTable
from airborne.trial.settings import KEY_METHODS
from airborne.types import Array

_JOINT_COLOUR, _CLICK_COLOUR, _GHOST_COLOUR = "#ffffff", "#f0e442", "#ffffff"
_HINT = "Drag a joint, or the body by its outline; Shift turns it. Then track again."


class Correction:
    """One window's corrections of a run of one body; they are written into the trial as they are made."""

    def __init__(self, session: Session, shown: ShownTrial, files: RunWatch) -> None:
        """Begin with nothing to grab, until the switch is on."""
        self.session, self.shown, self.folder, self._files = session, shown, files.folder, files
        self.view: CameraViews | None = None
        self._before: RunBefore | None = None  # the run when this window tracked it again
        cameras = run_rig(self.folder).select(shown.names).cameras
        self.hand = PoseHand(run_body(self.folder), cameras, lambda pose: self._marks(pose, {}))
        self._seen = self._asked = self._held()  # when this window looked last, and tracked last
        self._tracked: tuple[Any, Any] | None = self._seen  # what the run was tracked with; None: something else

    @property
    def frame(self) -> int:
        """The frame in view in this window."""
        return self.session.frame if self.view is None else self.view.frame

    def build(self) -> None:
        """Lay out the switch, and what leaves a camera out."""
        with ui.element("div").classes("row-line"):
            self.switch = ui.switch("Correct", on_change=lambda: self.turn_to(self.frame))
        self.masks = MaskPanel(self.session, self.shown, lambda: self.frame, self._note_change, self._keys)
        self.masks.area.bind_visibility_from(self.switch, "value")

    def _keys(self) -> Iterator[Entry]:
        for key in self.session.project().tables.get("key", []):
            if isinstance(key, dict) and isinstance(frame := key.get("frame"), int):
                yield Entry(f"frame {frame}", "drop this correction", partial(self.drop, frame))

    def drop(self, frame: int) -> None:
        """Take a frame's key out of the trial."""
        with show_errors():  # also where the method reads none, or the start is another by now
            self.session.edit_trial(lambda text: without_key(text, frame), f"correction of frame {frame} dropped")
            self._note_key(f"correction of frame {frame} dropped")

    def build_watch(self) -> None:
        """Lay out the button that tracks again, and what there is to say: where the pictures do not shrink for it."""
        with ui.element("div").classes("row-line"):
            self.again = ui.button("Track again around it", on_click=self.track).props("unelevated")
            self.watch = CommandWatch(self.session, "track", self.show_anew, words="tracking", how_far=self._how_far)
            self.watch.buttons = [self.again]
        self.pending = ui.label().classes("small warn")
        self.pending.bind_visibility_from(self.pending, "text")
        self.hint = ui.label().classes("small")
        self._show_pending()
        if self.pending.text:
            self._tracked = None
        self.again.set_visibility(self._tracked is None)

    def _show_hint(self) -> None:
        """Say how to correct until something is corrected: beside the scene there is little room."""
        self.hint.set_visibility(bool(self.switch.value) and not (self.pending.text and self.hint.text == _HINT))

    def _show_pending(self) -> None:
        """Name the corrections that the run was tracked without, and what tracking again goes over."""
        project = self.session.project()
        is_whole = not project.mistake and not self.watch.is_running
        with show_errors():
            self.pending.set_text(describe_pending(project.trial(), self.folder) if is_whole else "")
        self._show_hint()

    def _how_far(self) -> str:
        """Say how many frames the run has while it is tracked again."""
        command = self.watch.command
        if command is None or self._before is None or not self._before.is_changed(self.folder):
            return describe_progress(0, 1)
        n_frames = count_frames(self.session.project().trial(), len(self.shown.clock))
        n_done = command.n_done()  # none while it opens the videos, whatever the run has kept
        return describe_progress(max(count_rows(self.folder)[0], n_done) if n_done else 0, n_frames)

    async def turn_to(self, frame: int) -> None:
        """Show the body of a frame and its joints, to be grabbed."""
        if self.view is None:
            return
        with show_errors():
            pose, self.hand.colour, hint = self._pose(frame) if self.switch.value else (None, POSE_COLOUR, "")
            await self.hand.place_next(pose)
            self.hint.set_text(hint)
            self._show_hint()
            self._show(frame)

    def _pose(self, frame: int) -> tuple[Pose | None, str, str]:
        """Return what can be grabbed in a frame, its colour, and what there is to do."""
        rows = run_rows(self.folder)
        if rows.row(frame) is None:
            if self.watch.is_running:
                return None, POSE_COLOUR, "This frame is tracked again."
            return None, POSE_COLOUR, f"The run has {name_frames(rows.index)}; go to one of them to correct it."
        if (pose := rows.pose(frame)) is not None:
            return pose, POSE_COLOUR, _HINT
        ghost = ghost_of(rows, frame)
        if ghost is None:
            return None, POSE_COLOUR, "The body is lost in all frames of the run; correct the first pose."
        return ghost[0], _GHOST_COLOUR, _describe_ghost(frame, ghost[1])

    async def reread(self) -> None:
        """Show what the trial holds now: undo or another window may have changed it."""
        self.masks.list.refresh()
        held = self._held()
        if held == self._seen:
            self._show(self.frame)
            return
        self._seen = held
        self.watch.says.set_text("")
        self._show_pending()
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
            items = [*self.masks.items(frame), *self.hand.items()]
            self.view.show_over(marks, sorted(items, key=lambda item: "text" in item))  # which lie above

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
            clicks = dict(landmarks_px(self.hand.model, pose, camera, names))
            if clicks:
                self._write(drag.frame, clicks, camera.name, self.hand.model.segments[grip.segment].name)
            else:  # none is in this picture, or the thing has none
                self._write_place(drag.frame, pose)

    def _write_turn(self, frame: int, pose: Pose) -> None:
        """Write the body's orientation into the frame's key."""
        x, y, z, w = (round(float(each), 5) for each in pose.world_from_root.rotation.as_quat())
        others = {"rotation_matrix": None, "somersault_tilt_twist_deg": None}
        values = {**others, "quaternion_xyzw": [x, y, z, w]}
        sd = _default_sd("sd_deg")
        self._edit(frame, lambda text: with_key(text, frame, values), f"body turned, frame {frame}", f", ± {sd:g}°")

    def _write_place(self, frame: int, pose: Pose) -> None:
        """Write the body's place into the frame's key."""
        values = {"position_m": [round(float(each), 4) for each in pose.world_from_root.translation]}
        sd_mm = 1e3 * _default_sd("sd_m")
        self._edit(frame, lambda text: with_key(text, frame, values), f"body moved, frame {frame}", f", ± {sd_mm:g} mm")

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
        with show_errors():
            trial = self.session.project().trial()
            if frame <= trial.start.frame:
                raise TrialError(f"frame {trial.start.frame} is the start; correct it in the step First pose")
            if trial.track.method not in KEY_METHODS:
                raise TrialError(f"method '{trial.track.method}' reads no corrections; use {', '.join(KEY_METHODS)}")
            self.session.edit_trial(change, what)
            self._note_key(what + sd)

    def _note_key(self, what: str) -> None:
        self.masks.list.refresh()
        self._note_change(what)

    def _note_change(self, what: str) -> None:
        """Say what was written, and offer to track again."""
        self._seen = self._held()
        self.watch.says.set_text(what)
        self._show_pending()
        self.again.set_visibility(True)
        self._show(self.frame)

    def track(self) -> None:
        """Track again what the corrections touch, as `airborne track --resume` does."""
        self._asked = self._held()
        with show_errors():
            self._before = RunBefore.of(self.folder)
        self.watch.start("track", self.session.path.name, "-o", self.folder.name, "--resume")
        self._show_pending()

    async def show_anew(self, command: Command) -> None:
        """Show what came of it."""
        if self.folder.name not in command.words:  # another run
            return
        await self._files.look()
        self._tracked = self._asked
        self._show_pending()
        self.again.set_visibility(self._held() != self._tracked)
        before, text = self._before, "tracked again"
        with show_errors():
            if before is not None:
                trial = self.session.project().trial()
                text = await in_thread(describe_tracked_again, before, self.folder, trial, says="reading the run")
        self.watch.says.set_text(text)

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


def _describe_ghost(frame: int, where: str) -> str:
    """Say what a body in a frame in which it is lost is."""
    return (
        f"Frame {frame} is lost. The white outline is a guess, {where}. Drag it to where the pictures show the body, "
        "in two of them if you can; Shift turns it. Then track again around it."
    )


def _default_sd(key: str) -> float:
    """Return the deviation that a key has where it names none."""
    return float(KeyTable.model_fields[key].default)


def _across(camera: Camera, pose: Pose | None, sd_px: float) -> str:
    """Say how far across the line of sight a deviation is at the body."""
    if pose is None:
        return ""
    depth_m = camera.camera_from_world.apply(pose.world_from_root.translation)[2]
    return f" ({1e3 * sd_px * depth_m / camera.K[0, 0]:.0f} mm at the body)"
