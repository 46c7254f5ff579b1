"""What stands out and is not covered: connected pixels like the body, near it, that no part of it explains."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.appearance.model import Region
from airborne.body import PosedBody
from airborne.tracking.model_based.render_model import RenderModel
from airborne.types import Array, Array32

_BODY_LIKE = 0.8  # least probability to be body
_RIM_M = 0.02  # what lies this close to the mask may be flesh, hair or clothes
_WIDTH_M = 0.03  # thinner things are no limb
_AREA_M2 = 0.03 * 0.09  # a forearm seen end on and half covered


class Uncovered(NamedTuple):
    """What stands out in each of v regions, as wide as a limb, and is not covered."""

    pixels: list[NDArray[np.bool_]]  # (h, w) of each region: of patches that are large enough for a limb
    beside_m2: Array  # (v, segments) [m²] nearest to each segment, smaller patches too


def find_uncovered(
    render_model: RenderModel, posed: PosedBody, regions: Sequence[Region], posteriors: Sequence[Array32]
) -> Uncovered:
    """Find what is like the body and not covered, wide enough for a limb."""
    views = zip(regions, posteriors, strict=True)
    found = [_in_one_view(render_model, posed, *view) for view in views]
    return Uncovered([each[0] for each in found], np.array([each[1] for each in found]).reshape(-1, len(posed.R)))


def _in_one_view(
    render_model: RenderModel, posed: PosedBody, region: Region, posterior: Array32
) -> tuple[NDArray[np.bool_], Array]:
    """Return the pixels (h, w) of large uncovered patches, and the area beside each segment: (segments,) [m²]."""
    depth_m = float(np.median(posed.t @ region.packed_view[6:9] + region.packed_view[11]))
    px_per_m = np.array([region.camera.K[0, 0], region.camera.K[1, 1]]) / max(depth_m, 0.1)
    part = render_model.draw_parts(posed, region)
    covered = (part >= 0).astype(np.uint8)
    near = cv2.dilate(covered, _ellipse(2 * _RIM_M * px_per_m))
    stands_out = ((posterior > _BODY_LIKE) & (near == 0)).astype(np.uint8)
    opened = np.asarray(cv2.morphologyEx(stands_out, cv2.MORPH_OPEN, _ellipse(_WIDTH_M * px_per_m)), np.uint8)
    if not opened.any() or not covered.any():
        return opened > 0, np.zeros(len(posed.R))
    around, is_large_patch = _box(opened), np.zeros(opened.shape, bool)
    _, label, stats, _ = cv2.connectedComponentsWithStats(opened[around], connectivity=8)
    is_large = stats[:, cv2.CC_STAT_AREA] >= _AREA_M2 * px_per_m.prod()
    is_large[0] = False
    is_large_patch[around] = is_large[label]
    both = _box(np.asarray(opened | covered, np.uint8))
    owner = _nearest_part(part[both])[opened[both] > 0]
    n_px = np.bincount(render_model.segment_of_part[owner], minlength=len(posed.R))
    return is_large_patch, n_px / px_per_m.prod()


def _box(mask: NDArray[np.uint8]) -> tuple[slice, slice]:
    """Return the rows and columns around the pixels of a mask (h, w)."""
    x, y, width, height = cv2.boundingRect(mask)
    return slice(y, y + height), slice(x, x + width)


def _nearest_part(part: NDArray[np.int16]) -> NDArray[np.int16]:
    """Return the part that is nearest to each pixel, given those (h, w) that pixels show, -1 where none."""
    is_empty = (part < 0).astype(np.uint8)
    _, label = cv2.distanceTransformWithLabels(is_empty, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    label = np.asarray(label, np.int64)
    part_of_label = np.full(int(label.max()) + 1, -1, np.int16)
    part_of_label[label[part >= 0]] = part[part >= 0]
    return part_of_label[label]


def _ellipse(size_px: Array) -> NDArray[np.uint8]:
    width, height = np.maximum(np.round(size_px), 1).astype(int).tolist()
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (width, height)), np.uint8)
