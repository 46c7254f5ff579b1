"""Views as another camera at the same place shows them: reduced, cropped, and fields at full height."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.body import geometry
from airborne.cameras import Camera
from airborne.video import View

Picture = NDArray[np.uint8]

shapes_of = lru_cache(maxsize=2)(geometry)  # flattened once per body, not once per picture


def seen_by(view: View, camera: Camera) -> Picture:
    """Show a view in the pixels of `camera`, which differs from the view's own in K and size only: (h, w, 3).

    Pixels between are interpolated, pixels outside repeat the edge. As K says where the rows of a field lie, a still
    scene does not move from field to field.
    """
    view_px_from_px = view.camera.K @ np.linalg.inv(camera.K)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    seen = cv2.warpAffine(view.rgb, view_px_from_px[:2], camera.size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
    return seen.astype(np.uint8, copy=False)
