"""OpenCV's YAML as EasyMocap lays it out: K_<camera>, dist_<camera> and R_ or Rot_, T_, in one file or in two."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from airborne.cameras.camera import Camera, Rig
from airborne.cameras.formats.options import METRES, FileOptions, Unit
from airborne.cameras.formats.parsing import build_camera, distortion_terms, parse_array, refuse_lens
from airborne.errors import CalibrationError
from airborne.types import Array, Size

_EXPECTED = "expected OpenCV's YAML with K_<camera>, dist_<camera>, R_<camera>, T_<camera>"
_HEADER = "%YAML:1.0\n---\n"
_BLOCK = re.compile(r"^(?=[^\s#%:-][^:\n]*:)", re.MULTILINE)  # where a node begins
_FIELD = re.compile(r"^[ \t]+(rows|cols|sizes|data)[ \t]*:\s*(\[[^\]]*\]|\S+)", re.MULTILINE)
_KEY = re.compile(r"[A-Za-z0-9_-]+")  # what OpenCV allows in a key, behind K_


def parse_opencv(text: str, where: str) -> dict[str, Any]:
    """Return an OpenCV YAML file's nodes, numbers still as text: a scalar, a list, or a matrix's fields.

    Understands only the YAML that OpenCV writes. Raises CalibrationError.
    """
    blocks = (block.partition(":") for block in _BLOCK.split(text))
    document = {key.strip(): _parse_node(rest) for key, colon, rest in blocks if colon and not key.startswith("%")}
    if not document:
        raise CalibrationError(f"{where} has no cameras; {_EXPECTED}")
    return document


def halves_in(document: dict[str, Any]) -> set[str]:
    """Say which halves of a calibration the nodes hold: intrinsics (K_), extrinsics (T_)."""
    return {key[:2] for key in document if isinstance(key, str) and key[:2] in ("K_", "T_")}


def rig_from_opencv(document: dict[str, Any], where: str, options: FileOptions) -> Rig:
    """Return the rig of one file's nodes, or of two files' together; in metres unless the options say otherwise.

    `Rot_<camera>` is the rotation as a matrix, `R_<camera>` as a Rodrigues vector (or a matrix). Image sizes stand in
    `W_<camera>` and `H_<camera>`, else they must be given. Raises CalibrationError.
    """
    names_node = document.get("names")
    if isinstance(names_node, list) and names_node:
        names = [str(name) for name in names_node]
    else:
        names = [key.removeprefix("K_") for key in document if isinstance(key, str) and key.startswith("K_")]
    keys = {name: name for name in names}
    if names and not any(f"K_{name}" in document for name in names):  # Pose2Sim numbers what it lists by name
        keys = {name: str(number) for number, name in enumerate(names, 1)}
    if not names:
        raise CalibrationError(f"{where} has no cameras; {_EXPECTED}")
    return Rig(tuple(_camera(document, where, name, key=keys[name], options=options) for name in names))


def opencv_text(rig: Rig, unit: Unit = "m") -> str:
    """Return everything in one file, lengths in the unit. Raises CalibrationError for a fisheye lens."""
    return _HEADER + _names(rig) + "".join(_intrinsics(camera) + _extrinsics(camera, unit) for camera in rig)


def easymocap_texts(rig: Rig, unit: Unit = "m") -> dict[str, str]:
    """Return EasyMocap's two files, by name. Raises CalibrationError for a fisheye lens."""
    return {
        "intri.yml": _HEADER + _names(rig) + "".join(map(_intrinsics, rig)),
        "extri.yml": _HEADER + _names(rig) + "".join(_extrinsics(camera, unit) for camera in rig),
    }


def _parse_node(text: str) -> Any:
    text = text.strip()
    if "data:" in text:
        fields = dict(_FIELD.findall(text))
        return {key: _items(value) if value.startswith("[") else value for key, value in fields.items()}
    if text.startswith("["):
        return _items(text)
    if text.startswith("-"):
        return [line.strip().removeprefix("-").strip().strip("\"'") for line in text.splitlines() if line.strip()]
    return text


def _items(text: str) -> list[str]:
    """Return the items of a list in brackets."""
    inner = text.removeprefix("[").removesuffix("]").strip()
    return [item.strip().strip("\"'") for item in inner.split(",")] if inner else []


def _camera(document: dict[str, Any], where: str, name: str, *, key: str, options: FileOptions) -> Camera:
    where = f"{where}, camera '{name[:60]}'"
    return build_camera(
        where,
        name,
        K=_matrix(document, where, f"K_{key}", (3, 3)),
        size=_size(document, where, name, key=key, options=options),
        rotation=_rotation(document, where, key),
        translation=options.metres("m") * _matrix(document, where, f"T_{key}", (3, 1), (1, 3)).ravel(),
        distortion=_matrix(document, where, f"dist_{key}", (1, 4), (4, 1), (1, 5), (5, 1), (1, 8), (8, 1)).ravel(),
    )


def _size(document: dict[str, Any], where: str, name: str, *, key: str, options: FileOptions) -> Size | Array:
    if f"W_{key}" in document and f"H_{key}" in document:
        return np.array([parse_array(where, f"{side}_{key}", document[f"{side}_{key}"], ()) for side in "WH"])
    return options.size_of(name, where)


def _rotation(document: dict[str, Any], where: str, key: str) -> Array:
    if f"Rot_{key}" in document:
        return _matrix(document, where, f"Rot_{key}", (3, 3))
    rotation = _matrix(document, where, f"R_{key}", (3, 1), (1, 3), (3, 3))
    return rotation if rotation.shape == (3, 3) else rotation.ravel()


def _matrix(document: dict[str, Any], where: str, key: str, *shapes: tuple[int, ...]) -> Array:
    """Return an `!!opencv-matrix` as an array of one of the shapes."""
    node = document.get(key)
    if not isinstance(node, dict):
        expected = " or ".join("×".join(map(str, shape)) for shape in shapes)
        raise CalibrationError(f"{where}: no {key}; expected an OpenCV matrix of {expected} numbers")
    sides = node.get("sizes", [node.get("rows"), node.get("cols")])  # OpenCV 5 writes a vector with one size
    shape = "×".join(str(side)[:9] for side in sides) if isinstance(sides, list) else "nothing"
    for rows, cols in shapes:
        if shape == f"{rows}×{cols}" or (shape == f"{rows}" and cols == 1):
            return parse_array(where, key, node.get("data"), (rows * cols,)).reshape(rows, cols)
    raise CalibrationError(f"{where}: {key} is {shape}, expected " + " or ".join(f"{a}×{b}" for a, b in shapes))


def _names(rig: Rig) -> str:
    for camera in rig:
        refuse_lens(camera, "OpenCV's YAML", is_rational_held=True)
        if not _KEY.fullmatch(camera.name):
            raise CalibrationError(
                f"camera '{camera.name}' cannot be a key of OpenCV's YAML; rename it with letters, digits, _ and -"
            )
    return "names:\n" + "".join(f'   - "{name}"\n' for name in rig.names)


def _intrinsics(camera: Camera) -> str:
    name, (width, height) = camera.name, camera.size
    K, dist = camera.K, np.array([distortion_terms(camera, 5)])
    return _node(f"K_{name}", K) + _node(f"dist_{name}", dist) + f"H_{name}: {height}\nW_{name}: {width}\n"


def _extrinsics(camera: Camera, unit: Unit) -> str:
    name, camera_from_world = camera.name, camera.camera_from_world
    nodes = {
        f"R_{name}": camera_from_world.rotation.as_rotvec()[:, None],
        f"Rot_{name}": camera_from_world.rotation.as_matrix(),
        f"T_{name}": camera_from_world.translation[:, None] / METRES[unit],
    }
    return "".join(_node(key, values) for key, values in nodes.items())


def _node(key: str, values: Array) -> str:
    rows, cols = values.shape
    data = ", ".join(f"{value:.17e}" for value in values.ravel())
    return f"{key}: !!opencv-matrix\n   rows: {rows}\n   cols: {cols}\n   dt: d\n   data: [ {data} ]\n"
