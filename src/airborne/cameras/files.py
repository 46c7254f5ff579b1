"""Calibration files: told apart by what is in them, not by their names."""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.cameras.camera import Camera, Rig
from airborne.cameras.qualisys import rig_from_qualisys
from airborne.errors import CalibrationError

Array = NDArray[np.floating]

NOT_CAMERAS = ("metadata", "capture_volume", "charuco", "checkerboard")


def read_rig(path: str | Path) -> Rig:
    """Read a Pose2Sim `Calib.toml` or a Qualisys `.qca.txt`, in the file's order of cameras.

    Pose2Sim: metres, camera from world, Rodrigues rotation, 4 or 5 distortion terms; a camera is named by its `name`,
    else by its key. Raises CalibrationError for a fisheye lens and for any file that is neither.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise CalibrationError(f"{path} cannot be read ({error.strerror}); give a calibration file") from None
    except UnicodeDecodeError:
        raise CalibrationError(f"{path} is not a text file; expected a Pose2Sim .toml or a Qualisys .qca.txt") from None
    if text.lstrip().startswith("<"):
        return rig_from_qualisys(text, str(path))
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise CalibrationError(
            f"{path} is neither a Pose2Sim .toml nor a Qualisys .qca.txt: as TOML, {str(error).lower()}"
        ) from None
    tables = {key: table for key, table in document.items() if key not in NOT_CAMERAS and isinstance(table, dict)}
    if not tables:
        raise CalibrationError(f"{path} has no cameras; expected a table such as [cam1] with matrix, rotation, ...")
    return Rig(tuple(_camera_from_table(f"{path}, [{key}]", key, table) for key, table in tables.items()))


def write_pose2sim(path: str | Path, rig: Rig, *, errors_px: Mapping[str, float] | None = None) -> None:
    """Write a Pose2Sim `Calib.toml`; `read_rig` gives the numbers back, the rotation up to rounding.

    A fifth distortion term is written where there is one. errors_px: reprojection RMS by camera; each stands in its
    camera's table as `error`, their RMS in `[metadata]`.
    """
    lines = []
    for camera in rig:
        n_terms = 5 if camera.distortion[4:].any() else 4
        transform = camera.camera_from_world
        lines += [
            f"[{_toml_key(camera.name)}]",
            f"name = {json.dumps(camera.name, ensure_ascii=False)}",
            f"size = {_toml([float(length) for length in camera.size])}",
            f"matrix = {_toml(camera.K.tolist())}",
            f"distortions = {_toml(np.pad(camera.distortion, (0, 5 - len(camera.distortion)))[:n_terms].tolist())}",
            f"rotation = {_toml(transform.rotation.as_rotvec().tolist())}",
            f"translation = {_toml(transform.translation.tolist())}",
            "fisheye = false",
            *([f"error = {float(errors_px[camera.name])!r}"] if errors_px else []),
            "",
        ]
    lines += ["[metadata]", "adjusted = false"]
    if errors_px:
        lines.append(f"error = {math.sqrt(sum(errors_px[name] ** 2 for name in rig.names) / len(rig))!r}")
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


def _camera_from_table(where: str, key: str, table: dict) -> Camera:
    if table.get("fisheye", False):
        raise CalibrationError(f"{where}: fisheye = true; fisheye lenses are not supported, straighten the video first")
    K = _numbers(where, table, "matrix", (3, 3))
    if not (K[0, 0] > 0 and K[1, 1] > 0 and K[1, 0] == 0 and np.array_equal(K[2], [0, 0, 1])):
        raise CalibrationError(f"{where}: matrix is not [[fx, s, cx], [0, fy, cy], [0, 0, 1]] with positive fx and fy")
    size = _numbers(where, table, "size", (2,))
    if not (np.all(size >= 1) and np.array_equal(size, np.round(size))):
        raise CalibrationError(f"{where}: size = {size.tolist()}, expected width and height in whole pixels")
    distortion = _numbers(where, table, "distortions", (4,), (5,))
    rotation = Rotation.from_rotvec(_numbers(where, table, "rotation", (3,)))
    return Camera(
        name=str(table.get("name", key)),
        K=K,
        size=(int(size[0]), int(size[1])),
        camera_from_world=RigidTransform.from_components(_numbers(where, table, "translation", (3,)), rotation),
        distortion=np.pad(distortion, (0, 5 - len(distortion))),
    )


def _numbers(where: str, table: dict, key: str, *shapes: tuple[int, ...]) -> Array:
    """Return table[key] as an array of finite numbers with one of the shapes."""
    expected = " or ".join("×".join(map(str, shape)) for shape in shapes)
    if key not in table:
        raise CalibrationError(f"{where}: no {key}; expected {expected} numbers")
    try:
        values = np.array(table[key], float)
    except (TypeError, ValueError):
        values = np.array(np.nan)
    if values.shape not in shapes or not np.all(np.isfinite(values)):
        raise CalibrationError(f"{where}: {key} = {str(table[key])[:60]}, expected {expected} numbers")
    return values


def _toml(values: list) -> str:
    return "[" + ", ".join(_toml(value) if isinstance(value, list) else repr(value) for value in values) + "]"


def _toml_key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else json.dumps(name, ensure_ascii=False)
