"""Cameras that only seem to stand behind a two-sided board: their images are mirrored."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from airborne.calibration.initial.chaining import FEWEST_LENS_VIEWS, Views, board_pose, n_shared_moments, pose_by_link
from airborne.calibration.sources.boards import mirror_corners
from airborne.cameras.camera import Camera

_CLEAR_MISFIT = 2.0  # ratio of misfits from which on a camera's images are mirrored


def find_mirrored_cameras(cameras: Sequence[Camera], views: Views) -> list[str]:
    """Return the cameras that seem to stand behind a two-sided board but whose images are mirrored.

    Mirrored images of the front look like the back in every single image; only over several moments do their cameras
    fail to keep one place among the others.
    """
    shared = n_shared_moments(views)
    is_behind = [all(s.is_back for s in row if len(s.corner)) for row in views.detections]
    mirrored = []
    for c in np.flatnonzero(is_behind):
        o = int(np.argmax(np.where(is_behind, 0, shared[c])))
        if is_behind[o] or shared[c, o] < FEWEST_LENS_VIEWS:
            continue
        as_seen, flipped = (
            _pair_misfit(cameras, each, (int(c), o)) for each in (views, _mirror(views, int(c), cameras))
        )
        if _CLEAR_MISFIT * flipped < as_seen:
            mirrored.append(views.cameras[c])
    return mirrored


def _pair_misfit(cameras: Sequence[Camera], views: Views, pair: tuple[int, int]) -> float:
    one, other = (
        [board_pose(cameras[i], views.board, s)[0] if len(s.corner) else None for s in views.detections[i]]
        for i in pair
    )
    return pose_by_link(cameras[pair[0]], cameras[pair[1]], views, poses=one, other_poses=other, pair=pair)[1]


def _mirror(views: Views, camera: int, cameras: Sequence[Camera]) -> Views:
    """Return the views as if one camera's images were mirrored, and showed the board's other side."""
    n = views.board.inner_size[0] * views.board.inner_size[1]
    row = tuple(
        replace(mirror_corners(s, cameras[camera].size[0]), corner=s.corner % n) for s in views.detections[camera]
    )
    return replace(views, detections=(*views.detections[:camera], row, *views.detections[camera + 1 :]))
