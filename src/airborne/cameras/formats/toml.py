"""TOML as calibration files use it: one table a camera, with matrix, distortions, rotation, translation and size."""

from __future__ import annotations

import json
import re

import numpy as np

from airborne.cameras.camera import Camera
from airborne.cameras.formats.parsing import build_camera, distortion_terms, parse_array, parse_size

_ROTATION_SHAPES = ((3,), (3, 3))  # a rotation vector or a matrix
_TERM_SHAPES = {False: ((4,), (5,), (8,)), True: ((4,),)}  # by whether the lens is a fisheye


def camera_from_table(where: str, name: str, table: dict, metres: float) -> Camera:
    """Return the camera of a table; lengths are multiplied by metres. Raises CalibrationError."""
    is_fisheye = table.get("fisheye") is True
    terms = table.get("distortions")
    if isinstance(terms, list) and len(terms) == 1:  # OpenCV returns them as a row
        terms = terms[0]
    return build_camera(
        where,
        name,
        K=parse_array(where, "matrix", table.get("matrix"), (3, 3)),
        size=parse_size(where, parse_array(where, "size", table.get("size"), (2,))),
        rotation=parse_array(where, "rotation", table.get("rotation"), *_ROTATION_SHAPES),
        translation=metres * parse_array(where, "translation", table.get("translation"), (3,)),
        distortion=parse_array(where, "distortions", terms, *_TERM_SHAPES[is_fisheye]),
        is_fisheye=is_fisheye,
    )


def table_lines(camera: Camera, *, n_terms: int, metres: float = 1.0) -> list[str]:
    """Return a camera's lines of a table: matrix to fisheye; lengths are divided by metres."""
    extrinsics = camera.camera_from_world
    return [
        f"matrix = {toml_value(camera.K.tolist())}",
        f"distortions = {toml_value(distortion_terms(camera, n_terms))}",
        f"rotation = {toml_value(extrinsics.rotation.as_rotvec().tolist())}",
        f"translation = {toml_value((extrinsics.translation / metres).tolist())}",
        f"fisheye = {'true' if camera.lens == 'fisheye' else 'false'}",
    ]


def toml_value(value: object) -> str:
    """Return a list, number or string as TOML."""
    if isinstance(value, list):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(value)


def toml_key(name: str) -> str:
    """Return a name as the key of a table, quoted where it must be."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else toml_value(name)


def has_fifth_term(camera: Camera) -> bool:
    """Whether a Brown lens needs more than k1, k2, p1, p2."""
    return camera.lens == "brown" and bool(np.any(camera.distortion[4:]))
