"""The empty scene of each camera (and field): at every pixel the median of the pictures in which it shows no body."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.self_check.path import TrackedPath
from airborne.tracking.self_check.registration import Silhouette
from airborne.video import Frames, View

_FEWEST = 4  # images of one camera from which the empty scene can be told
_FEWEST_BARE = 3  # images in which a pixel shows no body, for their median to show the scene: one may be wrong
_REDUCTION = 4  # of the maps of what the body covers
_CELL = np.ones((3, 3), np.uint8)  # they are a cell wider all round, as the drawn body is not quite the true one
_MOST_HIDDEN = 0.15  # share of a silhouette whose scene is not shown


class EmptyScenes:
    """What lies behind the body, by camera and field."""

    def __init__(self, kept: Iterable[Frames], render_model: RenderModel, path: TrackedPath) -> None:
        self._images: dict[tuple[int, bytes], list[NDArray[np.uint8]]] = {}
        self._covered: dict[tuple[int, bytes], list[NDArray[np.uint8]]] = {}
        for frames in kept:
            row = path.row(frames.index)
            for number, view in enumerate(frames.views):
                if view is None:
                    continue
                source = number, view.camera.K.tobytes()
                self._images.setdefault(source, []).append(view.rgb)
                width, height = (max(1, n // _REDUCTION) for n in view.camera.size)
                covered = np.zeros((height, width), np.uint8)
                if row is not None:
                    small = view.camera.resample(scale=(_REDUCTION, _REDUCTION), size=(width, height))
                    posed = render_model.with_pose(path.pose_after(row, view.delay_s))
                    is_covered = (render_model.draw(posed, small).part >= 0).astype(np.uint8)
                    covered = np.asarray(cv2.dilate(is_covered, _CELL), np.uint8)
                self._covered.setdefault(source, []).append(covered)

    def behind(self, number: int, view: View, silhouette: Silhouette) -> NDArray[np.uint8] | None:
        """Return the empty scene in a silhouette's box (h, w, 3); None where too few images show it."""
        source = number, view.camera.K.tobytes()
        images = self._images[source]
        if len(images) < _FEWEST:
            return None
        x0, y0, x1, y1 = silhouette.box
        rows, columns = np.arange(y0, y1) // _REDUCTION, np.arange(x0, x1) // _REDUCTION
        small = np.stack(self._covered[source])
        rows, columns = np.minimum(rows, small.shape[1] - 1), np.minimum(columns, small.shape[2] - 1)
        covered = small[:, rows[:, None], columns]
        height, width = silhouette.mask.shape
        n_covered = np.asarray(covered.sum(axis=0), np.float32)
        n_covered = cv2.resize(n_covered, (width, height), interpolation=cv2.INTER_NEAREST)
        if np.mean(n_covered[silhouette.mask > 0] > len(images) - _FEWEST_BARE) > _MOST_HIDDEN:
            return None
        return _upper_median(_without_body(np.stack([image[y0:y1, x0:x1] for image in images]), covered > 0))


def _without_body(images: NDArray[np.uint8], covered: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Blank images (n, h, w, 3), in place, where they are covered (n, h, w), black and white by turns.

    As many are then below the others' median as above it, but for one below; `_upper_median` still finds it.
    """
    is_white = np.cumsum(covered, axis=0, dtype=np.uint8)[covered] % 2 == 0
    images[covered] = np.where(is_white, np.uint8(255), np.uint8(0))[:, None]
    return images


def _upper_median(ranked: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the median of images (n, h, w, 3), which are ranked in place; of an even number, the upper middle one.

    Whole images are exchanged, as in a bubble sort: twenty times faster than NumPy's partition along them.
    """
    middle, lower = len(ranked) // 2, np.empty_like(ranked[0])
    for last in range(len(ranked) - 1, middle - 1, -1):
        for low, high in pairwise(ranked[: last + 1]):
            np.minimum(low, high, out=lower)
            np.maximum(low, high, out=high)
            low[:] = lower
    return ranked[middle]
