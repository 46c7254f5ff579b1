"""What lies over the pictures of a run: outlines of the body and lines of players' legs, in the videos' own pixels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from airborne.body import BodyModel, PosedBody
from airborne.body.files import read_body
from airborne.cameras import Camera, Rig, read_rig
from airborne.errors import ResultError
from airborne.export.palette import STATUS_RGB, hex_colour
from airborne.export.views import cached_surface_arrays
from airborne.motion import Motion, PlayersMotion, read_motion
from airborne.motion.run_folder import BODY, CALIBRATION, MOTION, holds_players, read_players_run
from airborne.rendering import FLAT, render
from airborne.tracking import Status
from airborne.tracking.image_regions import bounding_points
from airborne.types import Array

_COLOURS = {status.value: hex_colour(rgb) for status, rgb in STATUS_RGB.items()}
_LIMBS = ("hip", "knee", "ankle", "foot")  # in order down a leg
_RIM_PX = 2  # about the body, so that no outline runs along the border of what is drawn
_MOST_DIGITS = 10  # of a frame's number
_PATH_COLOUR = "rgba(255,255,255,0.55)"


@dataclass(frozen=True, slots=True, eq=False)
class _BodyRun:
    motion: Motion
    rig: Rig
    rows: dict[int, int]  # frame -> row


def outline_items(
    posed: PosedBody, cameras: Sequence[Camera], colour: str, *, step: int = 1, grab: bool = False
) -> list[dict[str, Any]]:
    """Return a body's outline in every camera, one closed line for each part that is seen alone.

    `step` is how many pixels of the video one of the outline has; `grab` lets the body be taken there.
    """
    surface = cached_surface_arrays(posed.model)
    corners, items = bounding_points(posed, surface), []
    for pane, camera in enumerate(cameras):
        width, height = camera.size
        drawn = camera.without_distortion().resample(scale=(step, step), size=(-(-width // step), -(-height // step)))
        drawing = render(surface, posed, drawn, FLAT, region=_region_around(drawn.px_from_world(corners)))
        mask, corner = drawing.mask.astype(np.uint8), drawing.region[:2]
        if not mask.size:
            continue
        contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE, offset=corner)
        for contour in contours:
            line = camera.distort_px(step * cv2.approxPolyDP(contour, 0.7, True)[:, 0].astype(float))
            item = {"pane": pane, "points": _round(line), "colour": colour, "width": 2, "closed": True}
            items.append({**item, "grab": True} if grab else item)
    return items


def _region_around(px: Array) -> tuple[int, int, int, int] | None:
    """Return x0, y0, x1, y1 around points (n, 2) [px]; None, the whole picture, where one is behind the camera."""
    if not np.isfinite(px).all():
        return None
    (x0, y0), (x1, y1) = np.floor(px.min(axis=0)) - _RIM_PX, np.ceil(px.max(axis=0)) + _RIM_PX
    return int(x0), int(y0), int(x1), int(y1)


def run_overlay(run: Path, frame: int, cameras: Sequence[str]) -> dict[str, Any]:
    """Return what a run says of a frame: items over the cameras' pictures, and a label."""
    if holds_players(run):
        return _players_overlay(_read_players(run, _stamp(run / "joints.csv")), _rig(run, cameras), frame)
    opened = _open(run, _stamp(run / MOTION))
    row = opened.rows.get(frame)
    if row is None:
        return {"items": [], "label": f"frame {frame}"}
    status = str(opened.motion.status[row])
    label = f"frame {frame}   {opened.motion.time_s[row]:.3f} s   {status}"
    if not opened.motion.has_pose[row]:
        return {"items": [], "label": label}
    posed = run_body(run).with_pose(opened.motion.pose(row))
    return {"items": outline_items(posed, opened.rig.select(cameras).cameras, _COLOURS[status]), "label": label}


def run_curves(run: Path) -> dict[str, Any]:
    """Return a run's curves: times, frames, statuses, and series with their standard deviations."""
    if holds_players(run):
        return _players_curves(_read_players(run, _stamp(run / "joints.csv")))
    motion = _open(run, _stamp(run / MOTION)).motion
    sd = motion.position_sd
    return {
        "frame": motion.index.tolist(),
        "time_s": motion.time_s.tolist(),
        "status": motion.status.tolist(),
        "series": [
            {"name": axis, "unit": "m", "value": _plain(motion.position[:, k]), "sd": _plain(sd[:, k])}
            for k, axis in enumerate("xyz")
        ],
    }


def run_rows(run: Path) -> tuple[int, int | None]:
    """Return how many frames a run of one body holds so far, and the last one's number."""
    path = run / MOTION
    rows = path.read_bytes().split(b"\n")[1:-1] if path.is_file() else []  # without the header and a torn last line
    newest = rows[-1].partition(b",")[0] if rows else b""
    return len(rows), int(newest) if newest.isdigit() and len(newest) < _MOST_DIGITS else None


def run_body(run: Path) -> BodyModel:
    """Return the body of a run."""
    return _read_body(run / BODY, _stamp(run / BODY))


def run_motion(run: Path) -> Motion:
    """Return the motion of a run of one body."""
    return _open(run, _stamp(run / MOTION)).motion


@lru_cache(maxsize=8)
def _open(run: Path, stamp: Any) -> _BodyRun:
    motion = read_motion(run / MOTION)
    return _BodyRun(motion, read_rig(run / CALIBRATION), {int(frame): row for row, frame in enumerate(motion.index)})


@lru_cache(maxsize=8)
def _read_players(run: Path, stamp: Any) -> PlayersMotion:
    return read_players_run(run)


@lru_cache(maxsize=8)
def _read_body(path: Path, stamp: Any) -> BodyModel:
    return read_body(path)


def _rig(run: Path, cameras: Sequence[str]) -> Sequence[Camera]:
    return read_rig(run / CALIBRATION).select(cameras).cameras


def _players_overlay(motion: PlayersMotion, cameras: Sequence[Camera], frame: int) -> dict[str, Any]:
    rows = np.flatnonzero(motion.index == frame)
    if not len(rows):
        return {"items": [], "label": f"frame {frame}"}
    row, items = int(rows[0]), []
    for player, name in enumerate(motion.players):
        status = str(motion.status[row, player])
        if status == Status.LOST.value:
            continue
        joints_m = dict(zip(motion.joints, motion.points[row, player], strict=True))
        items += legs_items(name, joints_m, cameras, _COLOURS[status])
    return {"items": items, "label": f"frame {frame}   {motion.time_s[row]:.3f} s"}


def legs_items(
    name: str, joints_m: Mapping[str, Sequence[float]], cameras: Sequence[Camera], colour: str
) -> list[dict[str, Any]]:
    """Return the lines of a player's legs in every camera; joint -> position [m]."""
    items = []
    for side in ("left", "right"):
        points = np.array([joints_m[f"{limb}_{side}"] for limb in _LIMBS if f"{limb}_{side}" in joints_m])
        for pane, camera in enumerate(cameras):
            line = camera.px_from_world(points)
            if np.isfinite(line).all():
                text = name if side == "left" else ""
                items.append({"pane": pane, "points": _round(line), "colour": colour, "width": 2.5, "text": text})
    return items


def _players_curves(motion: PlayersMotion) -> dict[str, Any]:
    limb = next((limb for limb in reversed(_LIMBS) if {f"{limb}_left", f"{limb}_right"} <= set(motion.joints)), None)
    if limb is None:
        raise ResultError("the run holds no legs; track again")
    lower = [motion.joints.index(f"{limb}_{side}") for side in ("left", "right")]
    worst = {Status.TRACKED.value: 0, Status.UNCERTAIN.value: 1, Status.LOST.value: 2}
    statuses = [max(map(str, row), key=lambda each: worst[each]) for row in motion.status]
    lowest = np.min(motion.points[:, :, lower, 2], axis=2)
    series = [
        {"name": f"{name}: lower {limb}", "unit": "m", "value": _plain(lowest[:, k]), "sd": []}
        for k, name in enumerate(motion.players)
    ]
    frames, times = motion.index.tolist(), motion.time_s.tolist()
    return {"frame": frames, "time_s": times, "status": statuses, "series": series}


def _plain(values: Iterable[float]) -> list[float | None]:
    return [round(float(value), 5) if np.isfinite(value) else None for value in values]


def _round(points: np.ndarray) -> list[list[float]]:
    return np.round(points, 2).tolist()


def _stamp(path: Path) -> Any:
    try:
        return path.stat().st_mtime_ns, path.stat().st_size
    except OSError:
        return None
