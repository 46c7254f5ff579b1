"""What stands out and is not covered: connected pixels like the body, near it, that no part of it explains."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.appearance.model import Region
from airborne.body import PosedBody
from airborne.tracking.model_based.render_model import RenderModel
from airborne.types import Array

_BODY_LIKE = 0.8  # least probability to be body
_RIM_M = 0.02  # what lies this close to the mask may be flesh, hair or clothes
_WIDTH_M = 0.03  # thinner things are no limb
_AREA_M2 = 0.03 * 0.09  # a forearm seen end on and half covered


def find_uncovered_pixels(
    render_model: RenderModel, posed: PosedBody, regions: Sequence[Region], posteriors: Sequence[Array]
) -> list[NDArray[np.bool_]]:
    """Return for each region which pixels (h, w) are like the body, wide enough for a limb, and not covered."""
    return [
        _in_one_view(render_model, posed, region, posterior)
        for region, posterior in zip(regions, posteriors, strict=True)
    ]


def _in_one_view(render_model: RenderModel, posed: PosedBody, region: Region, posterior: Array) -> NDArray[np.bool_]:
    depth_m = float(np.median(posed.t @ region.packed_view[6:9] + region.packed_view[11]))
    px_per_m = np.array([region.camera.K[0, 0], region.camera.K[1, 1]]) / max(depth_m, 0.1)
    covered = (render_model.draw_parts(posed, region) >= 0).astype(np.uint8)
    near = cv2.dilate(covered, _ellipse(2 * _RIM_M * px_per_m))
    stands_out = ((posterior > _BODY_LIKE) & (near == 0)).astype(np.uint8)
    opened = cv2.morphologyEx(stands_out, cv2.MORPH_OPEN, _ellipse(_WIDTH_M * px_per_m))
    _, label, stats, _ = cv2.connectedComponentsWithStats(opened, connectivity=8)
    is_large = stats[:, cv2.CC_STAT_AREA] >= _AREA_M2 * px_per_m.prod()
    is_large[0] = False
    return is_large[label]


def _ellipse(size_px: Array) -> NDArray[np.uint8]:
    width, height = np.maximum(np.round(size_px), 1).astype(int).tolist()
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (width, height)), np.uint8)
