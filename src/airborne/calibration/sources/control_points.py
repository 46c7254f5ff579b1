"""Control points: surveyed positions and their pixels in each camera."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airborne.calibration.sources.court import ScenePoint, closest_names
from airborne.errors import CalibrationError
from airborne.io.text import read_csv
from airborne.types import Array

_WORLD_COLUMNS = ("x_m", "y_m", "z_m")
SURVEYED_SD = 0.002  # of the size of a world of surveyed points [share]; chosen as usual of a tape, 2 mm a metre
_MOST_COLUMNS = 1000  # two for each camera
_EXPECTED = "expected point,x_m,y_m,z_m,cam1_u,cam1_v,..."


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ControlPoints:
    """Surveyed points and their pixels; NaN where a camera does not see a point."""

    names: tuple[str, ...]
    world: Array  # (n, 3) [m]
    cameras: tuple[str, ...]
    px: Array  # (n, cameras, 2) [px]
    sd_m: Array | None = None  # (n, 3) standard deviation of each coordinate [m]; None: exact

    def is_seen_by(self, camera: str) -> NDArray[np.bool_]:
        """Say which points the named camera sees: (n,)."""
        return ~np.isnan(self.px[:, self.cameras.index(camera), 0])

    def select(self, cameras: Sequence[str]) -> ControlPoints:
        """Return the points with the named cameras only, in that order."""
        return replace(self, cameras=tuple(cameras), px=self.px[:, [self.cameras.index(name) for name in cameras]])


def read_control_points(path: str | Path, scene_points: dict[str, ScenePoint] | None = None) -> ControlPoints:
    """Read a table `point,x_m,y_m,z_m,<camera>_u,<camera>_v,...`; blank (or NaN) pixels where a point is not seen.

    World coordinates in metres, pixels with (0, 0) at the centre of the top-left pixel. Columns may stand in any
    order. Points with a name in `scene_points` (a court's) need no coordinates: blank, or no such columns. Raises
    CalibrationError, with the row and column, for a file that does not say this.
    """
    path = Path(path)
    header, *rows = _read_rows(path)
    if len(header) > _MOST_COLUMNS:
        raise CalibrationError(f"{path}: {len(header)} columns, expected {_MOST_COLUMNS} at most; {_EXPECTED}")
    column = {name: i for i, name in enumerate(header)}
    cameras = _check_header(path, header, needs_world=not scene_points)
    n = len(header)
    names: dict[str, int] = {}
    for line, row in rows:
        if len(row) != n:
            raise CalibrationError(f"{path}, row {line}: {len(row)} values, expected {n} as in the header")
        name = row[column["point"]]
        if not name:
            raise CalibrationError(f"{path}, row {line}: the point has no name; give each point its own")
        if name in names:
            raise CalibrationError(f"{path}: point '{name}' stands in rows {names[name]} and {line}; remove one")
        names[name] = line
    points = [_scene_point(path, line, {c: row[column[c]] for c in column}, scene_points or {}) for line, row in rows]
    if scene_points and not any(point is scene_points.get(name) for name, point in zip(names, points, strict=True)):
        raise CalibrationError(
            f"{path}: no point takes its position from the court, as all have coordinates of their own; "
            "give such a table as control points, without a court"
        )
    px = np.array(
        [
            [_pixel(path, line, camera, [row[column[f"{camera}_{a}"]] for a in "uv"]) for camera in cameras]
            for line, row in rows
        ]
    )
    return ControlPoints(
        names=tuple(names),
        world=np.array([point.position_m for point in points]),
        cameras=cameras,
        px=px,
        sd_m=np.array([point.sd_m for point in points]) if scene_points else None,
    )


def _scene_point(path: Path, line: int, row: Mapping[str, str], scene_points: dict[str, ScenePoint]) -> ScenePoint:
    """Return a row's own coordinates or, without any, those of the scene point of its name."""
    if not scene_points or any(row.get(c, "").lower() not in ("", "nan") for c in _WORLD_COLUMNS):
        position_m = np.array([_number(path, line, c, row.get(c, "")) for c in _WORLD_COLUMNS])
        return ScenePoint(position_m, np.zeros(3))
    if row["point"] not in scene_points:
        raise CalibrationError(
            f"{path}, row {line}: point '{row['point']}' has no x_m, y_m, z_m and is none of the court's; "
            f"nearest names: {closest_names(row['point'], scene_points)}"
        )
    return scene_points[row["point"]]


def _read_rows(path: Path) -> list:
    """Return the header and (line number, row) for every row that is not empty."""
    rows = read_csv(path, _EXPECTED, CalibrationError)
    if not rows:
        raise CalibrationError(f"{path} is empty; {_EXPECTED}")
    if len(rows) == 1:
        raise CalibrationError(f"{path} has a header but no points; add a row for each control point")
    return [rows[0][1], *rows[1:]]


def _check_header(path: Path, header: Sequence[str], *, needs_world: bool) -> tuple[str, ...]:
    """Return the cameras' names in the order of their columns."""
    if "point" not in header and any(_is_number(name) for name in header):
        raise CalibrationError(f"{path} has no header: its first row holds numbers; {_EXPECTED}")
    twice = sorted({name for name in header if header.count(name) > 1})
    if twice:
        raise CalibrationError(f"{path}: column '{twice[0]}' stands twice in the header; name each column once")
    missing = [name for name in ("point", *_WORLD_COLUMNS) if name not in header and (needs_world or name == "point")]
    if missing:
        raise CalibrationError(f"{path}: no column {', '.join(missing)}; found {','.join(header)[:80]}; {_EXPECTED}")
    others = [name for name in header if name not in ("point", *_WORLD_COLUMNS)]
    unknown = [name for name in others if len(name) < 3 or name[-2:] not in ("_u", "_v")]
    if unknown:
        raise CalibrationError(f"{path}: column '{unknown[0]}' is not <camera>_u or <camera>_v; {_EXPECTED}")
    cameras = tuple(dict.fromkeys(name[:-2] for name in others))
    if not cameras:
        raise CalibrationError(f"{path}: no camera columns; add <camera>_u and <camera>_v for each camera")
    for camera in cameras:
        for name in (f"{camera}_u", f"{camera}_v"):
            if name not in header:
                raise CalibrationError(f"{path}: camera '{camera}' has no column {name}; it needs both _u and _v")
    return cameras


def _is_number(text: str) -> bool:
    try:
        return bool(np.isfinite(float(text)))
    except ValueError:
        return False


def _number(path: Path, line: int, column: str, text: str, *, otherwise: str = "delete the row") -> float:
    if not _is_number(text):
        raise CalibrationError(
            f"{path}, row {line}, column {column}: '{text}' is not a number; give one, or {otherwise}"
        )
    return float(text)


def _pixel(path: Path, line: int, camera: str, texts: Sequence[str]) -> tuple[float, float]:
    is_blank = [text == "" or text.lower() == "nan" for text in texts]
    if all(is_blank):
        return np.nan, np.nan
    if any(is_blank):
        raise CalibrationError(
            f"{path}, row {line}: camera '{camera}' has only one of u and v; give both or leave both blank"
        )
    unseen = "leave both cells empty where the camera does not see the point"
    named = zip([f"{camera}_u", f"{camera}_v"], texts, strict=True)
    u, v = (_number(path, line, column, text, otherwise=unseen) for column, text in named)
    return u, v
