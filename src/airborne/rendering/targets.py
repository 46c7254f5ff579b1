"""The observed images, packed for the kernels once a frame: transposed, in blocks of 16 pixels, padded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.kernels import kernel
from airborne.rendering.evidence import EvidenceMaps, evidence_maps
from airborne.rendering.lights import Lights
from airborne.rendering.packing import pack_lights, pack_view
from airborne.rendering.reduction import reduce_camera, reduce_image
from airborne.rendering.rows import LANES
from airborne.types import Array32
from airborne.video import View


@dataclass(frozen=True, slots=True, eq=False)
class Targets:
    """The images that a hypothesis is compared with. A kernel's row is a column of the image."""

    views: NDArray[np.float64]  # (v, 18) packed cameras
    sizes: NDArray[np.int64]  # (v, 3) pixels a row, rows, offset in `images`
    lights: Array32  # (v, l, 8) packed lamps
    ambient: np.float32
    images: NDArray[np.uint8]  # blocks of 16 reds, 16 greens, 16 blues
    foreground: EvidenceMaps | None  # 1 where a pixel looks like the body, 0 elsewhere


def pack_targets(
    views: Sequence[View | None],
    lights: Lights,
    *,
    scale: int = 1,
    evidence: Sequence[NDArray[np.floating] | None] | None = None,
) -> Targets:
    """Pack the views that exist, reduced `scale` times (1, 2, 4) by averaging areas.

    `evidence` (h, w), one map a view that exists, is each pixel's log-likelihood ratio of body against background
    [nats]: where it is above zero the pixel is foreground, which the rule "union" counts. Raises CalibrationError for a
    distorted camera.
    """
    present = [view for view in views if view is not None]
    cameras = [reduce_camera(view.camera, scale) for view in present]
    blocks = [-(-camera.size[1] // LANES) for camera in cameras]
    lengths = [3 * LANES * n * camera.size[0] for n, camera in zip(blocks, cameras, strict=True)]
    offsets = np.concatenate([[0], np.cumsum(lengths, dtype=np.int64)])
    images = np.zeros(offsets[-1], np.uint8)
    for view, camera, n, start, stop in zip(present, cameras, blocks, offsets, offsets[1:], strict=False):
        _pack_pixels(reduce_image(view.rgb, scale), images[start:stop].reshape(camera.size[0], n, 3, LANES))
    foreground = None
    if evidence is not None:
        masks = [
            (e > 0).astype(np.float32)
            for view, e in zip(views, evidence, strict=True)
            if view is not None and e is not None
        ]
        foreground = evidence_maps([view.camera for view in present], masks, scale=scale)
    return Targets(
        views=np.array([pack_view(camera, transposed=True) for camera in cameras]).reshape(-1, 18),
        sizes=np.array([(c.size[1], c.size[0], at) for c, at in zip(cameras, offsets, strict=False)], np.int64).reshape(
            -1, 3
        ),
        lights=np.array([pack_lights(lights, camera, transposed=True) for camera in cameras], np.float32).reshape(
            len(cameras), len(lights.lamps), 8
        ),
        ambient=np.float32(lights.ambient),
        images=images,
        foreground=foreground,
    )


@kernel(fastmath=True)
def _pack_pixels(rgb, out):
    """Copy rgb (h, w, 3) to `out` (w, blocks, 3, LANES)."""
    height, width, _ = rgb.shape
    for b in range((height + LANES - 1) // LANES):
        for u in range(width):
            for j in range(min(LANES, height - b * LANES)):
                for c in range(3):
                    out[u, b, c, j] = rgb[b * LANES + j, u, c]
