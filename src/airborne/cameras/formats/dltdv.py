"""Digitised points as DLTdv keeps them: `<prefix>xypts.csv` and its siblings xyzpts, xyzres, offsets and xyzCI.

One row a frame, no frame column, NaN where a point was not digitised; points outer, cameras inner.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from airborne.cameras.camera import Rig
from airborne.cameras.detections import Detections
from airborne.cameras.formats.options import FileOptions
from airborne.errors import CalibrationError
from airborne.io.text import read_csv
from airborne.io.writing import write_text
from airborne.types import Array

_COLUMN = re.compile(r"(.+)_cam_?(\d{1,4})_([uvxyUVXY])")  # DLTdv pt1_cam1_X, Argus track_cam_1_x
_EXPECTED = "expected DLTdv's table pt1_cam1_U,pt1_cam1_V,pt1_cam2_U,..."
_DEGREES_OF_FREEDOM = 3  # of a position in space, against 2 coordinates in each camera


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Digitisation:
    """What DLTdv stores of a recording: pixels and, optionally, positions, residuals, offsets and intervals."""

    points: Detections  # visibility 1 where digitised
    world: Array | None = None  # (frames, points, 3) [m]; NaN where not known
    residual_px: Array | None = None  # (frames, points)
    offset_frames: Array | None = None  # (frames, cameras)
    interval: Array | None = None  # (frames, points, 3) half of the 95 % interval [m]


def is_xypts(header: str) -> bool:
    """Whether a table's first line is that of DLTdv's pixels."""
    names = [name.strip().strip('"') for name in header.split(",")]
    return len(names) > 1 and all(_COLUMN.fullmatch(name) for name in names)


def read_digitisation(path: Path, options: FileOptions, cameras: Sequence[str] | None = None) -> Digitisation:
    """Read `<prefix>xypts.csv` and the siblings beside it; lengths are metres unless the options say otherwise.

    Cameras are named cam1, cam2, ... unless named here. Raises CalibrationError.
    """
    points = read_xypts(path, options, cameras)
    n, n_points, n_cameras = points.visibility.shape
    stem, tables = path.name.removesuffix("xypts.csv"), {}
    shapes = {"xyzpts": (n_points, 3), "xyzres": (n_points,), "offsets": (n_cameras,), "xyzCI": (n_points, 3)}
    for sibling, shape in shapes.items():
        other = path.with_name(f"{stem}{sibling}.csv")
        if stem != path.name and other.is_file():
            _, values = _read_table(other)
            if len(values) != n or values.shape[1] != np.prod(shape):
                raise CalibrationError(
                    f"{other} has {len(values)} rows of {values.shape[1]}; expected {n} of {np.prod(shape)}, "
                    f"as {path.name} has"
                )
            tables[sibling] = values.reshape(n, *shape)
    metres = options.metres("m")
    return Digitisation(
        points=points,
        world=_scale(tables.get("xyzpts"), metres),
        residual_px=tables.get("xyzres"),
        offset_frames=tables.get("offsets"),
        interval=_scale(tables.get("xyzCI"), metres),
    )


def read_xypts(path: Path, options: FileOptions, cameras: Sequence[str] | None = None) -> Detections:
    """Read `xypts.csv` in the pixels of `options.pixels`; a lower corner needs sizes. Raises CalibrationError."""
    header, values = _read_table(path)
    keys = [key for name in header if (key := _parse_column(name)) is not None]
    if not header or len(keys) < len(header):
        raise CalibrationError(f"{path}: found the columns {','.join(header)[:80] or 'none'}; {_EXPECTED}")
    names, numbers = list(dict.fromkeys(key[0] for key in keys)), sorted({key[1] for key in keys})
    if len(set(keys)) < len(keys) or len(keys) != 2 * len(names) * len(numbers):
        raise CalibrationError(f"{path}: not every point has one U and one V in every camera; {_EXPECTED}")
    camera_names = list(cameras or [f"cam{number}" for number in numbers])
    if len(camera_names) != len(numbers) or len(set(camera_names)) != len(camera_names):
        raise CalibrationError(
            f"{path} has {len(numbers)} cameras; name as many, each once: found {', '.join(camera_names)}"
        )
    px = np.full((len(values), len(names), len(numbers), 2), np.nan)
    for column, (name, number, axis) in enumerate(keys):
        px[:, names.index(name), numbers.index(number), "uv".index(axis)] = values[:, column]
    for k, camera in enumerate(camera_names):
        px[:, :, k] = options.pixels.ours(px[:, :, k], _height(options, camera, str(path)))
    return Detections.from_clicks(camera_names, names, px)


def write_digitisation(path: Path, digitisation: Digitisation, options: FileOptions) -> tuple[Path, ...]:
    """Write `<prefix>xypts.csv` and the siblings that have values; return the paths. 17 digits; NaN is NaN.

    Points are named pt1, pt2, ... as DLTdv does. Raises CalibrationError for a name that does not end in xypts.csv, and
    where pixels are to count from below and a camera's size was not given.
    """
    if not path.name.endswith("xypts.csv"):
        raise CalibrationError(f"{path}: DLTdv wants a name that ends in xypts.csv, such as throw_xypts.csv")
    points = digitisation.points
    heights = [_height(options, name, str(path)) for name in points.cameras]
    px = [options.pixels.theirs(points.px[:, :, k], height) for k, height in enumerate(heights)]
    numbers, cameras = range(1, len(points.points) + 1), range(1, len(points.cameras) + 1)
    header = [f"pt{p}_cam{c}_{axis}" for p in numbers for c in cameras for axis in "UV"]
    paths = [_write_table(path, header, np.stack(px, axis=2))]
    coordinates, scale = [f"pt{p}_{axis}" for p in numbers for axis in "XYZ"], 1 / options.metres("m")
    siblings = {
        "xyzpts": (coordinates, _scale(digitisation.world, scale)),
        "xyzres": ([f"pt{p}_dltres" for p in numbers], digitisation.residual_px),
        "offsets": ([f"cam{c}_offset" for c in cameras], digitisation.offset_frames),
        "xyzCI": ([f"{coordinate}+-CI" for coordinate in coordinates], _scale(digitisation.interval, scale)),
    }
    stem = path.name.removesuffix("xypts.csv")
    for sibling, (names, values) in siblings.items():
        if values is not None:
            paths.append(_write_table(path.with_name(f"{stem}{sibling}.csv"), names, values))
    return tuple(paths)


def triangulate_digitisation(points: Detections, rig: Rig) -> Digitisation:
    """Triangulate digitised points with the cameras of the same names; as DLTdv does, with residuals and no offsets.

    The residual is `sqrt(sum e² / (2 n - 3))` over the n cameras that see a point, e their pixel errors.
    """
    rig = rig.select(points.cameras)
    world = rig.points_from_px(points.px)
    error = np.stack([camera.px_from_world(world) for camera in rig], axis=2) - points.px
    n = np.isfinite(error).all(axis=-1).sum(axis=-1)
    freedom = np.where(n > 1, 2 * n - _DEGREES_OF_FREEDOM, 1)
    residual = np.where(n > 1, np.sqrt(np.nansum(error**2, axis=(2, 3)) / freedom), np.nan)
    return Digitisation(
        points=points, world=world, residual_px=residual, offset_frames=np.zeros((len(points.px), len(rig)))
    )


def _parse_column(column: str) -> tuple[str, int, str] | None:
    """Return a column's point, number of the camera and axis."""
    match = _COLUMN.fullmatch(column)
    return (match[1], int(match[2]), "u" if match[3] in "uUxX" else "v") if match else None


def _height(options: FileOptions, camera: str, where: str) -> int:
    """Return an image's height [px]; 0 where pixels count from the top and it does not matter."""
    return 0 if options.pixels.corner == "upper-left" else options.size_of(camera, where)[1]


def _scale(values: Array | None, scale: float) -> Array | None:
    return None if values is None else scale * values


def _read_table(path: Path) -> tuple[list[str], Array]:
    """Return the header and the numbers (rows, columns); blank cells are NaN."""
    rows = read_csv(path, _EXPECTED, CalibrationError)
    header = rows[0][1] if rows else []
    values = np.full((max(len(rows) - 1, 0), len(header)), np.nan)
    for number, (line, row) in enumerate(rows[1:]):
        try:
            values[number] = np.reshape([float(cell) if cell else np.nan for cell in row], len(header))
        except ValueError:
            columns = ",".join(header)[:80]
            raise CalibrationError(
                f"{path}, row {line}: expected {len(header)} numbers under {columns}; {_EXPECTED}"
            ) from None
    return header, np.where(np.abs(values) < 1e12, values, np.nan)


def _write_table(path: Path, header: Sequence[str], values: Array) -> Path:
    rows = np.reshape(values, (len(values), -1))
    lines = (",".join("NaN" if np.isnan(value) else f"{value:.17g}" for value in row) for row in rows)
    write_text(path, "\n".join([",".join(header), *lines]) + "\n")
    return path
