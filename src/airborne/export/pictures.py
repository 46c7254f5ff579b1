"""Images as JPEG and PNG."""

from __future__ import annotations

import cv2
import numpy as np

from airborne.types import Image

_QUALITY = 92  # of 100


def encode_jpeg(image: Image, quality: int = _QUALITY) -> bytes:
    """Encode an image (h, w, 3) sRGB."""
    return _encode(image, ".jpg", [cv2.IMWRITE_JPEG_QUALITY, quality])


def encode_png(image: Image, *, is_small: bool = False) -> bytes:
    """Encode an image (h, w, 3) sRGB; `is_small` takes its time for a smaller file."""
    return _encode(image, ".png", [cv2.IMWRITE_PNG_COMPRESSION, 9] if is_small else [])


def _encode(image: Image, ending: str, options: list[int]) -> bytes:
    bgr = cv2.cvtColor(image, cv2.COLOR_RGB2BGR)  # five times as fast as turning the array's last axis round
    is_done, encoded = cv2.imencode(ending, bgr, options)
    assert is_done, "an image in memory can be encoded"
    return encoded.tobytes()


def thumbnail(image: Image, width: int) -> bytes:
    """Encode an image reduced to a width [px]."""
    height = max(1, round(image.shape[0] * width / image.shape[1]))
    return encode_jpeg(cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA).astype(np.uint8))
