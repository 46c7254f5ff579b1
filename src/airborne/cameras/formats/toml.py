"""TOML as calibration files use it: one table a camera, with matrix, distortions, rotation, translation and size."""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np

from airborne.cameras.camera import Camera, correlation, scale_lengths
from airborne.cameras.formats.parsing import build_camera, distortion_terms, parse_array, parse_size
from airborne.errors import CalibrationError

_ROTATION_SHAPES = ((3,), (3, 3))  # a rotation vector or a matrix
# of a covariance's eigenvalues, over the variances; chosen between rounding, 1e-12, and matrices that are none
_ROUNDING = 1e-6
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


def errors_from_table(where: str, table: dict, metres: float) -> dict[str, Any]:
    """Return what a table says of a camera's errors, as `Camera` has it; nothing of one that says nothing.

    Raises CalibrationError for a matrix that is no covariance.
    """
    if "covariance" not in table:
        return {}
    covariance = scale_lengths(parse_array(where, "covariance", table["covariance"], (7, 7)), metres)
    values = np.linalg.eigvalsh(correlation(covariance)[1])
    if not np.allclose(covariance, covariance.T, rtol=1e-6, atol=1e-12) or values[0] < -_ROUNDING:
        raise CalibrationError(f"{where}: covariance is no covariance matrix; leave it out")
    shift_px = float(parse_array(where, "shift_sd_px", table.get("shift_sd_px", 0.0), ()))
    if shift_px < 0:
        raise CalibrationError(f"{where}: shift_sd_px = {shift_px:g}, expected 0 or more")
    world_sd = table.get("world_sd")
    if world_sd is not None and not (isinstance(world_sd, float) and 0 < world_sd < 1):
        raise CalibrationError(f"{where}: world_sd = {world_sd}, expected a share between 0 and 1")
    return {"covariance": covariance, "shift_sd_px": shift_px, "world_sd": world_sd}


def errors_lines(camera: Camera) -> list[str]:
    """Return the lines that `errors_from_table` reads, none where the calibration says nothing of its errors."""
    if camera.covariance is None:
        return []
    return [
        f"covariance = {toml_value(camera.covariance.tolist())}",
        f"shift_sd_px = {float(camera.shift_sd_px)!r}",
        *([] if camera.world_sd is None else [f"world_sd = {float(camera.world_sd)!r}"]),
    ]


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
