"""Tables of points clicked in the cameras' pictures, finished or not: surveyed control points, landmarks of a body."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from airborne.calibration.sources.control_points import ControlPoints
from airborne.cameras import Rig
from airborne.cameras.clicks import read_named_numbers
from airborne.errors import CalibrationError
from airborne.studio.folder import files_inside
from airborne.types import Array

_STEP_M = 1e-4  # of differences
_WORLD = ("x_m", "y_m", "z_m")
_WORDS, _LONGEST_HEAD = re.compile(r"\w+"), 100_000  # of a table's first line [bytes]


@dataclass(frozen=True, slots=True, eq=False)
class Clicked:
    """Named points and where they were clicked."""

    names: tuple[str, ...]
    world: Array | None  # (n, 3) [m]; None where the table has no positions
    px: Mapping[str, Array]  # camera -> (n, 2) [px]; NaN where not clicked

    def at(self, name: str, camera: str) -> Array:
        """Return where a point was clicked: (2,) [px], NaN where it was not."""
        return self.px[camera][self.names.index(name)] if camera in self.px else np.full(2, np.nan)

    def click(self, name: str, camera: str, px: Sequence[float]) -> Clicked:
        """Return the table with a point clicked; NaN takes a click back."""
        names = self.names if name in self.names else (*self.names, name)
        grown = {
            key: np.vstack([value, np.full((len(names) - len(value), 2), np.nan)]) for key, value in self.px.items()
        }
        column = grown.get(camera, np.full((len(names), 2), np.nan)).copy()
        column[names.index(name)] = np.round(px, 2)
        return replace(self, names=names, px={**grown, camera: column})

    def text(self, cameras: Sequence[str]) -> str:
        """Write the table; cameras without a column get one, and points without a click keep their row."""
        columns = [*cameras, *(camera for camera in self.px if camera not in cameras)]
        lines = [",".join(["point", *(_WORLD if self.world is not None else ()), *_heads(columns)])]
        for row, name in enumerate(self.names):
            cells = [] if self.world is None else [_cell(value, 6) for value in self.world[row]]
            cells += [_cell(value, 2) for camera in columns for value in self.at(name, camera)]
            lines.append(",".join([name, *cells]))
        return "\n".join(lines) + "\n"

    def control_points(self, cameras: Sequence[str]) -> ControlPoints:
        """Return them as control points of these cameras; only with positions."""
        assert self.world is not None
        px = np.stack([self.px.get(camera, np.full((len(self.names), 2), np.nan)) for camera in cameras], axis=1)
        return ControlPoints(names=self.names, world=self.world, cameras=tuple(cameras), px=px)


def read_clicked(path: Path) -> Clicked:
    """Read a table `point[,x_m,y_m,z_m][,<camera>_u,<camera>_v,...]`. Raises CalibrationError."""
    names, columns, values = read_named_numbers(path, "point", "expected point,x_m,y_m,z_m,cam1_u,cam1_v,...")
    cameras = dict.fromkeys(column[:-2] for column in columns if column[-2:] in ("_u", "_v"))
    px = {}
    for camera in cameras:
        pair = [f"{camera}_u", f"{camera}_v"]
        if all(column in columns for column in pair):
            px[camera] = values[:, [columns.index(column) for column in pair]]
    has_world = all(axis in columns for axis in _WORLD)
    world = values[:, [columns.index(axis) for axis in _WORLD]] if has_world else None
    return Clicked(names, world, px)


def read_survey(path: Path) -> Clicked:
    """Read a table of surveyed points, clicked or not. Raises CalibrationError where one has no position."""
    clicked = read_clicked(path)
    if clicked.world is None:
        raise CalibrationError(f"{path.name} has no columns {', '.join(_WORLD)}; expected surveyed points")
    for row, axis in np.argwhere(np.isnan(clicked.world))[:1]:
        raise CalibrationError(
            f"{path.name}, point '{clicked.names[row]}', column {_WORLD[axis]}: nothing stands there; expected metres: "
            "give it, or remove the point"
        )
    for camera, px in clicked.px.items():
        for row in np.flatnonzero(np.isnan(px).sum(axis=1) == 1)[:1]:
            raise CalibrationError(
                f"{path.name}, point '{clicked.names[row]}': only one of {camera}_u and {camera}_v is there; "
                "give both, or leave both blank"
            )
    return clicked


def count_clicked(clicked: Clicked, camera: str) -> int:
    """Return how many points are clicked in a camera."""
    return int(np.isfinite(clicked.px[camera][:, 0]).sum()) if camera in clicked.px else 0


def measure_between(rig: Rig, first: Array, second: Array, *, sd_px: float) -> tuple[float, float]:
    """Return how far two clicked points are apart, and its deviation [m]; clicks are (cameras, 2) [px], NaN: none."""
    ends = [rig.points_from_px(px) for px in (first, second)]
    along = ends[1] - ends[0]
    far_m = float(np.linalg.norm(along))
    variances = [_covariance(rig, px, end, sd_px) for px, end in zip((first, second), ends, strict=True)]
    towards = along / far_m if far_m else np.zeros(3)
    return far_m, float(np.sqrt(towards @ (variances[0] + variances[1]) @ towards))


def _covariance(rig: Rig, px: Array, point: Array, sd_px: float) -> Array:
    """Return the covariance (3, 3) [m^2] of a point that clicks (cameras, 2) [px] give."""
    seen = [camera for camera, at in zip(rig, px, strict=True) if np.isfinite(at).all()]
    shifts = np.concatenate([_STEP_M * np.eye(3), -_STEP_M * np.eye(3)])
    J = np.concatenate([(moved[:3] - moved[3:]).T for moved in (each.px_from_world(point + shifts) for each in seen)])
    J /= 2 * _STEP_M
    return np.asarray(sd_px**2 * np.linalg.inv(J.T @ J), float)


@dataclass(frozen=True, slots=True)
class Surveys:
    """The tables of a folder that hold positions of named points, or are meant to."""

    usable: Sequence[str]
    refused: Mapping[str, str]  # why those with its columns cannot be used


def list_surveys(folder: Path) -> Surveys:
    """Look through a folder for tables of surveyed points; what has none of their columns is another thing."""
    usable, refused = [], {}
    for path in files_inside(folder, ".csv"):
        if not _is_meant_as_survey(path):
            continue
        try:
            read_survey(path)
            usable.append(path.name)
        except CalibrationError as error:
            refused[path.name] = str(error).replace(str(path), path.name)
    return Surveys(usable, refused)


def _is_meant_as_survey(path: Path) -> bool:
    """Say whether a table's first line names points and coordinates, rightly separated or not."""
    try:
        with path.open("rb") as file:
            words = set(_WORDS.findall(file.readline(_LONGEST_HEAD).decode(errors="replace").lower()))
    except OSError:
        return False
    return "point" in words and any(axis in words or axis[0] in words for axis in _WORLD)


def _heads(cameras: Sequence[str]) -> list[str]:
    return [f"{camera}_{axis}" for camera in cameras for axis in "uv"]


def _cell(value: float, digits: int) -> str:
    return "" if np.isnan(value) else repr(round(float(value), digits))
