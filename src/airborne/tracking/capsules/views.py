"""The regions of the pictures round one player, as running sums of evidence maps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.appearance.surface_classes import evidence_maps, smooth
from airborne.cameras import Camera
from airborne.tracking.capsules.equations import N_CAPSULES
from airborne.tracking.capsules.jumper import KINDS
from airborne.tracking.capsules.spans import running_sums
from airborne.video import Frames, View

Array = NDArray[np.floating]

HALF_WIDTH_M, HALF_HEIGHT_M, BELOW_HIPS_M = 0.8, 1.2, 0.28  # the region round the hips
LEAST_SIDE_PX = 24  # of a region in the picture; less of it shows nothing
_PX_PER_M = 60.0  # about what the maps are reduced to


@dataclass(frozen=True, slots=True, eq=False)
class Region:
    """The part of one picture round a player."""

    view: int  # which camera
    camera: Camera  # of the whole picture
    box: tuple[int, int, int, int]  # x0, y0, x1, y1 [px]
    rgb: NDArray[np.uint8]  # (h, w, 3)

    @property
    def full(self) -> Camera:
        """The camera of the region's own pixels."""
        x0, y0, x1, y1 = self.box
        return self.camera.resampled(scale=(1, 1), offset=(x0, y0), size=(x1 - x0, y1 - y0))


class Table(NamedTuple):
    """One camera's evidence by colour."""

    hidden: Array  # (5,) what it was made for
    evidence: NDArray[np.float32]  # (32768, 8) [nat]
    usual: Array  # (5,) mean over pixels of a kind that nothing covers [nat]
    contrast: Array  # (5,) the same less the mean over the background's pixels [nat]


class Scale(NamedTuple):
    """How the evidence maps of one player are made."""

    reduction: int  # of the pictures
    px_per_m: float  # of the maps, about


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """What the kernels take of all regions: maps of one size, reduced to about 60 pixels a metre."""

    scale: Scale
    cameras: Array  # (v, 4, 4): K [R t] of the reduced region, then the focal length
    sums: NDArray[np.float32]  # (v, kinds + 1, h, w + 1); the last map is empty
    contrast: Array  # (v, kinds + 1) how much evidence falls from inside to outside [nat]

    @property
    def maps(self) -> tuple[NDArray[np.float32], Array]:
        """What `gathered` takes of the maps."""
        return self.sums, self.contrast


def regions_round(frames: Frames, hips: Array) -> tuple[Region, ...]:
    """Cut out what the cameras show within reach of hips (3,) [m]; views without it are left out."""
    found = (_region(v, view, hips) for v, view in enumerate(frames.views) if view is not None)
    return tuple(region for region in found if region is not None)


def _region(number: int, view: View, hips: Array) -> Region | None:
    x, y, depth_m = view.camera.P @ [*(hips - [0, 0, BELOW_HIPS_M]), 1]
    if not depth_m > 0:
        return None
    px = np.array([x, y]) / depth_m
    half = view.camera.K[0, 0] / depth_m * np.array([HALF_WIDTH_M, HALF_HEIGHT_M])
    low = np.maximum(np.floor(px - half), 0).astype(int)
    high = np.minimum(np.ceil(px + half), view.camera.size).astype(int)
    if (high - low).min() < LEAST_SIDE_PX:
        return None
    box = (int(low[0]), int(low[1]), int(high[0]), int(high[1]))
    return Region(number, view.camera, box, view.crop(box))


def px_per_m(camera: Camera, point: Array) -> float:
    """Return how many pixels a metre across the view has at a point (3,) [m]; 0 behind the camera."""
    depth_m = float(camera.camera_from_world.apply(point)[2])
    return float(camera.K[0, 0]) / depth_m if depth_m > 0 else 0.0


def scale_of(regions: Sequence[Region], hips: Array) -> Scale:
    """Return how to reduce the pictures of these regions."""
    whole = float(np.median([px_per_m(region.camera, hips) for region in regions]))
    reduction = max(1, round(whole / _PX_PER_M))
    return Scale(reduction, whole / reduction)


def seen(regions: Sequence[Region], tables: Sequence[Table], scale: Scale) -> Seen:
    """Look every pixel's evidence up; tables are those of the regions."""
    r, k = scale.reduction, len(KINDS)
    sizes = [((y1 - y0) // r, (x1 - x0) // r) for x0, y0, x1, y1 in (region.box for region in regions)]
    h, w = max(size[0] for size in sizes), max(size[1] for size in sizes)
    sums = np.zeros((len(regions), k + 1, h, w + 1), np.float32)
    cameras = np.zeros((len(regions), 4, 4))
    for i, (region, table, (rows, columns)) in enumerate(zip(regions, tables, sizes, strict=True)):
        raw, smoothed = np.empty((2, k, rows, columns), np.float32)
        evidence_maps(region.rgb, table.evidence, r, raw)
        smooth(raw, smoothed)
        filled = np.empty((k, rows, columns + 1), np.float32)
        running_sums(smoothed, filled)
        sums[i, :k, :rows, : columns + 1] = filled
        sums[i, :k, :rows, columns + 1 :] = filled[:, :, -1:]
        x0, y0, _, _ = region.box
        cameras[i] = packed(region.camera, r, (x0 + (r - 1) / 2, y0 + (r - 1) / 2))
    contrast = np.array([[*table.contrast, 0.0] for table in tables])
    return Seen(scale, cameras, sums, contrast)


def packed(camera: Camera, reduction: int = 1, offset: tuple[float, float] = (0.0, 0.0)) -> Array:
    """Pack a camera for the capsule kernels: (4, 4); pixel (i, j) is the picture's at reduction (i, j) + offset."""
    found = np.zeros((4, 4))
    found[:3] = camera.P / reduction
    found[:2] -= np.outer(offset, found[2])
    found[2] *= reduction
    found[3, 0] = (camera.K[0, 0] + camera.K[1, 1]) / (2 * reduction)
    return found


def workspace(found: Seen, n_others: int) -> tuple[tuple, Array]:
    """Allocate what `gathered` works in: (x, pieces, tangents) and owned."""
    n, (v, _, h, _) = N_CAPSULES + n_others, found.sums.shape
    return (np.empty((n, 2, h)), np.empty((n, 2, h), np.int64), np.empty((n, 2, 7))), np.zeros((v, n, 2, 2))
