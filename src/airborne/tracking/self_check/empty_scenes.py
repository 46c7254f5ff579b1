"""The empty scene of each camera (and field): the median picture over frames in which the body is elsewhere."""

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
_REDUCTION = 8  # of the maps of how often the body covers a pixel
_MOST_COVERED = 0.45  # share of the images in which a pixel may be covered, for the median to show the scene
_MOST_HIDDEN = 0.15  # share of a silhouette whose scene is not shown


class EmptyScenes:
    """What lies behind the body, by camera and field."""

    def __init__(self, kept: Iterable[Frames], render_model: RenderModel, path: TrackedPath) -> None:
        self._images: dict[tuple[int, bytes], list[NDArray[np.uint8]]] = {}
        self._covered: dict[tuple[int, bytes], NDArray[np.float32]] = {}
        for frames in kept:
            row = path.row(frames.index)
            for number, view in enumerate(frames.views):
                if view is None:
                    continue
                source = number, view.camera.K.tobytes()
                self._images.setdefault(source, []).append(view.rgb)
                width, height = (max(1, n // _REDUCTION) for n in view.camera.size)
                covered = self._covered.setdefault(source, np.zeros((height, width), np.float32))
                if row is None:
                    continue
                small = view.camera.resample(scale=(_REDUCTION, _REDUCTION), size=(width, height))
                posed = render_model.with_pose(path.pose_after(row, view.delay_s))
                covered += render_model.draw(posed, small).part >= 0

    def behind(self, number: int, view: View, silhouette: Silhouette) -> NDArray[np.uint8] | None:
        """Return the empty scene in a silhouette's box (h, w, 3); None where too few images show it."""
        source = number, view.camera.K.tobytes()
        images = self._images[source]
        if len(images) < _FEWEST:
            return None
        x0, y0, x1, y1 = silhouette.box
        share = np.asarray(self._covered[source] / len(images), np.float32)
        share = cv2.resize(share, view.camera.size, interpolation=cv2.INTER_NEAREST)
        height, width = silhouette.mask.shape
        share = cv2.resize(share[y0:y1, x0:x1], (width, height), interpolation=cv2.INTER_NEAREST)
        if np.mean(share[silhouette.mask > 0] > _MOST_COVERED) > _MOST_HIDDEN:
            return None
        return _upper_median([image[y0:y1, x0:x1] for image in images])


def _upper_median(images: list[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """Return the median of images of the same shape; of an even number, the upper of the two in the middle.

    Whole images are exchanged, as in a bubble sort: twenty times faster than NumPy's partition along them.
    """
    ranked, middle = np.stack(images), len(images) // 2
    lower = np.empty_like(ranked[0])
    for last in range(len(images) - 1, middle - 1, -1):
        for low, high in pairwise(ranked[: last + 1]):
            np.minimum(low, high, out=lower)
            np.maximum(low, high, out=high)
            low[:] = lower
    return ranked[middle]
