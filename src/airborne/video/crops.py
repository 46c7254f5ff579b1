"""Crops of decoded frames to sRGB, without converting the rest: the same colours as `airborne.video.pixels` gives."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import av
import numpy as np
from av.video.reformatter import ColorRange, Colorspace
from numpy.typing import NDArray

from airborne.kernels import kernel
from airborne.types import Array32, Image
from airborne.video.frames import PixelBox
from airborne.video.pixels import UNSPECIFIED_MATRIX, matrix_for, plane_rows, rgb_from_frame

_ROWS_PER_CHROMA = {"yuv420p": 2, "yuvj420p": 2, "yuv422p": 1, "yuvj422p": 1}  # planar, 8 bits, chroma at half width
_LUMA_WEIGHTS = {  # red's and blue's share of the luma: BT.709, and BT.601 under its two tags
    Colorspace.ITU709: (0.2126, 0.0722),
    Colorspace.ITU601: (0.299, 0.114),
    6: (0.299, 0.114),
}
_SITINGS = ((0, 2), (1, 1))  # quarters of the neighbour's chroma: in even and in odd columns or rows
_PROBE_PX = 32  # side of the image that tests whether a crop converts as the whole does


@dataclass(frozen=True, slots=True, eq=False)
class ColourConversion:
    """How frames of one format convert to sRGB."""

    scale: Array32  # (6,) black; factors of luma, red by V, green by U and by V, blue by U
    siting_x: tuple[int, int]  # of _SITINGS
    siting_y: tuple[int, int]
    rows_per_chroma: int  # rows of luma per row of chroma


def conversion_of(frame: av.VideoFrame, *, short_side: int) -> ColourConversion | None:
    """Find how crops of frames of this format convert to sRGB; None where only a whole frame can be converted.

    A frame does not state its chroma siting, so each siting is tried on a small frame of the same format and compared
    with `rgb_from_frame`; crops come out equal within one grey level. short_side [px]: that of the recording.
    """
    rows_per_chroma = _ROWS_PER_CHROMA.get(frame.format.name)
    matrix = matrix_for(short_side) if frame.colorspace == UNSPECIFIED_MATRIX else frame.colorspace
    if rows_per_chroma is None or matrix not in _LUMA_WEIGHTS:
        return None
    is_full = frame.color_range == ColorRange.JPEG or frame.format.name.startswith("yuvj")
    scale = _scale(*_LUMA_WEIGHTS[matrix], is_full=is_full)
    probe = frame.reformat(width=_PROBE_PX, height=_PROBE_PX, threads=1)  # keeps the frame's own tags
    rng = np.random.default_rng(0)
    for plane in probe.planes:
        rows = plane_rows(plane)
        rows[:] = rng.integers(64, 192, rows.shape)
    expected = rgb_from_frame(probe, short_side=short_side).astype(int)
    for siting_x, siting_y in product(_SITINGS, _SITINGS):
        conversion = ColourConversion(scale, siting_x, siting_y, rows_per_chroma)
        converted = rgb_from_part(probe, conversion, (0, 0, _PROBE_PX, _PROBE_PX))
        if np.abs(converted - expected).max() <= 1:
            return conversion
    return None


def rgb_from_part(frame: av.VideoFrame, conversion: ColourConversion, box: PixelBox) -> Image:
    """Convert the part of a frame inside a box to sRGB: (y1 - y0, x1 - x0, 3); the box lies within the frame."""
    x0, y0, x1, y1 = box
    rgb = np.empty((y1 - y0, x1 - x0, 3), np.uint8)
    y, u, v = (np.ascontiguousarray(plane_rows(plane)) for plane in frame.planes)
    sitings = (conversion.siting_x, conversion.siting_y)
    _convert(y, u, v, frame.planes[1].width, conversion.scale, sitings, conversion.rows_per_chroma, x0, y0, rgb)
    return rgb


def _scale(red: float, blue: float, *, is_full: bool) -> Array32:
    black, luma, chroma = (0, 1.0, 1.0) if is_full else (16, 255 / 219, 255 / 224)
    green = 1 - red - blue
    of_v, of_u = 2 * (1 - red) * chroma, 2 * (1 - blue) * chroma
    return np.array([black, luma, of_v, of_u * blue / green, of_v * red / green, of_u], np.float32)


@kernel
def _convert(
    y: NDArray[np.uint8],
    u: NDArray[np.uint8],
    v: NDArray[np.uint8],
    chroma_width: int,
    scale: Array32,
    sitings: tuple[tuple[int, int], tuple[int, int]],
    rows_per_chroma: int,
    x0: int,
    y0: int,
    rgb: NDArray[np.uint8],
) -> None:
    """Fill rgb (h, w, 3) with the part from x0, y0 of planes whose rows may be padded."""
    black, k_y, k_rv, k_gu, k_gv, k_bu = scale
    height, width = rgb.shape[:2]
    half, low, high = np.float32(0.5), np.float32(0), np.float32(255)
    first = x0 // 2
    n = (x0 + width - 1) // 2 - first + 1
    mixed = np.empty(n + 2, np.float32)
    chroma_u, chroma_v = np.empty(2 * n, np.float32), np.empty(2 * n, np.float32)
    red, green, blue = np.empty(width, np.uint8), np.empty(width, np.uint8), np.empty(width, np.uint8)
    for row in range(height):
        a, b, share = _chroma_rows(y0 + row, u.shape[0], sitings[1], rows_per_chroma)
        _interpolate_chroma(u[a], u[b], share, sitings[0], first, chroma_width, mixed, chroma_u)
        _interpolate_chroma(v[a], v[b], share, sitings[0], first, chroma_width, mixed, chroma_v)
        of_u, of_v = chroma_u[x0 % 2 : x0 % 2 + width], chroma_v[x0 % 2 : x0 % 2 + width]
        luma = y[y0 + row, x0 : x0 + width]
        for i in range(width):
            light = k_y * (np.float32(luma[i]) - black) + half
            red[i] = np.uint8(min(max(light + k_rv * of_v[i], low), high))
            green[i] = np.uint8(min(max(light - k_gu * of_u[i] - k_gv * of_v[i], low), high))
            blue[i] = np.uint8(min(max(light + k_bu * of_u[i], low), high))
        for i in range(width):
            rgb[row, i, 0], rgb[row, i, 1], rgb[row, i, 2] = red[i], green[i], blue[i]


@kernel(is_inner=True)
def _chroma_rows(row: int, n: int, siting: tuple[int, int], rows_per_chroma: int) -> tuple[int, int, np.float32]:
    """Return the two rows of chroma around a row of luma, and the second one's share."""
    if rows_per_chroma == 1:
        return row, row, np.float32(0)
    j, is_odd = row // 2, row % 2
    return j, min(max(j + 2 * is_odd - 1, 0), n - 1), np.float32(siting[is_odd] / 4)


@kernel(is_inner=True)
def _interpolate_chroma(
    near: NDArray[np.uint8],
    far: NDArray[np.uint8],
    share: np.float32,
    siting: tuple[int, int],
    first: int,
    width: int,
    mixed: Array32,
    chroma: Array32,
) -> None:
    """Interpolate the chroma of two rows, zero for grey, to every pixel from column 2 first on: chroma (2 n,).

    mixed (n + 2,) is a work buffer.
    """
    rest, grey = np.float32(1) - share, np.float32(128)
    n = len(mixed) - 2
    a, b, middle = near[first : first + n], far[first : first + n], mixed[1 : n + 1]
    for j in range(n):
        middle[j] = rest * np.float32(a[j]) + share * np.float32(b[j]) - grey
    before, after = max(first - 1, 0), min(first + n, width - 1)
    mixed[0] = rest * np.float32(near[before]) + share * np.float32(far[before]) - grey
    mixed[n + 1] = rest * np.float32(near[after]) + share * np.float32(far[after]) - grey
    left, right = mixed[:n], mixed[2 : n + 2]
    even, odd = np.float32(siting[0] / 4), np.float32(siting[1] / 4)
    for j in range(n):
        chroma[2 * j] = middle[j] + even * (left[j] - middle[j])
        chroma[2 * j + 1] = middle[j] + odd * (right[j] - middle[j])
