"""What a calibration can be made from in a folder: boards and wands that were filmed, or a volleyball court."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from airborne.calibration.sources.boards import read_board
from airborne.calibration.sources.court import Net, survey_points
from airborne.cameras.formats.dltdv import read_xypts
from airborne.cameras.formats.options import FileOptions
from airborne.errors import TrialError
from airborne.evaluation import DigitisedPoints
from airborne.io.text import read_json
from airborne.io.writing import replace_text
from airborne.studio.digitising import list_repetitions
from airborne.studio.folder import files_inside, is_inside, readable_files
from airborne.studio.project import Project, list_videos
from airborne.types import Mask

SOURCES, CALIBRATED = "calibration_sources.toml", "calib_studio.toml"  # what is written, and what comes of it
REPORT, _SAID = "calib_studio_report", "report.txt"  # the command's folder of pictures, and what it said
NETS: dict[Net, str] = {"men": "men, 2.43 m", "women": "women, 2.24 m"}


def list_boards(folder: Path) -> list[str]:
    """List the files of a folder that describe a board."""
    return list(readable_files(folder, read_board, ".toml"))


def list_wands(folder: Path) -> list[str]:
    """List the tables of a folder that hold the tracks of markers in several cameras, or clicks of a wand's ends."""
    options, clicked = FileOptions(), [each.file for each in list_repetitions(folder)]
    return [*readable_files(folder, lambda path: read_xypts(path, options), ".csv"), *clicked]


def wand_text(project: Project, digitised: DigitisedPoints) -> str:
    """Return the table of a wand's markers from clicks of its two ends. Raises TrialError for other than two points."""
    clicked: Mask = np.isfinite(digitised.px[..., 0])  # (frames, points, cameras)
    markers = np.flatnonzero(clicked.any(axis=(0, 2)))
    if len(markers) != 2:
        raise TrialError(f"{len(markers)} points are clicked; expected two, the wand's ends, in the step Digitise")
    names = [camera.calibrated_as or camera.name for camera in project.cameras]
    lines = ["frame,marker,camera,u_px,v_px"]
    for row, frame in enumerate(digitised.index.tolist()):
        for number, marker in enumerate(markers, start=1):
            for k in np.flatnonzero(clicked[row, marker]):
                u, v = digitised.px[row, marker, k].tolist()
                lines.append(f"{frame},{number},{names[k]},{u!r},{v!r}")
    return "\n".join(lines) + "\n"


def guess_video(project: Project, camera: str) -> str:
    """Return the video of a folder in which a camera may have filmed the board: one that has its name, not its own."""
    own = {each.video for each in project.cameras}
    names = [path.name for path in list_videos(project.folder)]
    found = [name for name in names if camera.lower() in name.lower() and name not in own]
    return (found or [next(each.video for each in project.cameras if each.name == camera)])[0]


def board_text(columns: int, rows: int, square_mm: float, *, marker_mm: float, dictionary: str) -> str:
    """Return the file of a board; without markers it is a chessboard, of so many inner corners."""
    table: dict[str, Any] = {"columns": columns, "rows": rows, "square_m": round(square_mm / 1000, 6)}
    if marker_mm:
        table |= {"kind": "charuco", "marker_m": round(marker_mm / 1000, 6), "dictionary": dictionary}
    else:
        table["kind"] = "chessboard"
    return tomlkit.dumps(table)


def sources_text(project: Project, source: Mapping[str, Any], medium: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the file of sources for `airborne calibrate`: its table [board] or [wand], and what each camera has."""
    document = tomlkit.document()
    cameras = tomlkit.aot()
    for camera in project.cameras:
        table = tomlkit.table()
        table.update({"name": camera.calibrated_as or camera.name, **medium[camera.name]})
        cameras.append(table)
    document.add("camera", cameras)
    for head, values in source.items():
        document.add(head, tomlkit.item(dict(values)))
    return tomlkit.dumps(document)


def court_text(net: Net) -> str:
    """Return the table of a court's points, to be clicked."""
    rows = [",".join([name, *(f"{value:g}" for value in at)]) for name, at in survey_points(net).items()]
    return "\n".join(["point,x_m,y_m,z_m", *rows]) + "\n"


def find_picture(folder: Path, name: str) -> Path | None:
    """Return a picture of the last calibration's report; None where there is none of that name."""
    found = [path for path in list_pictures(folder) if path.name == name]
    return found[0] if found else None


def list_pictures(folder: Path) -> list[Path]:
    """List the pictures of the last calibration's report: where each camera saw points, and how far off they are."""
    found = files_inside(folder / REPORT, ".png") if is_inside(folder, folder / REPORT) else []
    return [path for path in found if path.name.startswith("residuals_")]


def read_report(folder: Path) -> str:
    """Return what the last calibration said; empty where there is none."""
    path = folder / REPORT / _SAID
    return path.read_text(encoding="utf-8", errors="replace") if path.is_file() and is_inside(folder, path) else ""


def read_findings(folder: Path, file: str) -> dict[str, list[str]]:
    """Return what the diagnosis of a calibration found, by camera, "" for all. Raises TrialError."""
    found = defaultdict(list)
    with _report_of(folder, file) as report:
        for each in report.get("findings", ()):
            for camera in each["cameras"] or [""]:
                found[str(camera)].append(str(each["sentence"]))
    return found


def read_deviations(folder: Path, file: str) -> dict[str, dict[str, float]]:
    """Return the standard deviations that a calibration's report knows, by camera and number. Raises TrialError."""
    with _report_of(folder, file) as report:
        return {
            str(name): {str(number): float(sd) for number, sd in camera["sd"].items()}
            for name, camera in report.get("cameras", {}).items()
        }
    return {}


@contextmanager
def _report_of(folder: Path, file: str) -> Iterator[dict[str, Any]]:
    """Give the report beside a calibration, empty where there is none; raises TrialError where it is no such thing."""
    path = folder / f"{Path(file).stem}_report" / "report.json"
    try:
        yield read_json(path) if path.is_file() and is_inside(folder, path) else {}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        raise TrialError(f"{path} is no report of a calibration; calibrate again, or remove it") from None


def write_calibration_report(folder: Path, text: str) -> None:
    """Keep what a calibration said beside its pictures. Raises TrialError where that leads out of the folder."""
    path = folder / REPORT / _SAID
    if not is_inside(folder, path):
        raise TrialError(f"{path} is a link that leads out of the folder; remove it")
    replace_text(path, text, is_durable=False)
