"""Absolute doubts about a run: what the pictures' change says against the tracked poses, whatever the colours say.

What the body covered at its start and does not cover any more must have changed. A pose elsewhere must not explain
what stands out from the empty scene better than its own interval allows. No body is faster than people throw.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.body import Pose
from airborne.cameras import Camera
from airborne.tracking.model_based.render_model import RenderModel
from airborne.types import Array
from airborne.video import Frames, View

_ALIKE_GREY = 12.0  # a pixel that has changed by less looks unchanged
_SEARCH_PX = 4  # a camera held by hand may have moved by this
_LEAST_VACATED, _MOST_UNCHANGED = 0.15, 1 / 3  # shares: of the body's first mask; of what it has left
_CLEAR_PX = 3  # from a mask's outline
_MOST_SPEED_M_S, _MOST_TURN_RAD_S = 40.0, 120.0  # a javelin leaves the hand at 30 m/s, a wrist turns at 60 rad/s
# chosen: half of the zigzag between frames, as a share of the motion, of fields that are exchanged in time, which is 4;
# the example's is 3.8, those of nine other runs of bodies and people are 0.2 at most. And frames that tell
_MOST_ZIGZAG, _LEAST_FRAMES = 2.0, 12
_CLEAR_SDS = 3.0  # chosen: a step so long, beside its sd, is no standing still: one in 370 normal errors is
_MOST_SDS = 4.0  # by which the silhouettes may show a pose elsewhere


def has_stayed(render_model: RenderModel, start: Pose, now: Pose, *, first: Frames, later: Frames) -> bool:
    """Whether most of what the body covered at its start, and does not cover any more, looks as it did then."""
    vacated = unchanged = covered = 0
    for before, after in zip(first.views, later.views, strict=True):
        if before is None or after is None or not np.array_equal(before.camera.K, after.camera.K):
            continue
        was = _mask(render_model, start, before.camera)
        left = cv2.erode(was, np.ones((5, 5), np.uint8)) > 0
        left &= cv2.dilate(_mask(render_model, now, after.camera), np.ones((2 * _CLEAR_PX + 1,) * 2, np.uint8)) == 0
        covered += int(was.sum())
        vacated += int(left.sum())
        if left.any():
            unchanged += int(np.count_nonzero(_change(before, after, left) < _ALIKE_GREY))
    return vacated > _LEAST_VACATED * covered and unchanged > _MOST_UNCHANGED * vacated


def too_fast(time_s: Array, position: Array, rotation_rad: Array) -> NDArray[np.bool_]:
    """Whether a body moves faster than bodies can, to or from each of its poses: (n,).

    time_s (n,), position (n, 3) [m], rotation_rad (n - 1,) angles between neighbours.
    """
    step_s = np.maximum(np.diff(time_s), 1e-6)
    speed = np.linalg.norm(np.diff(position, axis=0), axis=1) / step_s
    fast = (speed > _MOST_SPEED_M_S) | (rotation_rad / step_s > _MOST_TURN_RAD_S)
    return np.concatenate([fast, [False]]) | np.concatenate([[False], fast])


def zigzags(index: NDArray[np.int64], position: Array, covariance: Array) -> bool:
    """Whether a body goes forth and back between frames, as where the fields of its videos are in the wrong order.

    index (n,) of frames, position (n, 3) [m], its covariance (n, 3, 3).
    """
    step = np.diff(index)
    rows = np.flatnonzero((step[1:] == 1) & (step[:-1] == 1)) + 1
    motion = (position[rows + 1] - position[rows - 1]) / 2
    bend = position[rows + 1] - 2 * position[rows] + position[rows - 1]
    sd_m = np.sqrt(np.trace(covariance[rows], axis1=1, axis2=2))
    is_clear = np.linalg.norm(motion, axis=1) > _CLEAR_SDS * sd_m
    if np.count_nonzero(is_clear) < _LEAST_FRAMES:
        return False
    sign = np.where(index[rows] % 2, -1.0, 1.0)
    along = sign * np.einsum("ni,ni->n", bend, motion)
    return abs(float(np.median(along[is_clear] / np.sum(motion[is_clear] ** 2, axis=1)))) > _MOST_ZIGZAG


def lies_elsewhere(shown: Array, noise: Array, covariance: Array) -> NDArray[np.bool_]:
    """Whether the silhouettes show the body beside its interval: (n,).

    shown (n, 3) [m]; noise, covariance (n, 3, 3): of what is shown, and of the tracked position.
    """
    distance2 = np.einsum("ni,nij,nj->n", shown, np.linalg.inv(noise + covariance), shown)
    return distance2 > _MOST_SDS**2


def spread(doubtful: NDArray[np.bool_], at: NDArray[np.int64], index: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Give every frame the doubt of the moments beside it: `at` (m,) and `index` (n,) are frame numbers."""
    after = np.clip(np.searchsorted(at, index), 0, len(at) - 1)
    before = np.clip(np.searchsorted(at, index, side="right") - 1, 0, len(at) - 1)
    return doubtful[before] | doubtful[after]


def _mask(render_model: RenderModel, pose: Pose, camera: Camera) -> NDArray[np.uint8]:
    return (render_model.draw(render_model.with_pose(pose), camera).part >= 0).astype(np.uint8)


def _change(before: View, after: View, chosen: NDArray[np.bool_]) -> Array:
    """Return by how much the chosen pixels (h, w) have changed, wherever nearby they have changed least: (m,)."""
    rows, columns = np.flatnonzero(chosen.any(axis=1)), np.flatnonzero(chosen.any(axis=0))
    height, width = chosen.shape
    y0, y1 = max(rows[0] - _SEARCH_PX, 0), min(rows[-1] + 1 + _SEARCH_PX, height)
    x0, x1 = max(columns[0] - _SEARCH_PX, 0), min(columns[-1] + 1 + _SEARCH_PX, width)
    images = (view.crop((int(x0), int(y0), int(x1), int(y1))) for view in (before, after))
    was, now = (cv2.GaussianBlur(np.asarray(rgb), (0, 0), 1.5) for rgb in images)
    inside = chosen[y0:y1, x0:x1]
    around = cv2.copyMakeBorder(now, _SEARCH_PX, _SEARCH_PX, _SEARCH_PX, _SEARCH_PX, cv2.BORDER_WRAP)
    height, width = inside.shape
    least = np.full(inside.shape, 255, np.uint8)
    for dy in range(0, 2 * _SEARCH_PX + 1, 2):
        for dx in range(0, 2 * _SEARCH_PX + 1, 2):
            red, green, blue = cv2.split(cv2.absdiff(around[dy : dy + height, dx : dx + width], was))
            least = np.minimum(least, np.maximum(np.maximum(red, green), blue))
    return least[inside].astype(float)
