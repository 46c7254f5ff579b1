"""The files that a trial names, which the studio and the commands that it starts read: all lie in the opened folder."""

from __future__ import annotations

import glob
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from airborne.body.files import find_mesh_files
from airborne.errors import AirborneError, TrialError
from airborne.io.text import read_toml
from airborne.studio.folder import path_inside
from airborne.studio.writing import FOLDER
from airborne.trial.session import TrialTables, read_tables

_OF_POSE = ("joints_m", "points_px", "detections")
PATHS = {  # the keys of each table that are paths
    "camera": ("video",),
    "calibration": ("file", "control_points"),
    "body": ("file", "measurements"),
    "start": _OF_POSE,
    "start.player": ("joints_m", "points_px"),
    "key": _OF_POSE,
    "track": ("torso",),
}


def read_inner_tables(folder: Path, path: Path) -> dict[str, Any]:
    """Read a trial's tables. Raises TrialError also where it, or a file that it names, lies outside the folder."""
    path_inside(folder, path.name)
    with suppress(OSError, ValueError):  # what is wrong is said below
        _refuse_outer(folder, path, "session", read_toml(path).get("session"))
    tables, base, _ = _read_tables(folder, path)
    if base != path.parent:
        raise TrialError(f"{path.name}: its session is in another folder; put the trial beside it")
    for key, name in _iterate_paths(tables):
        _refuse_outer(folder, path, key, name)
    file = tables["body"].get("file") if isinstance(tables.get("body"), dict) else None
    if isinstance(file, str):
        refuse_outer_meshes(folder, path.parent / file)
    return tables


def _read_tables(folder: Path, path: Path) -> TrialTables:
    """Read a trial's tables; of a file that is no TOML, half written, say, the error says where older ones are."""
    try:
        return read_tables(path)
    except TrialError as error:
        has_older = any((folder / FOLDER / "versions").glob(f"{glob.escape(path.name)}.*"))
        if not (has_older and isinstance(error.__cause__, tomllib.TOMLDecodeError)):
            raise
        raise TrialError(f"{error}; its earlier versions are in {FOLDER}/versions") from None


def refuse_outer_meshes(folder: Path, body: Path) -> None:
    """Raise AirborneError where a mesh of a body file lies outside the folder."""
    try:
        names = find_mesh_files(body)
    except (AirborneError, OSError):  # which is said where the body is read
        return
    for name in names:
        _refuse_outer(folder, body, "part.file", str(body.relative_to(folder).parent / name))


def _refuse_outer(folder: Path, path: Path, key: str, name: Any) -> None:
    if isinstance(name, str):
        try:
            path_inside(folder, name)
        except TrialError as error:
            raise TrialError(f"{path.name}: {key}: {error}") from None


def _iterate_paths(tables: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the paths of a trial's tables, whatever else is wrong in them, each with its key."""
    start = tables.get("start")
    found = {**tables, "start.player": start.get("player") if isinstance(start, dict) else None}
    for head, keys in PATHS.items():
        many = found.get(head)
        for table in many if isinstance(many, list) else [many]:
            if isinstance(table, dict):
                yield from ((f"{head}.{key}", table.get(key)) for key in keys)
                yield from _detections(head, table)


def _detections(head: str, table: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the folders in that of the detections, by camera."""
    cameras, where = table.get("detections_cameras"), table.get("detections")
    for name in cameras.values() if isinstance(cameras, dict) else ():
        yield f"{head}.detections_cameras", f"{where}/{name}"
