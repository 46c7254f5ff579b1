"""Pose2Sim's `Calib.toml`, whose layout aniposelib and FreeMoCap share: one table a camera at the top level."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from airborne.cameras.camera import Rig
from airborne.cameras.formats.options import FileOptions
from airborne.cameras.formats.toml import (
    camera_from_table,
    errors_from_table,
    errors_lines,
    has_fifth_term,
    table_lines,
    toml_key,
    toml_value,
)
from airborne.errors import CalibrationError
from airborne.io.text import list_keys

_CAMERA_KEYS = {"matrix", "rotation", "translation"}
_NOT_CAMERAS = ("metadata", "capture_volume", "charuco", "checkerboard")


def rig_from_tables(document: dict, where: str, options: FileOptions) -> Rig:
    """Return the rig of the tables at the top level, in their order; a camera is named by its `name`, else by its key.

    Metres unless the options say otherwise: the file has no unit, and a board in millimetres gives millimetres.
    """
    tables = {key: table for key, table in document.items() if key not in _NOT_CAMERAS and isinstance(table, dict)}
    if not any(_CAMERA_KEYS & table.keys() for table in tables.values()):
        raise CalibrationError(
            f"{where} has no cameras (found {list_keys(document)}); "
            "expected a table such as [cam1] with matrix, rotation, ..."
        )
    metres = options.metres("m")
    cameras = []
    for key, table in tables.items():
        there = f"{where}, [{key[:60]}]"
        camera = camera_from_table(there, str(table.get("name", key)), table, metres)
        cameras.append(replace(camera, **errors_from_table(there, table, metres)))
    return Rig(tuple(cameras))


def pose2sim_text(rig: Rig, errors_px: Mapping[str, float] | None = None) -> str:
    """Return a Pose2Sim file: a fifth distortion term only where there is one, real errors or none, and deviations.

    Pose2Sim passes over what it does not know: `covariance` and `shift_sd_px`, see `Camera`.
    """
    lines = []
    for camera in rig:
        lines += [
            f"[{toml_key(camera.name)}]",
            f"name = {toml_value(camera.name)}",
            f"size = {toml_value([float(length) for length in camera.size])}",
            *table_lines(camera, n_terms=5 if has_fifth_term(camera) else 4),
            *([f"error = {float(errors_px[camera.name])!r}"] if errors_px else []),
            *errors_lines(camera),
            "",
        ]
    lines += ["[metadata]", "adjusted = false"]
    if errors_px:
        lines.append(f"error = {math.sqrt(sum(errors_px[name] ** 2 for name in rig.names) / len(rig))!r}")
    return "\n".join(lines) + "\n"
