"""The step First pose: the body is looked for, or its landmarks are clicked with the epipolar curves' help."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from nicegui import ui
from nicegui.events import KeyEventArguments
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Pose
from airborne.cameras import Rig
from airborne.cameras.epipolar import epipolar_curve
from airborne.errors import AirborneError, TrialError
from airborne.io.text import read_json
from airborne.motion.run_folder import CANDIDATES
from airborne.studio.clicks import Clicked, read_clicked
from airborne.studio.commands import STOPPED, Command
from airborne.studio.outlines import outline_items
from airborne.studio.pages.layout import Latest, complain, errors_shown, framed, in_thread, work
from airborne.studio.pages.point_list import PointList
from airborne.studio.pictures import ShownTrial
from airborne.studio.session import Session
from airborne.studio.view import Item, Mark, View
from airborne.studio.writing import FOLDER
from airborne.tracking.first_pose import fit_to_pixels

POINTS = "start_points.csv"
_CLICK_SD_PX = 1.0  # of a careful click, right and down: the band is two of these
_COLOURS = ("#56b4e9", "#e69f00", "#cc79a7", "#009e73", "#f0e442", "#d55e00")  # of cameras, in order
_POSE_COLOUR = "#f0e442"
_NEEDED = ("hip_left", "hip_right", "shoulder_left", "shoulder_right")
_UNDECIDED = 3  # the exit code of `airborne find`
_BY_HAND = ("position_m", "rotation_matrix", "quaternion_xyzw", "somersault_tilt_twist_deg", "joint_angles_deg")
_OTHER_WAYS = (*_BY_HAND, "find", "joints_m", "points_px", "detections", "detections_cameras")
_FIND_HELP = "The body is looked for where it stands out from the empty scene, which takes a minute or two."
_CLICK_HELP = (
    "Choose a landmark and click it in two cameras or more. A click draws, in the others, the curve on which the "
    "landmark lies, two standard deviations wide. Both hips and both shoulders are needed; limbs follow their clicks."
)


async def first_pose_page(session: Session) -> None:
    """Let the user find or click the pose at one frame, and write it into the trial."""
    project = session.project()
    async with framed(session, "First pose", "Where is the body at the start?", "") as changed:
        missing = [name for name in ("camera", "calibration", "body") if not project.tables.get(name)]
        if missing:
            ui.label(f"This step needs the steps before it: {', '.join(missing)}.").classes("warn")
            return
        shown = await work("indexing the videos", session.shown)
        rig = await work("calibrating the cameras", session.rig)
        try:
            model = await in_thread(project.model)
        except AirborneError as error:
            complain(error)
            return
        if shown is None or rig is None:
            return
        panel = _Panel(session, shown, rig, model, _read_points(session), _stored_pose(session))
        panel.build()
        await panel.update()
        changed.append(panel.reread)


@dataclass(eq=False)
class _Panel:
    """One window's work at the first pose."""

    session: Session
    shown: ShownTrial
    rig: Rig
    model: BodyModel
    clicked: Clicked
    pose: Pose | None  # to be shown
    chosen: str = ""  # the landmark that the next click sets
    selected: str | None = None  # the mark that arrow keys move: "landmark|camera"
    says: str = ""
    candidates: tuple[dict[str, Any], ...] = ()  # where `find` was undecided
    found: dict[str, Any] | None = None  # the [start] to write for the pose that is shown
    outline: list[dict[str, Any]] = field(default_factory=list)  # of the pose
    latest: Latest = field(default_factory=Latest)

    @property
    def landmarks(self) -> list[str]:
        """The landmarks that can be clicked, those that are needed first."""
        names = [landmark.name for landmark in self.model.landmarks]
        needed = [name for name in _NEEDED if name in names]
        return [*needed, *(name for name in names if name not in needed)]

    def build(self) -> None:
        """Lay out the pictures and what can be done."""
        has_joints = self.model.has_joints
        ui.label(_CLICK_HELP if has_joints else _FIND_HELP).classes("help")
        with ui.element("div").classes("split"):
            with ui.element("div").classes("wide"):
                self.view = View(
                    self.shown,
                    frame=int(self.session.project().table("start").get("frame", self.session.frame)),
                    on_frame=self.turn_to,
                    on_pick=self.pick,
                    on_move=self.move,
                    on_select=self.select,
                )
            with ui.element("div").classes("side"):
                with ui.element("div").classes("card"):
                    if not has_joints:
                        self._build_search()
                    self.note = ui.label().classes("small")
                    self.use = ui.button("Use this pose", on_click=self.write).props("unelevated")
                    if has_joints:
                        ui.button("Take the chosen click back", on_click=self.remove).props("flat dense")
                if has_joints:
                    self.chosen = self.landmarks[0]
                    self.view.start_picking()
                    ui.keyboard(on_key=self.step)
                    self.list = PointList(self.shown.names, self.choose)
        self.timer = ui.timer(0.5, self.watch_search, active="find" in self.session.commands)

    def _build_search(self) -> None:
        with ui.element("div").classes("row-line"):
            self.find = ui.button("Find it", on_click=self.search).props("unelevated")
            self.spinner = ui.spinner()
            self.seconds = ui.label().classes("small")
            self.halt = ui.button("Stop", on_click=self.stop_search).props("flat dense")
        self.choices = ui.refreshable(self._list_candidates)
        self.choices()
        self._show_search()

    def _show_search(self) -> None:
        """Show the buttons that the search has now."""
        command = self.session.commands.get("find")
        is_running = command is not None and command.is_running
        self.find.set_visibility(not is_running)
        for each in (self.spinner, self.seconds, self.halt):
            each.set_visibility(is_running)
        self.seconds.set_text(f"looking for the body: {command.seconds:.0f} s" if command is not None else "")

    def turn_to(self, frame: int) -> None:
        """Note the frame in view."""
        self.session.frame = frame

    async def reread(self) -> None:
        """Show the clicks that the file holds now."""
        clicked = _read_points(self.session)
        if clicked.text(self.shown.names) != self.clicked.text(self.shown.names):
            self.clicked = clicked
            await self.fit()

    # looking for it

    def search(self) -> None:
        """Start `airborne find`."""
        command = self.session.commands.get("find")
        if command is not None and command.is_running:
            return
        words = ["find", self.session.path.name, "-o", f"{FOLDER}/find", "--json"]
        self.session.commands["find"] = Command(words, self.session.folder)
        self.timer.activate()
        self._show_search()

    async def stop_search(self) -> None:
        """Stop the search."""
        command = self.session.commands.get("find")
        if command is not None:
            await in_thread(command.stop)

    async def watch_search(self) -> None:
        """Look whether the search has ended, and show what it found."""
        command = self.session.commands.get("find")
        self._show_search()
        if command is None or command.is_running:
            return
        self.timer.deactivate()
        del self.session.commands["find"]
        if command.code == 0:
            found = json.loads(command.output())
            self.says = found.pop("note")
            found.pop("probability")
            await self.show_found(found)
        elif command.code == _UNDECIDED:
            document = read_json(self.session.folder / FOLDER / "find" / CANDIDATES)
            self.candidates = tuple({**each, "frame": document["frame"]} for each in document["candidates"])
            self.says = "The pictures do not decide between these poses; choose the right one."
            await self.take(0)
        elif command.code == STOPPED:
            self.says = "stopped"
        else:
            complain(command.complaint())
        self.choices.refresh()
        await self.update()

    async def take(self, number: int) -> None:
        """Show one of the candidates."""
        each = self.candidates[number]
        await self.show_found({key: each[key] for key in ("frame", "position_m", "quaternion_xyzw")})

    async def show_found(self, start: dict[str, Any]) -> None:
        """Show a pose that was found."""
        self.found, self.pose = start, _pose_of(start)
        self.view.go(int(start["frame"]))
        await self.update()

    # clicking it

    async def pick(self, pane: int, u: float, v: float, near: str | None) -> None:
        """Set the chosen landmark in a camera; where it is set already, a click close to a mark chooses that."""
        camera = self.shown.names[pane]
        if near is not None and np.isfinite(self._at(self.chosen, camera)[0]):
            await self.select(near)
            return
        self.save(self.clicked.click(self.chosen, camera, (u, v)), f"{self.chosen} clicked in {camera}")
        self.selected = f"{self.chosen}|{camera}"
        await self.fit()

    async def move(self, mark: str, u: float, v: float) -> None:
        """Move a click."""
        name, camera = mark.rsplit("|", 1)
        self.save(self.clicked.click(name, camera, (u, v)), f"{name} moved in {camera}")
        self.chosen, self.selected = name, mark
        await self.fit()

    async def select(self, mark: str | None) -> None:
        """Choose a mark, or none."""
        self.selected = mark
        if mark is not None:
            self.chosen = mark.rsplit("|", 1)[0]
        self.show()

    async def choose(self, name: str) -> None:
        """Choose the landmark that the next clicks set."""
        self.chosen, self.selected = name, None
        self.show()

    async def step(self, event: KeyEventArguments) -> None:
        """Choose the next landmark, or the one before."""
        if event.action.keydown and event.key in ("n", "p"):
            row = self.landmarks.index(self.chosen) + (1 if event.key == "n" else -1)
            await self.choose(self.landmarks[row % len(self.landmarks)])

    async def remove(self) -> None:
        """Take the chosen click back."""
        if self.selected is None:
            complain("choose a click first: click on its mark")
            return
        name, camera = self.selected.rsplit("|", 1)
        self.save(self.clicked.click(name, camera, (np.nan, np.nan)), f"{name} taken back in {camera}")
        self.selected = None
        await self.fit()

    def save(self, clicked: Clicked, what: str) -> None:
        """Write the clicks beside the trial."""
        with errors_shown():
            self.session.edit(POINTS, clicked.text(self.shown.names), what)
            self.clicked = clicked

    async def fit(self) -> None:
        """Fit the body to the clicks, or say what is missing; the clicks are shown at once."""
        self.found, self.pose, self.outline, self.says = None, None, [], "fitting the body"
        self.show()
        solved = await self.latest.do(self._solve, self.clicked)
        if solved is None:
            return
        self.pose, self.outline, self.says = solved
        if self.pose is not None:
            self.found = {"frame": self.session.frame, "points_px": POINTS}
        self.show()

    def _solve(self, clicked: Clicked) -> tuple[Pose | None, list[dict[str, Any]], str]:
        """Return the pose that the clicks give, its outline, and what the fit says."""
        px = np.stack([np.stack([clicked.at(name, camera) for camera in self.rig.names]) for name in clicked.names])
        try:
            first = fit_to_pixels(
                self.model, self.rig, "clicks", names=clicked.names, px=px, weights=np.ones(px.shape[:-1])
            )
        except AirborneError as error:
            return None, [], str(error)
        return first.pose, self._outline(first.pose), " ".join(first.notes)

    def _outline(self, pose: Pose) -> list[dict[str, Any]]:
        return outline_items(self.model.with_pose(pose), self.rig.select(self.shown.names).cameras, _POSE_COLOUR)

    # writing and showing it

    def write(self) -> None:
        """Write the pose that is shown into the trial."""
        if self.found is None:
            return
        with errors_shown():
            self.session.set_table("start", {**dict.fromkeys(_OTHER_WAYS), **self.found}, "first pose set")
            ui.notify("the first pose is written into the trial", type="positive")

    async def update(self) -> None:
        """Show all as it is now, the pose's outline too."""
        if self.pose is not None:
            self.outline = await in_thread(self._outline, self.pose)
        self.show()

    def show(self) -> None:
        """Show marks, curves, outline and buttons as they are now."""
        items: list[Any] = [*self._curves(), *self.outline] if self.model.has_joints else self.outline
        self.view.show_over(self._marks() if self.model.has_joints else (), items, self.selected)
        stored = "The outline is the pose that the trial has." if self.pose is not None and self.found is None else ""
        self.note.set_text(self.says or stored)
        self.use.set_visibility(self.found is not None)
        if self.model.has_joints:
            self.list.show(self.landmarks, self.chosen, self._off_px)

    def _curves(self) -> list[Item]:
        """Return the epipolar curves of the chosen landmark's clicks, with their bands."""
        items: list[Item] = []
        for k, camera in enumerate(self.shown.names):
            px = self._at(self.chosen, camera)
            if not np.isfinite(px).all():
                continue
            for pane, other in enumerate(self.shown.names):
                if other == camera:
                    continue
                curve, sd = epipolar_curve(self.rig[camera], px, self.rig[other], _CLICK_SD_PX)
                if len(curve) < 2:
                    continue
                tangent = np.gradient(curve, axis=0)
                across = np.stack([-tangent[:, 1], tangent[:, 0]], 1) / np.linalg.norm(tangent, axis=1, keepdims=True)
                wide = 2 * sd[:, None] * across
                band = np.concatenate([curve + wide, (curve - wide)[::-1]])
                colour = _COLOURS[k % len(_COLOURS)]
                items.append({"pane": pane, "points": band.round(2).tolist(), "closed": True, "fill": colour + "33"})
                items.append({"pane": pane, "points": curve.round(2).tolist(), "colour": colour, "width": 1})
        return items

    def _marks(self) -> list[Mark]:
        marks: list[Mark] = []
        for name in self.clicked.names:
            to = self._seen_at(name)
            for pane, camera in enumerate(self.shown.names):
                u, v = map(float, self._at(name, camera))
                if np.isfinite(u):
                    colour = _POSE_COLOUR if name == self.chosen else _COLOURS[pane % len(_COLOURS)]
                    mark: Mark = {
                        "id": f"{name}|{camera}",
                        "pane": pane,
                        "u": u,
                        "v": v,
                        "label": name,
                        "colour": colour,
                    }
                    marks.append({**mark, "to": to[pane].tolist()} if np.isfinite(to[pane]).all() else mark)
        return sorted(marks, key=lambda mark: mark.get("colour") != _POSE_COLOUR)

    def _at(self, name: str, camera: str) -> np.ndarray:
        return self.clicked.at(name, camera) if name in self.clicked.names else np.full(2, np.nan)

    def _seen_at(self, name: str) -> np.ndarray:
        """Return where the cameras see the point they agree on best: (cameras, 2) [px], NaN with fewer than two."""
        px = np.stack([self._at(name, camera) for camera in self.rig.names])
        point = self.rig.points_from_px(px)
        return np.stack([self.rig[camera].px_from_world(point) for camera in self.shown.names])

    def _off_px(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Say of a landmark whether it is clicked, and how far from where the cameras agree, in each camera [px]."""
        px = np.stack([self._at(name, camera) for camera in self.shown.names])
        return np.isfinite(px[:, 0]), np.linalg.norm(self._seen_at(name) - px, axis=1)

    def _list_candidates(self) -> None:
        for number, each in enumerate(self.candidates):
            text = f"pose {number + 1}: {each['probability']:.0%}"
            ui.button(text, on_click=partial(self.take, number)).props("flat dense")


def _read_points(session: Session) -> Clicked:
    path = session.folder / POINTS
    if path.is_file():
        with errors_shown():
            return read_clicked(path)
    return Clicked((), None, {})


def _stored_pose(session: Session) -> Pose | None:
    """Return the pose that the trial has by hand; None where it has another start, or none."""
    try:
        return session.project().trial().start.pose
    except (TrialError, AttributeError):
        return None


def _pose_of(start: dict[str, Any]) -> Pose:
    rotation = Rotation.from_quat(start["quaternion_xyzw"])
    return Pose(world_from_root=RigidTransform.from_components(start["position_m"], rotation))
