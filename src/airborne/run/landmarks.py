"""Points of a body as a trial gives them, in the file itself or in a table beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from airborne.cameras import Rig
from airborne.cameras.clicks import read_clicks, read_positions, refuse_same_clicks
from airborne.cameras.consensus import triangulate_consensus
from airborne.errors import TrialError
from airborne.trial.file import Trial
from airborne.trial.table import ClickTable
from airborne.types import Array


def read_joint_positions(trial: Trial, joints_m: Mapping[str, Sequence[float]] | str) -> tuple[list[str], Array]:
    """Return the names of points and their positions (points, 3) world [m], NaN where blank."""
    points = read_positions(trial.path(joints_m)) if isinstance(joints_m, str) else joints_m
    return list(points), np.array(list(points.values()), float).reshape(-1, 3)


def read_pixels(
    trial: Trial,
    points_px: ClickTable | str,
    cameras: Sequence[str],
    *,
    fewest: int = 2,
) -> tuple[tuple[str, ...], Array]:
    """Return the names of clicked points and their pixels (points, cameras, 2) [px], NaN where not seen.

    Raises CalibrationError for an unusable table, as one with fewer than `fewest` of the cameras, and where two cameras
    have the very same clicks.
    """
    if isinstance(points_px, str):
        return read_clicks(trial.path(points_px), cameras, fewest)
    names, px = tuple(points_px), np.full((len(points_px), len(cameras), 2), np.nan)
    for row, by_camera in enumerate(points_px.values()):
        for camera, pixel in by_camera.items():
            if camera in cameras:  # the trial has it, but a run may leave it out
                px[row, cameras.index(camera)] = pixel
    refuse_same_clicks(f"{trial.name}, points_px", cameras, px)
    return names, px


def triangulate_clicks(
    trial: Trial, points_px: ClickTable | str, rig: Rig, where: str
) -> tuple[tuple[str, ...], Array]:
    """Return the names of clicked points and their positions (points, 3) world [m].

    Raises TrialError for a point on which no two cameras agree.
    """
    names, px = read_pixels(trial, points_px, rig.names)
    agreed = triangulate_consensus(rig, px, np.ones(px.shape[:-1]))
    missing = [name for name, point in zip(names, agreed.points, strict=True) if np.isnan(point).any()]
    if missing:
        raise TrialError(
            f"{trial.name}: {where}: no two cameras agree where {', '.join(missing)} is; click it in two or more"
        )
    return names, agreed.points
