"""Which field of an interlaced picture is the first: both answers as pictures, the correct one with smaller teeth."""

from __future__ import annotations

from functools import lru_cache
from itertools import islice, pairwise
from pathlib import Path
from threading import Lock

import cv2
import numpy as np

from airborne.errors import VideoError
from airborne.export.pictures import encode_jpeg
from airborne.types import Image
from airborne.video.containers import open_file, video_stream
from airborne.video.pixels import rgb_from_frame

ORDERS = {"top-first": 1, "bottom-first": 0}  # and the rows of the field that is the later one of its picture
_N_LOOKED_AT = 25  # pictures from the middle of the file: about a second
_CROP_PX = (240, 160)  # about what moves most
_MOST_KEPT = 32  # files
_decoding = Lock()  # the second order of a file waits for the first


def weave_orders(path: Path) -> dict[str, Image]:
    """Weave the last field of a picture with the first of the next, by either order: parts of images (h, w, 3).

    By the right order the two are one field apart in time, by the other three: its teeth are three times as long.
    Raises VideoError for a file without two pictures.
    """
    with open_file(path.name, path) as container:
        stream = video_stream(container)
        if stream is None:
            raise VideoError(f"{path.name} holds no video stream; give a video, or copy it again")
        container.seek((container.duration or 0) // 2)
        images = [
            rgb_from_frame(frame, short_side=min(frame.width, frame.height), is_exact=False)
            for frame in islice(container.decode(stream), _N_LOOKED_AT)
        ]
    if len(images) < 2:
        raise VideoError(f"{path.name} holds fewer than two pictures from its middle on; give a longer video")
    before, after = max(pairwise(images), key=lambda pair: float(cv2.absdiff(*pair).mean()))
    rows, columns = _most_moving(before, after)
    found = {}
    for order, later in ORDERS.items():
        woven = after.copy()
        woven[later::2] = before[later::2]
        found[order] = woven[rows, columns]
    return found


def order_jpeg(path: Path, order: str) -> bytes:
    """Return one of `weave_orders` as a picture, of which a page asks for both at once. Raises VideoError."""
    status = path.stat()
    with _decoding:
        return _order_jpegs(path, status.st_mtime_ns, status.st_size)[order]


@lru_cache(maxsize=_MOST_KEPT)
def _order_jpegs(path: Path, *stamp: int) -> dict[str, bytes]:
    return {order: encode_jpeg(np.ascontiguousarray(image)) for order, image in weave_orders(path).items()}


def _most_moving(before: Image, after: Image) -> tuple[slice, slice]:
    """Return the rows and columns about what differs most between two images."""
    height, width = before.shape[:2]
    w, h = min(_CROP_PX[0], width), min(_CROP_PX[1], height)
    moved = cv2.blur(cv2.absdiff(before, after).max(axis=2).astype(np.float32), (w // 2, h // 2))
    v, u = np.unravel_index(int(moved.argmax()), moved.shape)
    top, left = int(np.clip(v - h // 2, 0, height - h)), int(np.clip(u - w // 2, 0, width - w))
    return slice(top, top + h), slice(left, left + w)
