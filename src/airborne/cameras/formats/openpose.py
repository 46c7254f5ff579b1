"""OpenPose's detections in Pose2Sim's layout: a folder a camera, a JSON file a frame."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np

from airborne.errors import CalibrationError
from airborne.io.names import file_stem
from airborne.io.text import read_json
from airborne.io.writing import write_text
from airborne.types import Array

_LARGEST_FILE_BYTES = 5_000_000  # an image of a thousand people
_MOST_NUMBERS = 10_000_000  # frames times points
_AMBIGUOUS_SHARE = 0.8  # of the highest confidence: a second person with more makes the choice ambiguous


def camera_folders(path: Path) -> dict[str, Path]:
    """Return the folders below, by camera: `<camera>_json` or `<camera>`."""
    return {folder.name.removesuffix("_json"): folder for folder in sorted(path.iterdir()) if folder.is_dir()}


def read_folder(folder: Path, person: int | None = None) -> tuple[Array, int, set[str]]:
    """Read a camera's JSON files: (frames, points, 3), NaN where nobody is; the most people in one image; skeletons.

    person: the person's index in every file, from 0; None takes the one with the highest confidence. Raises
    CalibrationError where two have about the same.
    """
    files = {number_at_end(path.stem.removesuffix("_keypoints")): path for path in sorted(folder.glob("*.json"))}
    if not files or None in files:
        raise CalibrationError(
            f"{folder} holds no detections; expected JSON files whose names end in the frame's number"
        )
    last = max(number for number in files if number is not None)
    keypoints: dict[int, Array] = {}
    n_people, skeletons = 0, set()
    for frame, path in files.items():
        people, skeleton = _people(path)
        skeletons |= set() if skeleton is None else {skeleton}
        n_people = max(n_people, len(people))
        one_person = _choose_person(people, person, path)
        if one_person is not None and frame is not None:
            keypoints[frame] = one_person
    if not keypoints:
        raise CalibrationError(f"{folder}: there is nobody in any image; give the detections of a person")
    counts = {len(one) for one in keypoints.values()}
    if len(counts) > 1:
        raise CalibrationError(f"{folder}: people of {sorted(counts)} points; expected one list of points throughout")
    n_points = counts.pop()
    if last * n_points > _MOST_NUMBERS:
        raise CalibrationError(f"{folder}: a file is of frame {last}; expected the frame's number at the names' end")
    table = np.full((last + 1, n_points, 3), np.nan)
    for frame, one in keypoints.items():
        table[frame] = one
    return table, n_people, skeletons


def write_folders(path: Path, tables: dict[str, Array], skeleton: str) -> None:
    """Write tables (frames, points, 3) of x, y [px] and visibility by camera; points not seen are 0, 0, 0."""
    for camera, table in tables.items():
        folder = path / f"{file_stem(camera)}_json"
        folder.mkdir(parents=True, exist_ok=True)
        for frame, points in enumerate(table):
            is_seen = np.isfinite(points).all(axis=-1) & (points[:, 2] > 0)
            values = np.where(is_seen[:, None], points, 0.0).ravel().tolist()
            people = [{"person_id": [-1], "pose_keypoints_2d": values}] if is_seen.any() else []
            text = json.dumps({"version": 1.3, "skeleton": skeleton, "people": people})
            write_text(folder / f"{file_stem(camera)}_{frame:06d}.json", text)


def number_at_end(name: str) -> int | None:
    """Return the number that a name ends in; None where there is none."""
    match = re.search(r"([0-9]{1,18})$", name)
    return int(match[1]) if match else None


def _choose_person(people: list[Array], person: int | None, path: Path) -> Array | None:
    if person is not None:
        return people[person] if 0 <= person < len(people) else None
    if not people:
        return None
    *_, second, first = sorted([0.0, *(float(one[:, 2].sum()) for one in people)])
    if second > _AMBIGUOUS_SHARE * first:
        raise CalibrationError(
            f"{path}: two of {len(people)} people are detected about equally surely; say which one: "
            "airborne convert FOLDER detections.npz --person 0 (0 is the first of each file)"
        )
    return max(people, key=lambda one: float(one[:, 2].sum()))


def _people(path: Path) -> tuple[list[Array], str | None]:
    """Read the people (points, 3) of one OpenPose file, and the name of their skeleton where it says that."""
    try:
        if path.stat().st_size > _LARGEST_FILE_BYTES:
            raise CalibrationError(f"{path} is larger than any image's detections ({path.stat().st_size} bytes)")
        document = read_json(path)
        people = [np.array(person["pose_keypoints_2d"], float).reshape(-1, 3) for person in document["people"]]
        skeleton = document.get("skeleton")
    except OSError as error:
        raise CalibrationError(f"{path} cannot be read ({error.strerror})") from None
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError):
        raise CalibrationError(
            f"{path} is not OpenPose JSON; expected people[].pose_keypoints_2d = [x, y, confidence, ...]"
        ) from None
    known = [np.where(np.abs(one) < 1e9, one, 0.0) for one in people if len(one)]
    return known, skeleton if isinstance(skeleton, str) else None
