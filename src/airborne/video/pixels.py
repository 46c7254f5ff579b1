"""Decoded frames to sRGB arrays and back; fields are separated in the stored planes, before chroma is interpolated."""

from __future__ import annotations

import av
import numpy as np
from av.video.plane import VideoPlane
from av.video.reformatter import ColorRange, Colorspace, Interpolation

from airborne.types import Image

_SD_SIDE_PX = 576  # [px] up to this shorter side an untagged video is BT.601, above it BT.709
UNSPECIFIED_MATRIX = 2  # a frame's colour matrix where the file does not state one (ITU-T H.273)
_EXACT_COLOUR = Interpolation.BILINEAR | Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INT


def matrix_for(short_side: int) -> Colorspace:
    """Return the colour matrix assumed for an untagged video: its shorter side [px] tells SD from HD."""
    return Colorspace.ITU601 if short_side <= _SD_SIDE_PX else Colorspace.ITU709


def rgb_from_frame(frame: av.VideoFrame, *, short_side: int, rotation_deg: int = 0, is_exact: bool = True) -> Image:
    """Convert a decoded frame (or one field of it) to sRGB: (h, w, 3) uint8, contiguous.

    The file's colour matrix and range are used; without a matrix, the recording's shorter side [px] decides
    (`matrix_for`). Grey streams are full range. Any bit depth comes out as 8 bits. Missing chroma is interpolated
    within the given frame, and rounding has no bias. `rotation_deg` rotates the image anticlockwise by quarter turns,
    as a phone's rotation tag asks. The transfer curve is left as recorded, and pixels are not made square.
    Where only a person looks at it, not `is_exact`, it takes a tenth of the time and is darker by a grey level.
    """
    matrix = matrix_for(short_side) if frame.colorspace == UNSPECIFIED_MATRIX else None
    rgb = frame.reformat(
        format="rgb24",
        src_colorspace=matrix,
        dst_color_range=ColorRange.JPEG,
        interpolation=_EXACT_COLOUR if is_exact else Interpolation.FAST_BILINEAR,
        threads=1,
    ).to_ndarray()
    return np.ascontiguousarray(np.rot90(rgb, rotation_deg // 90), np.uint8)


def frame_from_rgb(rgb: Image, *, short_side: int, pix_fmt: str = "yuv420p") -> av.VideoFrame:
    """Convert sRGB (h, w, 3) to a frame of limited range, with the matrix for the recording's shorter side [px]."""
    return av.VideoFrame.from_ndarray(np.ascontiguousarray(rgb)).reformat(
        format=pix_fmt,
        dst_colorspace=matrix_for(short_side),
        dst_color_range=ColorRange.MPEG,
        interpolation=Interpolation.AREA | Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INP,
        threads=1,
    )


def field_frame(frame: av.VideoFrame, parity: int) -> av.VideoFrame:
    """Return one field of an interlaced frame, its own luma and chroma rows only: parity 0 is the top field.

    In interlaced 4:2:0 and 4:2:2 the chroma rows alternate between the fields just as the luma rows do.
    """
    field = av.VideoFrame(frame.width, (frame.height - parity + 1) // 2, frame.format.name)
    field.colorspace, field.color_range = frame.colorspace, frame.color_range
    for source, target in zip(frame.planes, field.planes, strict=True):
        _copy_rows(plane_rows(target), plane_rows(source)[parity::2])
    return field


def weave_frame(top: av.VideoFrame, bottom: av.VideoFrame) -> av.VideoFrame:
    """Return the interlaced frame of two fields of equal size and format: the inverse of `field_frame`."""
    frame = av.VideoFrame(top.width, top.height + bottom.height, top.format.name)
    frame.colorspace, frame.color_range = top.colorspace, top.color_range
    for parity, field in enumerate((top, bottom)):
        for source, target in zip(field.planes, frame.planes, strict=True):
            _copy_rows(plane_rows(target)[parity::2], plane_rows(source))
    return frame


def plane_rows(plane: VideoPlane) -> Image:
    """Return a plane's bytes, one stored line per row, top line first; writable."""
    rows = np.frombuffer(memoryview(plane), np.uint8).reshape(plane.height, abs(plane.line_size))
    return rows[::-1] if plane.line_size < 0 else rows


def _copy_rows(target: Image, source: Image) -> None:
    """Copy lines whose padding may differ; where the source lacks a line, its last is repeated."""
    width = min(target.shape[1], source.shape[1])
    target[: len(source), :width] = source[:, :width]
    target[len(source) :, :width] = source[-1:, :width]
