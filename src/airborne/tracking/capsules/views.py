"""The regions of the images around one player, as cumulative sums of evidence maps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.appearance.surface_classes import blur_maps, class_evidence
from airborne.cameras import Camera
from airborne.tracking.capsules.jumper import SURFACE_CLASSES
from airborne.tracking.capsules.spans import cumulative_sums
from airborne.types import Array, Array32
from airborne.video import Frames, View

HALF_WIDTH_M, HALF_HEIGHT_M, _BELOW_HIPS_M = 0.8, 1.2, 0.28  # the region around the hips
_LEAST_SIDE_PX = 24  # of a region in the image; smaller ones are dropped
_PX_PER_M = 60.0  # about what the maps are reduced to


@dataclass(frozen=True, slots=True, eq=False)
class PlayerRegion:
    """The region of one image around a player."""

    view: int  # which camera
    camera: Camera  # of the whole image
    box: tuple[int, int, int, int]  # x0, y0, x1, y1 [px]
    rgb: NDArray[np.uint8]  # (h, w, 3)

    @property
    def region_camera(self) -> Camera:
        """Camera of the region's own pixels."""
        x0, y0, x1, y1 = self.box
        return self.camera.resample(scale=(1, 1), offset=(x0, y0), size=(x1 - x0, y1 - y0))


class EvidenceTable(NamedTuple):
    """One camera's evidence by colour."""

    occlusion: Array  # (5,) that the evidence assumes
    evidence: Array32  # (32768, 8) [nat]
    expected: Array  # (5,) mean over unoccluded pixels of a class [nat]
    contrast: Array  # (5,) expected less the mean over the background's pixels [nat]


class MapScale(NamedTuple):
    """How the evidence maps of one player are made."""

    reduction: int  # of the images
    px_per_m: float  # of the maps, about


@dataclass(frozen=True, slots=True, eq=False)
class RegionMaps:
    """Kernel arguments of all regions: maps of one size, reduced to about 60 pixels a metre."""

    scale: MapScale
    cameras: Array  # (v, 4, 4): K [R t] of the reduced region, then the focal length
    sums: Array32  # (v, classes + 1, h, w + 1); the last map is empty
    contrast: Array  # (v, classes + 1) drop of evidence from inside to outside [nat]


def player_regions(frames: Frames, hips: Array) -> tuple[PlayerRegion, ...]:
    """Crop the images around hips (3,) [m]; views that do not show them are left out."""
    regions = (_region(v, view, hips) for v, view in enumerate(frames.views) if view is not None)
    return tuple(region for region in regions if region is not None)


def _region(number: int, view: View, hips: Array) -> PlayerRegion | None:
    x, y, depth_m = view.camera.P @ [*(hips - [0, 0, _BELOW_HIPS_M]), 1]
    if not depth_m > 0:
        return None
    px = np.array([x, y]) / depth_m
    half = view.camera.K[0, 0] / depth_m * np.array([HALF_WIDTH_M, HALF_HEIGHT_M])
    low = np.maximum(np.floor(px - half), 0).astype(int)
    high = np.minimum(np.ceil(px + half), view.camera.size).astype(int)
    if (high - low).min() < _LEAST_SIDE_PX:
        return None
    box = (int(low[0]), int(low[1]), int(high[0]), int(high[1]))
    return PlayerRegion(number, view.camera, box, view.crop(box))


def px_per_m(camera: Camera, point: Array) -> float:
    """Return how many pixels a metre across the view has at a point (3,) [m]; 0 behind the camera."""
    depth_m = float(camera.camera_from_world.apply(point)[2])
    return float(camera.K[0, 0]) / depth_m if depth_m > 0 else 0.0


def map_scale(regions: Sequence[PlayerRegion], hips: Array) -> MapScale:
    """Return how to reduce the images of these regions."""
    whole = float(np.median([px_per_m(region.camera, hips) for region in regions]))
    reduction = max(1, round(whole / _PX_PER_M))
    return MapScale(reduction, whole / reduction)


def map_evidence(regions: Sequence[PlayerRegion], tables: Sequence[EvidenceTable], scale: MapScale) -> RegionMaps:
    """Look up every pixel's evidence; tables are those of the regions."""
    r, k = scale.reduction, len(SURFACE_CLASSES)
    sizes = [((y1 - y0) // r, (x1 - x0) // r) for x0, y0, x1, y1 in (region.box for region in regions)]
    h, w = max(size[0] for size in sizes), max(size[1] for size in sizes)
    sums = np.zeros((len(regions), k + 1, h, w + 1), np.float32)
    cameras = np.zeros((len(regions), 4, 4))
    for i, (region, table, (rows, columns)) in enumerate(zip(regions, tables, sizes, strict=True)):
        raw, smoothed = np.empty((2, k, rows, columns), np.float32)
        class_evidence(region.rgb, table.evidence, r, raw)
        blur_maps(raw, smoothed)
        filled = np.empty((k, rows, columns + 1), np.float32)
        cumulative_sums(smoothed, filled)
        sums[i, :k, :rows, : columns + 1] = filled
        sums[i, :k, :rows, columns + 1 :] = filled[:, :, -1:]
        x0, y0, _, _ = region.box
        cameras[i] = pack_camera(region.camera, r, (x0 + (r - 1) / 2, y0 + (r - 1) / 2))
    contrast = np.array([[*table.contrast, 0.0] for table in tables])
    return RegionMaps(scale, cameras, sums, contrast)


def pack_camera(camera: Camera, reduction: int = 1, offset: tuple[float, float] = (0.0, 0.0)) -> Array:
    """Pack a camera for the capsule kernels: (4, 4); pixel (i, j) is the image's at reduction (i, j) + offset."""
    matrix = np.zeros((4, 4))
    matrix[:3] = camera.P / reduction
    matrix[:2] -= np.outer(offset, matrix[2])
    matrix[2] *= reduction
    matrix[3, 0] = (camera.K[0, 0] + camera.K[1, 1]) / (2 * reduction)
    return matrix
