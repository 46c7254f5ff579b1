"""The empty scene of each camera (and field): at every pixel the median of the pictures in which it shows no body."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import Any

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
_TILE_PX = 64  # of those that are kept: 16 images of one fit into a core's cache

Source = tuple[int, bytes]  # a camera's number, and its matrix: that of a field


class EmptyScenes:
    """What lies behind the body, by camera and field: tile by tile, each found when it is first asked for."""

    def __init__(self, kept: Iterable[Frames], render_model: RenderModel, path: TrackedPath) -> None:
        self._images: dict[Source, list[NDArray[np.uint8]]] = {}
        maps: dict[Source, list[NDArray[np.uint8]]] = {}
        self._tiles: dict[tuple[Source, int, int], NDArray[np.uint8]] = {}
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
                maps.setdefault(source, []).append(covered)
        self._covered = {source: np.stack(each) for source, each in maps.items()}

    def behind(self, number: int, view: View, silhouette: Silhouette) -> NDArray[np.uint8] | None:
        """Return the empty scene in a silhouette's box (h, w, 3); None where too few images show it."""
        source = number, view.camera.K.tobytes()
        images = self._images[source]
        if len(images) < _FEWEST:
            return None
        x0, y0, x1, y1 = silhouette.box
        height, width = silhouette.mask.shape
        n_covered = self._covered[source].sum(axis=0, keepdims=True, dtype=np.uint16)
        n_covered = _enlarge(n_covered, (y0, y1), (x0, x1))[0]
        n_covered = cv2.resize(n_covered, (width, height), interpolation=cv2.INTER_NEAREST)
        if np.mean(n_covered[silhouette.mask > 0] > len(images) - _FEWEST_BARE) > _MOST_HIDDEN:
            return None
        scene = np.empty((y1 - y0, x1 - x0, 3), np.uint8)
        for top in range(y0 - y0 % _TILE_PX, y1, _TILE_PX):
            for left in range(x0 - x0 % _TILE_PX, x1, _TILE_PX):
                tile = self._tile(source, top, left)[max(y0 - top, 0) : y1 - top, max(x0 - left, 0) : x1 - left]
                y, x = max(top - y0, 0), max(left - x0, 0)
                scene[y : y + tile.shape[0], x : x + tile.shape[1]] = tile
        return scene

    def _tile(self, source: Source, top: int, left: int) -> NDArray[np.uint8]:
        """Return a tile of the empty scene (h, w, 3)."""
        if (source, top, left) not in self._tiles:
            images = np.stack([image[top : top + _TILE_PX, left : left + _TILE_PX] for image in self._images[source]])
            rows, columns = (top, top + images.shape[1]), (left, left + images.shape[2])
            covered = _enlarge(self._covered[source], rows, columns)
            self._tiles[source, top, left] = _upper_median(_without_body(images, covered > 0))
        return self._tiles[source, top, left]


def _enlarge(maps: NDArray[Any], rows: tuple[int, int], columns: tuple[int, int]) -> NDArray[Any]:
    """Return what reduced maps (n, h', w') hold at these rows and columns of the image: (n, h, w)."""
    _, height, width = maps.shape
    y, x = np.arange(*rows) // _REDUCTION, np.arange(*columns) // _REDUCTION
    return maps.take(np.minimum(y, height - 1), axis=1).take(np.minimum(x, width - 1), axis=2)


def _without_body(images: NDArray[np.uint8], covered: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Blank images (n, h, w, 3), in place, where they are covered (n, h, w), black and white by turns.

    As many are then below the others' median as above it, but for one below; `_upper_median` still finds it.
    """
    if covered.any():
        is_white = np.cumsum(covered, axis=0, dtype=np.uint8) % 2 == 0
        np.copyto(images, np.where(is_white, np.uint8(255), np.uint8(0))[..., None], where=covered[..., None])
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
