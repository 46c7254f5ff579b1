"""Evidence summed over a body's mask: the fast score of the global search.

A map holds each pixel's evidence for the body, such as log p(colour | body) - log p(colour | background) [nats]. Its
cumulative sums along the image's columns are stored, so that a span of the mask costs two reads, whatever its length.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from airborne.body import SurfaceArrays
from airborne.cameras import Camera
from airborne.kernels import kernel
from airborne.rendering.packing import pack_view
from airborne.rendering.reduction import reduce_camera, reduce_image
from airborne.rendering.shapes import new_shapes, outline_all, pose_shapes
from airborne.rendering.spans import shown_rows, sort_runs
from airborne.rendering.threads import in_threads
from airborne.types import Array, Array32


@dataclass(frozen=True, slots=True, eq=False)
class EvidenceMaps:
    """Summed maps of several views. A kernel's row is a column of the image."""

    views: NDArray[np.float64]  # (v, 18) packed cameras
    sizes: NDArray[np.int64]  # (v, 3) pixels a row, rows, offset in `sums`
    sums: Array32  # row by row, pixels + 1 sums from the row's start
    totals: NDArray[np.float64]  # (v,) sum over the whole view


def evidence_maps(cameras: Sequence[Camera], maps: Sequence[Array32], *, scale: int = 1) -> EvidenceMaps:
    """Sum the maps (h, w) of the cameras' images, reduced `scale` times by averaging; a reduced pixel counts once."""
    small_maps = [reduce_image(np.asarray(plane, np.float32), scale) for plane in maps]
    small_cameras = [reduce_camera(camera, scale) for camera in cameras]
    assert len(small_cameras) == len(small_maps), "one map a camera"
    columns = [np.zeros((plane.shape[1], plane.shape[0] + 1), np.float32) for plane in small_maps]
    for sums, plane in zip(columns, small_maps, strict=True):
        np.cumsum(plane.T, axis=1, dtype=np.float32, out=sums[:, 1:])
    offsets = np.cumsum([0] + [sums.size for sums in columns])
    return EvidenceMaps(
        views=np.array([pack_view(camera, transposed=True) for camera in small_cameras]).reshape(-1, 18),
        sizes=np.array(
            [(c.size[1], c.size[0], at) for c, at in zip(small_cameras, offsets, strict=False)], np.int64
        ).reshape(-1, 3),
        sums=np.concatenate([sums.ravel() for sums in columns]),
        totals=np.array([sums[:, -1].sum(dtype=float) for sums in columns]),
    )


def mask_evidence(geometry: SurfaceArrays, maps: EvidenceMaps, R: Array, t: Array, *, threads: int = 1) -> Array:
    """Sum each map over the body's mask, each pixel once: (n, views).

    R (n, s, 3, 3), t (n, s, 3) [m]: world from segment, of n hypotheses. The result is the same for any
    number of threads.
    """
    R, t = np.ascontiguousarray(R, float), np.ascontiguousarray(t, float)
    out = np.zeros((len(R), len(maps.views)))

    def fill(part: slice) -> None:
        shapes = new_shapes(geometry)
        runs = _room_for_runs(geometry)
        _sum_evidence(shapes, geometry, R[part], t[part], maps.views, maps.sizes, maps.sums, *runs, out[part])

    in_threads(fill, len(R), threads)
    return out


def mask_out_surface(geometry: SurfaceArrays, maps: EvidenceMaps, R: Array, t: Array) -> EvidenceMaps:
    """Return the maps without what a posed body covers: zero there. R (s, 3, 3), t (s, 3) [m], world from segment.

    Of masks that share some segments, only the others have to be drawn on what these leave.
    """
    sums = maps.sums.copy()
    poses = np.ascontiguousarray(R, float), np.ascontiguousarray(t, float)
    runs = _room_for_runs(geometry)
    _sum_uncovered(new_shapes(geometry), geometry, *poses, maps.views, maps.sizes, maps.sums, *runs, sums)
    ends = [sums[at : at + rows * (pixels + 1)].reshape(rows, -1)[:, -1] for pixels, rows, at in maps.sizes]
    return replace(maps, sums=sums, totals=np.array([each.sum(dtype=float) for each in ends]))


def _room_for_runs(geometry: SurfaceArrays) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    n = 2 * (len(geometry.ellipsoid_segment) + len(geometry.polygon_segment))
    return np.empty(n, np.int64), np.empty(n, np.int64)


@kernel(fastmath=True)
def _sum_evidence(shapes, geometry, R, t, views, sizes, sums, firsts, lasts, out):
    """Fill `out` (n, views); see `mask_evidence`. firsts, lasts: room for a row's runs; see `sort_runs`."""
    for h in range(len(R)):
        pose_shapes(shapes, geometry, R[h], t[h])
        for i in range(len(views)):
            width, height, offset = sizes[i, 0], sizes[i, 1], sizes[i, 2]
            outline_all(shapes, geometry, views[i], width, height)
            top, bottom = shown_rows(shapes, height)
            total = 0.0
            for v in range(top, bottom + 1):
                base, covered = offset + v * (width + 1), -1
                for k in range(sort_runs(shapes, geometry, v, width, firsts, lasts)):
                    first, last = max(firsts[k], covered + 1), lasts[k]
                    if last >= first:
                        total += sums[base + last + 1] - sums[base + first]
                        covered = last
            out[h, i] = total


@kernel(fastmath=True)
def _sum_uncovered(shapes, geometry, R, t, views, sizes, sums, firsts, lasts, out):
    """Take the pixels that a body covers out of `out`, which is like `sums`; see `mask_out_surface`."""
    pose_shapes(shapes, geometry, R, t)
    for i in range(len(views)):
        width, height, offset = sizes[i, 0], sizes[i, 1], sizes[i, 2]
        outline_all(shapes, geometry, views[i], width, height)
        top, bottom = shown_rows(shapes, height)
        for v in range(top, bottom + 1):
            base, at, hidden = offset + v * (width + 1), 0, 0.0
            for k in range(sort_runs(shapes, geometry, v, width, firsts, lasts)):
                first, last = max(firsts[k], at), lasts[k]
                if last >= first:
                    for u in range(at, first):
                        out[base + u + 1] = sums[base + u + 1] - hidden
                    hidden += sums[base + last + 1] - sums[base + first]
                    for u in range(first, last + 1):
                        out[base + u + 1] = out[base + first]
                    at = last + 1
            for u in range(at, width):
                out[base + u + 1] = sums[base + u + 1] - hidden
