"""Points of a body as a trial gives them, in the file itself or in a table beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from airborne.cameras.clicks import read_clicks, read_positions
from airborne.trial.file import Trial
from airborne.types import Array


def read_points(trial: Trial, joints_m: Mapping[str, Sequence[float]] | str) -> tuple[list[str], Array]:
    """Return the names of points and their positions (points, 3) world [m], NaN where blank."""
    points = read_positions(trial.path(joints_m)) if isinstance(joints_m, str) else joints_m
    return list(points), np.array(list(points.values()), float).reshape(-1, 3)


def read_pixels(
    trial: Trial,
    points_px: Mapping[str, Mapping[str, Sequence[float]]] | str,
    cameras: Sequence[str],
    *,
    fewest: int = 2,
) -> tuple[tuple[str, ...], Array]:
    """Return the names of clicked points and their pixels (points, cameras, 2) [px], NaN where not seen.

    Raises CalibrationError for an unusable table, as one with fewer than `fewest` of the cameras.
    """
    if isinstance(points_px, str):
        return read_clicks(trial.path(points_px), cameras, fewest)
    names, px = tuple(points_px), np.full((len(points_px), len(cameras), 2), np.nan)
    for row, by_camera in enumerate(points_px.values()):
        for camera, pixel in by_camera.items():
            if camera in cameras:  # the trial has it, but a run may leave it out
                px[row, cameras.index(camera)] = pixel
    return names, px
