"""pictures.json: some pictures with what was drawn over them, reduced, which the report shows beside its curves."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from airborne.export.pictures import encode_jpeg
from airborne.geometry.even_sample import EvenSample
from airborne.io.writing import write_text
from airborne.types import Image

N_MOMENTS = 32  # at most; spread over the run
_LONGEST_SIDE_PX = 480  # larger images are reduced to it
_QUALITY = 75  # of 100


class Film:
    """Collects the pictures of moments spread evenly over a run; memory stays flat."""

    def __init__(self, path: Path, cameras: Sequence[str]) -> None:
        """Begin without pictures; `path` is the file that `write` writes."""
        self._path, self._cameras = path, list(cameras)
        self._moments: EvenSample[tuple[int, list[str]]] = EvenSample(N_MOMENTS)
        path.unlink(missing_ok=True)

    def add(self, frame: int, images: Sequence[Image]) -> None:
        """Keep every camera's image (h, w, 3) of a frame, or not."""
        self._moments.offer(lambda: (frame, [_encode(image) for image in images]))

    def write(self) -> None:
        """Write the file; none without a picture."""
        if len(self._moments):
            frames, jpegs = zip(*self._moments, strict=True)
            write_text(self._path, json.dumps({"cameras": self._cameras, "frame": frames, "jpegs": jpegs}))


def read_film(path: Path) -> dict[str, Any] | None:
    """Read the pictures: `cameras`, `frame` (n,) and `jpegs` (n, cameras), base64; None where there are none."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):  # a run without pictures, or one that was killed
        return None


def _encode(image: Image) -> str:
    height, width = image.shape[:2]
    share = min(1.0, _LONGEST_SIDE_PX / max(height, width))
    size = (max(1, round(share * width)), max(1, round(share * height)))
    small = cv2.resize(image, size, interpolation=cv2.INTER_AREA).astype(np.uint8)
    return base64.b64encode(encode_jpeg(small, _QUALITY)).decode()
