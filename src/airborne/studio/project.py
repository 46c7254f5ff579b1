"""What lies in the opened folder: its trial as far as it is written, its videos, its runs, and what comes next."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import ValidationError

from airborne.body import BodyModel, read_measurements
from airborne.body.files import read_body
from airborne.errors import AirborneError, TrialError, one_line
from airborne.io.folder_lock import find_writer
from airborne.motion.run_folder import JOINTS, MOTION, REPORT, SUMMARY
from airborne.run.identity import find_changed_tables
from airborne.studio.clicks import count_clicked, read_clicked
from airborne.studio.folder import files_inside, outer_links, path_inside, readable_files
from airborne.studio.named_files import read_inner_tables, refuse_outer_meshes
from airborne.studio.writing import FOLDER
from airborne.trial.cameras import CameraTable
from airborne.trial.file import Trial, parse_trial
from airborne.video import VideoSource

TRIAL = "trial.toml"
VIDEO_ENDINGS = (".mp4", ".mov", ".avi", ".mkv", ".mts", ".m2ts", ".ts", ".mxf", ".webm", ".m4v", ".mpg", ".dv")
BODY_ENDING, MEASURED_ENDINGS = ".toml", (".txt", ".yml", ".yaml")
FEWEST_POINTS = 6  # that determine a camera
StepState = Literal["empty", "ready", "needs you"]


@dataclass(frozen=True, slots=True, eq=False)
class Project:
    """One folder and one trial in it, which may be unfinished, or not be there yet."""

    folder: Path
    path: Path  # of the trial's file
    tables: Mapping[str, Any]  # as they stand in it
    cameras: tuple[CameraTable, ...]
    mistake: str | None  # why the file, or its cameras, cannot be read

    def table(self, name: str) -> dict[str, Any]:
        """Return a table of the trial; empty where it is missing."""
        found = self.tables.get(name)
        return dict(found) if isinstance(found, dict) else {}

    @property
    def has_players(self) -> bool:
        """Whether the trial's body is the legs of players."""
        return self.table("body").get("preset") == "legs"

    @property
    def cameras_stamp(self) -> str:
        """What changes whenever the cameras do."""
        return repr(self.cameras)

    def source(self, camera: CameraTable) -> VideoSource:
        """Return a camera's video; raises TrialError for one outside the opened folder."""
        path = self.file(camera.video)
        return VideoSource(camera.name, path, camera.fields, camera.offset_s, camera.drift_ppm, camera.exposure_s)

    def file(self, name: str) -> Path:
        """Return the path of a file that the trial names; raises TrialError for one outside the opened folder."""
        return path_inside(self.folder, name)

    def trial(self) -> Trial:
        """Return the trial; raises TrialError where it is unfinished, or names a file outside the opened folder."""
        read_inner_tables(self.folder, self.path)  # again, as links may have changed
        return parse_trial(self.path)

    def model(self) -> BodyModel:
        """Return the trial's body; raises AirborneError where there is none."""
        if not self.table("body"):
            raise TrialError("no body yet; choose one in the step Body")
        return self.trial().model()


def read_project(folder: Path, path: Path) -> Project:
    """Read what there is of a trial."""
    if not path.is_file():
        return Project(folder, path, {}, (), None)
    try:
        tables = read_inner_tables(folder, path)
        return Project(folder, path, tables, tuple(_read_cameras(tables, path.name)), None)
    except AirborneError as error:
        return Project(folder, path, {}, (), str(error))


def _read_cameras(tables: Mapping[str, Any], name: str) -> Iterator[CameraTable]:
    cameras = tables.get("camera", [])
    if not isinstance(cameras, list) or not all(isinstance(table, dict) for table in cameras):
        raise TrialError(f"{name}: camera: expected [[camera]] tables (found {cameras!r:.40})")
    for number, table in enumerate(cameras, start=1):
        try:
            yield CameraTable(**table)
        except ValidationError as error:
            raise TrialError(f"{name}: camera {number}: {one_line(error, table, CameraTable)}") from None


def find_trial(path: Path) -> tuple[Path, Path]:
    """Return the folder and the trial's file that a path means; raises TrialError."""
    path = path.absolute()
    if path.is_file():
        if path.suffix.lower() in VIDEO_ENDINGS:
            raise TrialError(f"{path.name} is a video; give its folder: {path.parent}")
        read_inner_tables(path.parent, path)
        return path.parent, path
    if not path.is_dir():
        raise TrialError(f"{path} is not there; give a folder of videos, or a trial's TOML file")
    return path, path / TRIAL


def list_videos(folder: Path) -> list[Path]:
    """List the video files of a folder, without links that lead out of it."""
    return files_inside(folder, *VIDEO_ENDINGS)


def list_bodies(folder: Path) -> dict[str, BodyModel]:
    """Return the body files of a folder, by name."""

    def read(path: Path) -> BodyModel:
        refuse_outer_meshes(folder, path)
        return read_body(path)

    return readable_files(folder, read, BODY_ENDING)


def list_measurements(folder: Path) -> list[str]:
    """List the files of a folder that hold Yeadon's measurements of a person."""
    return list(readable_files(folder, read_measurements, *MEASURED_ENDINGS))


def list_runs(folder: Path) -> list[Path]:
    """List the folders of runs with a frame, the newest first; none that holds a link which leads out of the folder."""
    runs = [path for path in folder.iterdir() if _is_run(path) and not outer_links(folder, path) and _has_frame(path)]
    return sorted(runs, key=lambda path: path.stat().st_mtime, reverse=True)


def list_outer_runs(folder: Path) -> list[str]:
    """List the links of runs that lead out of the folder; such a run is not read."""
    return [link for path in sorted(folder.iterdir()) if _is_run(path) for link in outer_links(folder, path)]


def find_run(folder: Path, name: str) -> Path | None:
    """Return a run of the folder by its name; None where there is none."""
    found = (path for path in folder.iterdir() if path.name == name and _is_run(path))
    return next((path for path in found if not outer_links(folder, path)), None)


def _is_run(path: Path) -> bool:
    is_folder = path.is_dir() and path.name != FOLDER and not path.is_symlink()
    return is_folder and any((path / name).is_file() for name in (MOTION, JOINTS))


def _has_frame(run: Path) -> bool:
    """Say whether a table of a run has a whole row below its header: its first frame has been tracked."""
    for name in (MOTION, JOINTS):
        with suppress(OSError), (run / name).open("rb") as lines:
            if lines.readline() and lines.readline().endswith(b"\n"):
                return True
    return False


_TABLES = {  # of a trial, in words
    "[start]": "the first pose",
    "[lights]": "the lights",
    "[calibration]": "the calibration",
    "[body]": "the body",
    "[[camera]]": "the videos",
}


@dataclass(frozen=True, slots=True)
class StudioStep:
    """One step on the way, and what is to be done there."""

    name: str
    address: str
    state: StepState
    says: str


def steps(project: Project) -> list[StudioStep]:
    """Return the steps on the way to a report, with their states."""
    return list(_steps(project))


def _steps(project: Project) -> Iterator[StudioStep]:
    n = len(project.cameras)
    missing = [each.video for each in project.cameras if not (project.folder / each.video).is_file()]
    if missing:
        yield StudioStep("Videos", "/", "needs you", f"{', '.join(missing)} not found")
    elif n:
        yield StudioStep("Videos", "/", "ready", f"{n} cameras" if n > 1 else "1 camera")
    else:
        yield StudioStep("Videos", "/", "needs you", project.mistake or "choose the cameras")
    yield StudioStep("Cameras", "/cameras", *_cameras_state(project))
    yield StudioStep("Body", "/body", *_body_state(project))
    yield StudioStep("First pose", "/start", *_start_state(project))
    yield from _run_steps(project)


def _cameras_state(project: Project) -> tuple[StepState, str]:
    table = project.table("calibration")
    if "file" in table:
        return (
            ("ready", str(table["file"]))
            if (project.folder / str(table["file"])).is_file()
            else (
                "needs you",
                f"{table['file']} not found",
            )
        )
    if "control_points" not in table:
        return ("needs you" if project.cameras else "empty"), "calibrate them"
    try:
        clicked = read_clicked(project.file(str(table["control_points"])))
    except AirborneError as error:
        return "needs you", str(error)
    few = [each.name for each in project.cameras if count_clicked(clicked, each.name) < FEWEST_POINTS]
    return ("needs you", f"click points in {', '.join(few)}") if few else ("ready", "control points")


def _body_state(project: Project) -> tuple[StepState, str]:
    body = project.table("body")
    file = body.get("file") or body.get("measurements")
    if file and not (project.folder / str(file)).is_file():
        return "needs you", f"{file} not found"
    if what := file or body.get("preset"):
        return "ready", "players" if project.has_players else str(what)
    return ("needs you" if project.cameras else "empty"), "choose what is tracked"


def _start_state(project: Project) -> tuple[StepState, str]:
    start = project.table("start")
    if start and not start.get("find"):
        return "ready", f"frame {start.get('frame', 0)}"
    if not project.table("body") or not project.table("calibration"):
        return "empty", "where the body is"
    return "needs you", "where are the players?" if project.has_players else "where is the body?"


def _find_changed_tables(project: Project, run: Path) -> list[str]:
    """Name which of the trial's tables have changed since a run; none where they cannot be read."""
    try:
        return [_TABLES[table] for table in find_changed_tables(project.trial(), run)]
    except AirborneError:
        return []


def _run_steps(project: Project) -> Iterator[StudioStep]:
    runs = list_runs(project.folder)
    is_prepared = all(state == "ready" for state, _ in (_cameras_state(project), _body_state(project)))
    finished, says = [run for run in runs if (run / SUMMARY).is_file()], ""
    changed = _find_changed_tables(project, finished[0]) if finished else []
    if changed:
        have = "has" if len(changed) == 1 and not changed[0].endswith("s") else "have"
        says = f"{' and '.join(changed)} {have} changed since {finished[0].name} was tracked; track again"
        yield StudioStep("Track", "/track", "needs you", says)
    elif finished:
        yield StudioStep("Track", "/track", "ready", finished[0].name)
    elif runs:
        is_going_on = find_writer(runs[0]) is not None
        says = f"{runs[0].name}, {'going on' if is_going_on else 'not finished'}"
        yield StudioStep("Track", "/track", "empty" if is_going_on else "needs you", says)
    else:
        yield StudioStep("Track", "/track", "needs you" if is_prepared else "empty", "follow the body")
    of_run: StepState = "ready" if finished and not changed else "empty"
    before = " (before the change)" if changed else ""
    yield StudioStep("Review", "/review", of_run, f"{runs[0].name}{before}" if runs else "no run yet")
    files = sorted(path.name for path in project.folder.glob("digitised_*_*[0-9].csv"))  # not the paths of joints
    state: StepState = "ready" if files else "empty"
    yield StudioStep("Digitise", "/digitise", state, files[-1] if files else "points by hand, to compare")
    reports = [run for run in finished if (run / REPORT).is_file()]
    yield StudioStep(
        "Results",
        "/results",
        of_run,
        f"{'report' if reports else 'tables'}{before}" if finished else says or "no run yet",
    )
