"""What all windows of the studio share: the opened trial, its pictures and cameras, the frame in view, its edits."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from pathlib import Path
from threading import Lock
from typing import Any, TypeVar

from airborne.cameras import Rig
from airborne.errors import AirborneError, TrialError
from airborne.run.opening import read_or_calibrate
from airborne.studio.commands import Command, find_tracking
from airborne.studio.drafts import DRAFTS, drafts_text, read_draft
from airborne.studio.folder import file_stamp, path_inside
from airborne.studio.pictures import Pictures, ShownTrial
from airborne.studio.place import LastView, read_place, write_place
from airborne.studio.project import VIDEO_ENDINGS, Project, read_project
from airborne.studio.trial_edits import with_table
from airborne.studio.writing import FOLDER, Editor, read_if_there, refuse_outer_links
from airborne.trial.body import BodyTable
from airborne.trial.calibration import CalibrationTable
from airborne.trial.file import Trial
from airborne.video.sizes import check_sizes

_T = TypeVar("_T")


class Session:
    """One opened folder; everything that lasts is in its files, all else is computed from them anew."""

    def __init__(self, folder: Path, path: Path, *, is_guided: bool = False) -> None:
        """Open a folder and a trial in it, which may not be there yet. Raises AirborneError for links out of it."""
        refuse_outer_links(folder)
        self.folder, self.path, self.is_guided = folder, path, is_guided
        self.pictures, self.editor = Pictures(folder / FOLDER), Editor(folder)
        self.place = read_place(folder)
        self.commands: dict[str, Command] = {}  # that were started here, by what they do
        self.watch_tracking()
        self._known: dict[str, tuple[Hashable, Any]] = {}
        self._lock = Lock()

    @property
    def frame(self) -> int:
        """The frame that was in view last, in any window: a page opens there; what is done to one is its view's."""
        return self.place.frame

    def watch_tracking(self) -> None:
        """Look for a process that was not started here and tracks into a run of the folder; it can be stopped here."""
        if (tracking := find_tracking(self.folder, self.path)) is not None:
            self.commands["track"] = tracking

    def go(self, *, page: str | None = None, frame: int | None = None) -> None:
        """Note the page, or the frame, in view."""
        place = LastView(self.place.page if page is None else page, self.place.frame if frame is None else frame)
        if place != self.place:
            self.place = place
            write_place(self.folder, place)

    def turn_to(self, frame: int) -> None:
        """Note the frame in view."""
        self.go(frame=frame)

    @property
    def stamp(self) -> Hashable:
        """What changes whenever a file of the folder does, or an edit may be undone that could not before.

        A video counts by its name, as it changes all the time while it is copied.
        """
        paths = sorted(self.folder.iterdir())
        tables = [path for path in paths if path.suffix in (".toml", ".csv", ".json") or path.is_dir()]
        videos = [path.name for path in paths if path.suffix.lower() in VIDEO_ENDINGS]
        return tuple(map(file_stamp, tables)), tuple(videos), self.editor.last, self.editor.next

    def project(self) -> Project:
        """Return the trial as its file has it now."""
        known = self._keep("project", file_stamp(self.path), lambda: read_project(self.folder, self.path))
        return read_project(self.folder, self.path) if known.mistake else known  # another file may have been put right

    def shown(self) -> ShownTrial:
        """Return the trial's videos to look at; slow at first. Raises AirborneError where there are none."""
        project = self.project()
        if not project.cameras:
            raise TrialError("no cameras yet; choose them in the step Videos")
        sources = tuple(map(project.source, project.cameras))
        stamp = sources, project.cameras_stamp, tuple(file_stamp(Path(source.path)) for source in sources)
        return self._keep("shown", stamp, lambda: self.pictures.show(project.cameras, project.source))

    def rig(self) -> Rig:
        """Return the cameras of the trial's videos; slow at first. Raises AirborneError where there are none."""
        project = self.project()
        table = project.table("calibration")
        if not table:
            raise TrialError("the cameras are not calibrated yet; see the step Cameras")
        files = [project.file(str(table[key])) for key in ("file", "control_points") if key in table]
        stamp = project.cameras_stamp, repr(table), tuple(map(file_stamp, files))
        return self._keep("rig", stamp, lambda: self._read_rig(project))

    def _read_rig(self, project: Project) -> Rig:
        shown = self.shown()
        rig = read_or_calibrate(self._as_far_as_cameras(), shown.facts)[0]
        source = {camera.name: project.source(camera) for camera in project.cameras}
        check_sizes([source[name] for name in rig.names], rig, [shown.sizes[name] for name in rig.names])
        return rig

    def file(self, name: str) -> Path:
        """Return the path of a file of the folder; raises TrialError where it leads out of it."""
        return path_inside(self.folder, name)

    def edit(self, name: str, text: str, what: str) -> None:
        """Write a file of the folder."""
        self.editor.write(name, text, what)

    def edit_trial(self, change: Callable[[str], str], what: str) -> None:
        """Change the trial's text."""
        self.edit(self.path.name, change(read_if_there(self.file(self.path.name)) or ""), what)

    def set_table(self, head: str, values: dict[str, Any], what: str) -> None:
        """Set values in a table of the trial; None takes a key away."""
        self.edit_trial(lambda text: with_table(text, head, values), what)

    def draft(self, name: str) -> Any:
        """Return what was kept of a draft last; None where there is none."""
        return read_draft(self.folder, self.path.name, name)

    def keep_draft(self, name: str, draft: Any, what: str) -> None:
        """Keep a draft, an edit like all others."""
        (self.folder / FOLDER).mkdir(exist_ok=True)
        self.edit(DRAFTS, drafts_text(self.folder, self.path.name, name, draft), what)

    def _as_far_as_cameras(self) -> Trial:
        """Return the trial as far as its cameras go, whatever else is missing."""
        project = self.project()
        trial = Trial(
            name="draft",
            camera=[camera.model_dump(exclude_unset=True) for camera in project.cameras],
            calibration=CalibrationTable(**project.table("calibration")).model_dump(exclude={"mend"}),
            body=BodyTable(preset="human18", stature_m=1.8, mass_kg=70.0).model_dump(exclude_none=True),
        )
        trial._folder = self.folder
        return trial

    def _keep(self, name: str, stamp: Hashable, make: Callable[[], _T]) -> _T:
        """Return what was made for this stamp, else make it; an error is kept too."""
        with self._lock:
            known = self._known.get(name)
        if known is None or known[0] != stamp:
            made: Any
            try:
                made = make()
            except AirborneError as error:
                made = error
            known = stamp, made
            with self._lock:
                self._known[name] = known
        if isinstance(known[1], AirborneError):
            raise known[1]
        return known[1]
