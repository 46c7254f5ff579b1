"""Points digitised by hand, frame by frame: one table for each person and repetition, in the trial's folder."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from airborne.body import BodyModel
from airborne.cameras import Rig
from airborne.errors import AirborneError, ResultError
from airborne.evaluation import DigitisedPoints, box_ends, read_clicked_frames
from airborne.motion.rows import MotionRows
from airborne.studio.clicks import Clicked
from airborne.studio.folder import files_inside
from airborne.types import Array

_FILE = re.compile(r"digitised_([A-Za-z0-9-]{1,20})_([1-9]\d?)\.csv")
JOINTS_ENDING = "_joints.csv"  # of paths that are made of clicks
_MOST_APART = 5  # frames between clicks from which a further one is predicted


@dataclass(frozen=True, slots=True)
class Repetition:
    """Who digitises, and for which time."""

    operator: str
    number: int

    @property
    def file(self) -> str:
        """The table of the clicks."""
        return f"digitised_{self.operator}_{self.number}.csv"

    @property
    def record(self) -> str:
        """The file that says how the clicks were made."""
        return f"digitised_{self.operator}_{self.number}.json"


def parse_repetition(operator: str, number: float | None) -> Repetition:
    """Return who digitises; raises AirborneError for what cannot be part of a file's name."""
    found = Repetition(operator.strip(), int(number or 0))
    if _FILE.fullmatch(found.file) is None:
        raise AirborneError("the operator is 1 to 20 letters, digits and hyphens, the repetition 1 to 99")
    return found


def list_repetitions(folder: Path) -> list[Repetition]:
    """List whose clicks lie in a folder."""
    found = [_FILE.fullmatch(path.name) for path in files_inside(folder, ".csv")]
    return [Repetition(match[1], int(match[2])) for match in found if match is not None]


def list_other_clicks(folder: Path) -> list[str]:
    """List the tables of clicks in a folder that were not made here, by their names: digitised.csv and the like."""
    names = [path.name for path in files_inside(folder, ".csv") if path.name.startswith("digitised")]
    return [name for name in names if _FILE.fullmatch(name) is None and not name.endswith(JOINTS_ENDING)]


def default_points(model: BodyModel | None) -> tuple[str, ...]:
    """Return the points of a body that a run can be compared in: a person's landmarks, the ends of a thing's boxes."""
    if model is None:
        return ()
    return tuple(landmark.name for landmark in model.landmarks) if model.has_joints else tuple(box_ends(model))


def read_digitising(path: Path, cameras: Sequence[str], points: Sequence[str]) -> DigitisedPoints:
    """Read a table, and add points that it does not have; without a file, without clicks. Raises ResultError."""
    if not path.is_file():
        none = np.empty((0, len(points), len(cameras), 2))
        return DigitisedPoints(index=np.empty(0, np.int64), points=tuple(points), px=none)
    table = read_clicked_frames(path, cameras)
    order = np.argsort(table.index, kind="stable")
    if len(np.unique(table.index)) < len(order):
        raise ResultError(f"{path.name} has a frame twice; each stands in one line")
    return add_points(replace(table, index=table.index[order], px=table.px[order]), points)


def add_points(table: DigitisedPoints, points: Sequence[str]) -> DigitisedPoints:
    """Return the table with further points, not clicked yet."""
    new = [point for point in points if point not in table.points]
    px = np.pad(table.px, ((0, 0), (0, len(new)), (0, 0), (0, 0)), constant_values=np.nan)
    return replace(table, points=(*table.points, *new), px=px)


def without_point(table: DigitisedPoints, point: str) -> DigitisedPoints:
    """Return the table without a point."""
    kept = [name for name in table.points if name != point]
    return replace(table, points=tuple(kept), px=table.px[:, [table.points.index(name) for name in kept]])


def count_clicks(table: DigitisedPoints, point: str) -> int:
    """Return how often a point is clicked, in all frames and cameras."""
    return int(np.isfinite(table.px[:, table.points.index(point), :, 0]).sum())


def clicks_of_frame(table: DigitisedPoints, frame: int, cameras: Sequence[str]) -> Clicked:
    """Return the clicks of one frame."""
    rows = np.flatnonzero(table.index == frame)
    none = np.full(table.px.shape[1:], np.nan)
    px = table.px[rows[0]] if len(rows) else none
    return Clicked(table.points, None, {camera: px[:, k] for k, camera in enumerate(cameras)})


def set_frame(table: DigitisedPoints, frame: int, clicked: Clicked, cameras: Sequence[str]) -> DigitisedPoints:
    """Return the table with the clicks of one frame replaced."""
    table = add_points(table, clicked.names)
    px = np.stack([[clicked.at(point, camera) for camera in cameras] for point in table.points])
    others = table.index != frame
    index, every = np.append(table.index[others], frame), np.concatenate([table.px[others], px[None]])
    order = np.argsort(index)
    return replace(table, index=index[order], px=every[order])


def predict_click(table: DigitisedPoints, frame: int, point: str, camera: int) -> Array:
    """Return where a point is expected (2,) [px], on a line through its clicks in the two nearest frames; NaN if far.

    From one's own clicks alone, so that it tells nothing that a tracker knows.
    """
    if point not in table.points:
        return np.full(2, np.nan)
    px = table.px[:, table.points.index(point), camera]
    rows = np.flatnonzero(np.isfinite(px[:, 0]) & (table.index != frame) & (abs(table.index - frame) <= _MOST_APART))
    rows = rows[np.argsort(abs(table.index[rows] - frame), kind="stable")][:2]
    if len(rows) == 0:
        return np.full(2, np.nan)
    if len(rows) == 1:
        return px[rows[0]]
    (a, b), share = rows, (frame - table.index[rows[0]]) / (table.index[rows[1]] - table.index[rows[0]])
    return px[a] + share * (px[b] - px[a])


def record_text(who: Repetition) -> str:
    """Return what is noted of clicks made with help from the other cameras, which makes them depend on each other."""
    return json.dumps({"operator": who.operator, "repetition": who.number, "epipolar_help": True}) + "\n"


def joint_paths_text(table: DigitisedPoints, rig: Rig, rows: MotionRows) -> str:
    """Triangulate the clicks of a person's landmarks, as `evaluate --joints` reads them; frames that were tracked."""
    points = rig.points_from_px(table.px)  # (n, points, 3)
    time_s = dict(zip(rows.index.tolist(), rows.time_s.tolist(), strict=True))
    lines = ["time_s,joint,x_m,y_m,z_m"]
    for frame, row in zip(table.index.tolist(), points, strict=True):
        for name, (x, y, z) in zip(table.points, row.tolist(), strict=True):
            if frame in time_s and np.isfinite(x):
                lines.append(f"{time_s[frame]!r},{name},{x:.6f},{y:.6f},{z:.6f}")
    if len(lines) == 1:
        raise ResultError("no landmark is clicked in two cameras in a frame of the run; click some first")
    return "\n".join(lines) + "\n"
