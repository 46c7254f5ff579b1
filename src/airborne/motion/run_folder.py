"""The folder of a run: the names of its files, which run it holds, and its motion read back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from airborne.body import BodyModel
from airborne.body.files import read_body
from airborne.errors import ResultError
from airborne.io.folder_lock import find_writer
from airborne.io.text import read_json
from airborne.motion.covariance_file import LASTING_FILE
from airborne.motion.files import read_motion
from airborne.motion.motion import Motion
from airborne.motion.players import PlayersMotion, read_players

# at the top: what is read first, and what `--resume` and other commands need
MOTION, JOINTS, JUMPS = "motion.csv", "joints.csv", "jumps.csv"
SUMMARY, REPORT, RUN_RECORD = "summary.json", "report.html", "run.json"
CALIBRATION, BODY = "calib.toml", "body.toml"
SMOOTH_RECORD = "smooth.json"
CANDIDATES, CANDIDATES_PICTURE = "candidates.json", "candidates.png"  # of a start that is undecided
PICTURES = "pictures.json"  # beside the videos: some of their pictures
TABLES, FIGURES, VIDEOS = "tables", "figures", "videos"
EXPORTS = "export"  # what `export` writes into, where it is told nothing else
ANGLES, JOINT_ANGLES, FLIGHT = (f"{TABLES}/{name}.csv" for name in ("angles", "joint_angles", "flight"))
TRACKED_MOTION = f"{TABLES}/tracked_motion.csv"  # before the fit of a whole run, as it was tracked
SMOOTH_JOINTS = f"{TABLES}/smooth_joints.csv"
AGREEMENT, REPEATABILITY = (f"{TABLES}/{name}.csv" for name in ("agreement", "repeatability"))
AGREEMENT_METHODS = "agreement_methods.txt"
_COUNTS = {"name", "n_frames", "n_tracked", "n_uncertain", "n_lost"}  # that every summary holds
_TELLING = ("matching.png", "heights.png", "through_mask.png", "pose.png")  # figures that tell most of a run


def tables_of(folder: Path) -> Path:
    """Return where a run's further tables lie, made if need be."""
    return _create(folder / TABLES)


def figures_of(folder: Path) -> Path:
    """Return where a run's figures lie, made if need be."""
    return _create(folder / FIGURES)


def list_figures(folder: Path) -> list[Path]:
    """List a run's figures, that first which tells most of it."""
    found = sorted((folder / FIGURES).glob("*.png"))
    return sorted(found, key=lambda path: _TELLING.index(path.name) if path.name in _TELLING else len(_TELLING))


def videos_of(folder: Path) -> Path:
    """Return where a run's videos lie, made if need be."""
    return _create(folder / VIDEOS)


def _create(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def holds_run(folder: Path) -> bool:
    """Tell whether a folder holds a run, finished or not."""
    return (folder / MOTION).is_file() or (folder / JOINTS).is_file()


def holds_players(folder: Path) -> bool:
    """Tell whether a folder holds a run of several players, finished or not."""
    return (folder / JOINTS).is_file() and not (folder / MOTION).is_file()


def note_if_unfinished(folder: Path) -> str | None:
    """Say that the run in a folder is not finished; None where it is."""
    if (folder / SUMMARY).is_file():
        return None
    unchecked = "their standard deviations leave out what the self-check adds in the end"
    if find_writer(folder) is not None:
        return f"the run goes on: these are the frames so far; {unchecked}"
    return f"the run is not finished: these are the frames so far, `airborne track --resume` goes on; {unchecked}"


def read_body_run(folder: Path) -> tuple[Motion, BodyModel]:
    """Return the motion and the body of the run in a folder, finished or not.

    Raises ResultError if the folder holds none, the body is missing, its record is damaged, its table was cut, or the
    errors that its self-check found to last are missing.
    """
    if not (folder / MOTION).is_file() and find_writer(folder) is not None:
        raise ResultError(f"{folder}: the run there has no frame yet; wait for its first")
    if not (folder / MOTION).is_file():
        raise ResultError(f"{folder} holds no run; expected the output folder of `airborne track`")
    check_record(folder)
    motion = read_motion(folder / MOTION)
    summary = _summary_if_finished(folder)
    _refuse_cut_table(folder / MOTION, len(motion), summary)
    if motion.lasting is None and summary.get("has_lasting_errors"):
        raise ResultError(
            f"{folder / LASTING_FILE} is missing or cut, without which standard deviations are too small; copy it from "
            "the run, or track again"
        )
    if not (folder / BODY).is_file():
        raise ResultError(
            f"{folder / 'body.toml'} is missing, the body that was tracked; put the trial's body file there, "
            "or track again"
        )
    model = read_body(folder / BODY)
    if motion.by_frame is not None and motion.by_frame.landmark_m.shape[1] != len(model.landmarks):  # it was cut
        motion = replace(motion, by_frame=None)
    return motion, model


def read_players_run(folder: Path) -> PlayersMotion:
    """Return the motion of the run of players in a folder. Raises ResultError as `read_body_run` does."""
    check_record(folder)
    motion = read_players(folder / JOINTS)
    _refuse_cut_table(folder / JOINTS, len(motion), _summary_if_finished(folder))
    return motion


def _summary_if_finished(folder: Path) -> dict[str, Any]:
    """Read a run's summary; empty where it is not finished."""
    return read_summary(folder) if (folder / SUMMARY).is_file() else {}


def _refuse_cut_table(table: Path, n: int, summary: dict[str, Any]) -> None:
    """Raise ResultError where a table has fewer frames than its run's summary, if there is one, counts."""
    n_whole = summary.get("n_frames")
    if isinstance(n_whole, int) and n < n_whole:
        raise ResultError(f"{table} holds {n} of {n_whole} frames: it was cut; copy the folder or track again")


def read_summary(folder: Path) -> dict[str, Any]:
    """Read the summary of a finished run. Raises ResultError where it is missing or damaged."""
    path = folder / SUMMARY
    if not path.exists() and holds_run(folder):
        raise ResultError(
            f"{folder} has no {SUMMARY}: its run has not finished; go on with resume=True (airborne track --resume)"
        )
    try:
        summary = read_json(path)
    except (OSError, ValueError) as error:
        raise ResultError(f"{path} cannot be read ({str(error)[:120]}); correct it, or track again") from None
    if not isinstance(summary, dict) or not _is_summary(summary):
        raise ResultError(f"{path} holds no summary of a run; correct it, or track again")
    return summary


def _is_summary(summary: dict[str, Any]) -> bool:
    """Tell whether a document is a summary: its counts are there, its findings and warnings of the right kind."""
    findings, warnings = summary.get("self_check") or [], summary.get("warnings") or []
    return (
        summary.keys() >= _COUNTS
        and isinstance(findings, list)
        and isinstance(warnings, list)
        and all(isinstance(each, str) for each in warnings)
        and all(isinstance(each, dict) and {"sentence", "is_alarm"} <= each.keys() for each in findings)
    )


def check_record(folder: Path) -> None:
    """Raise ResultError if a folder's run.json is damaged; a run without one is recognised by its tables."""
    if (folder / RUN_RECORD).exists():
        read_record(folder / RUN_RECORD)


def read_record(path: Path) -> dict[str, Any]:
    """Read a run's record. Raises ResultError where it is damaged or missing."""
    try:
        record = read_json(path)
    except (OSError, ValueError):
        record = None
    if not isinstance(record, dict):
        state = "damaged" if path.exists() else "missing"
        raise ResultError(f"{path} is {state}, so whose run this is cannot be determined; track into another folder")
    return record
