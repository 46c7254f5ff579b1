"""The empty scene of a static camera: what its pictures show where nothing moves, and what stands out from it.

Each pixel's median over pictures spread over the recording, with its robust spread. No colour of any body is asked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.geometry.robust import SD_OF_MEDIAN_DEVIATION
from airborne.kernels import kernel
from airborne.types import Array32, Image

FEWEST_PICTURES = 5  # with fewer, a median is no empty scene
_DARKEST = np.float32(0.35)  # shadow, of the background's light
PIXEL_EVIDENCE_LIMIT = 3.0  # [nats] bound of one pixel's evidence: neighbours err alike
_LEAST_SD = 2.5  # [grey levels] of what compression and light change from picture to picture
_RANGE = 128.0  # [grey levels] over which a body's differences from the background are taken to be uniform
_BLUR_PX = 0.8  # sd of the blur of differences


@dataclass(frozen=True, slots=True, eq=False)
class EmptyScene:
    """What one camera sees where nothing moves."""

    rgb: Array32  # (h, w, 3) median [sRGB grey levels]
    sd: Array32  # (h, w) of the largest channel difference of a picture from it [grey levels]

    def evidence(self, rgb: Image) -> Array32:
        """Return each pixel's evidence to show something else (h, w): a log-likelihood ratio [nats], bounded.

        Differences are half-normal where the scene is empty, uniform over 128 grey levels where it is not.
        """
        distance = cv2.GaussianBlur(difference(rgb, self.rgb), (0, 0), _BLUR_PX)
        nats = (distance / self.sd) ** 2 / 2 + np.log(self.sd * np.sqrt(np.pi / 2) / _RANGE)
        return np.asarray(np.clip(nats, -PIXEL_EVIDENCE_LIMIT, PIXEL_EVIDENCE_LIMIT), np.float32)


def estimate_empty_scene(pictures: Sequence[Image]) -> EmptyScene:
    """Take the median of pictures (h, w, 3) of one static camera, at least FEWEST_PICTURES, and their spread."""
    stack = np.stack(pictures)
    middle = len(stack) // 2
    median = np.partition(stack, middle, axis=0)[middle].astype(np.float32)
    distances = np.stack([difference(each, median) for each in stack])
    spread = SD_OF_MEDIAN_DEVIATION * np.partition(distances, middle, axis=0)[middle]
    sd = np.hypot(cv2.GaussianBlur(spread, (0, 0), 1.5), max(float(np.median(spread)), _LEAST_SD))
    return EmptyScene(median, np.asarray(sd, np.float32))


def difference(image: NDArray[np.uint8], background: Array32) -> Array32:
    """Return how far pixels differ from the background (h, w) [grey levels]; where it is only darker, by hue alone."""
    out = np.empty(image.shape[:2], np.float32)
    _fill_difference(image, background, out)
    return out


@kernel
def _fill_difference(image, background, out):
    h, w, _ = image.shape
    for y in range(h):
        for x in range(w):
            b0, b1, b2 = background[y, x, 0], background[y, x, 1], background[y, x, 2]
            i0, i1, i2 = np.float32(image[y, x, 0]), np.float32(image[y, x, 1]), np.float32(image[y, x, 2])
            share = (i0 * b0 + i1 * b1 + i2 * b2) / max(b0 * b0 + b1 * b1 + b2 * b2, np.float32(1))
            if not (share > _DARKEST and share < np.float32(1)):
                share = np.float32(1)
            out[y, x] = max(abs(i0 - share * b0), abs(i1 - share * b1), abs(i2 - share * b2))
