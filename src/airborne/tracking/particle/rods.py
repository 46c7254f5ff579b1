"""Rods seen in a picture: each covers a rectangle along its projection, which is read on a grid of 15 by 7 points.

A rod is a pair of points in the world with a width [m]. Its rectangle runs from one projected end to the other; across,
it is as wide as the width at the depth of the rod's middle. The cost does not depend on how large the rod looks.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from airborne.appearance.hue_saturation import BINS, OUTSIDE
from airborne.kernels import kernel

ALONG, ACROSS = 15, 7
SAMPLES = ALONG * ACROSS
CLASS_SHIFT = 8  # a code holds the bin in its low byte and one bit for each class above
_FAR_PX = 1e6  # no picture is this large
_FIXED_BITS = 16
_FIXED = float(1 << _FIXED_BITS)  # pixels are stepped through in whole numbers: a third faster
_ROOT_STEPS = np.diff(np.sqrt(np.arange(SAMPLES + 1) / SAMPLES)).astype(np.float32)


@kernel
def _frame_of(ends, projection, focal_px, width_m, frame):
    """Fill frame (6,): the pixel of one corner's cell, the step along, the step across. False behind the camera."""
    ua, va, wa = 0.0, 0.0, 0.0
    ub, vb, wb = 0.0, 0.0, 0.0
    for k in range(3):
        ua += projection[0, k] * ends[0, k]
        va += projection[1, k] * ends[0, k]
        wa += projection[2, k] * ends[0, k]
        ub += projection[0, k] * ends[1, k]
        vb += projection[1, k] * ends[1, k]
        wb += projection[2, k] * ends[1, k]
    ua, va, wa = ua + projection[0, 3], va + projection[1, 3], wa + projection[2, 3]
    ub, vb, wb = ub + projection[0, 3], vb + projection[1, 3], wb + projection[2, 3]
    if not (wa > 1e-6 and wb > 1e-6):
        return False
    ua, va, ub, vb = ua / wa, va / wa, ub / wb, vb / wb
    du, dv = ub - ua, vb - va
    length = math.sqrt(du * du + dv * dv)
    width = focal_px * width_m / (0.5 * (wa + wb))
    if length > 1e-9:
        cu, cv = -dv / length * width / ACROSS, du / length * width / ACROSS
    else:
        cu, cv = width / ACROSS, 0.0
    frame[2], frame[3], frame[4], frame[5] = du / ALONG, dv / ALONG, cu, cv
    frame[0] = ua + 0.5 * frame[2] - 0.5 * (ACROSS - 1) * cu
    frame[1] = va + 0.5 * frame[3] - 0.5 * (ACROSS - 1) * cv
    return abs(frame[0]) < _FAR_PX and abs(frame[1]) < _FAR_PX and length + width < _FAR_PX


@kernel
def read_rods(codes, corner, projection, focal_px, ends, widths_m, roots, classes, overlap, share):
    """Compare many rods with their references in one picture.

    codes (h, w) uint16: each pixel's bin, and above it one bit for each class; corner (2,): the pixel (x, y) of codes'
    first; projection (3, 4) px from world; ends (n, rods, 2, 3) [m]; widths_m (rods,); roots (rods, 111): roots of the
    references' shares; classes (rods,) the classes that a rod may show, as bits. Fills overlap (n, rods) with the
    Bhattacharyya coefficient, and share (n, rods) with the part of the samples that belong to the rod's classes.
    Samples outside are background: a bin of their own and no class. Rods behind the camera get zeros.
    """
    h, w = codes.shape
    counts = np.zeros(BINS + 1, np.int64)
    frame = np.zeros(6)
    for i in range(ends.shape[0]):
        for r in range(ends.shape[1]):
            overlap[i, r], share[i, r] = 0.0, 0.0
            if not _frame_of(ends[i, r], projection, focal_px, widths_m[r], frame):
                continue
            counts[:] = 0
            total, hits, wanted = np.float32(0.0), 0, classes[r] << CLASS_SHIFT
            u0, v0 = np.int64((frame[0] - corner[0] + 0.5) * _FIXED), np.int64((frame[1] - corner[1] + 0.5) * _FIXED)
            along_u, along_v = np.int64(frame[2] * _FIXED), np.int64(frame[3] * _FIXED)
            across_u, across_v = np.int64(frame[4] * _FIXED), np.int64(frame[5] * _FIXED)
            for a in range(ALONG):
                u, v = u0 + a * along_u, v0 + a * along_v
                for _ in range(ACROSS):
                    x, y = u >> _FIXED_BITS, v >> _FIXED_BITS
                    code = np.int64(codes[y, x]) if x >= 0 and y >= 0 and x < w and y < h else OUTSIDE
                    bin_ = code & 255
                    hits += (code & wanted) != 0
                    seen = counts[bin_]
                    total += _ROOT_STEPS[seen] * roots[r, bin_]
                    counts[bin_] = seen + 1
                    u += across_u
                    v += across_v
            overlap[i, r], share[i, r] = total, hits / SAMPLES


@kernel
def count_rods(codes, corner, projection, focal_px, ends, widths_m, counts):
    """Add to counts (rods, 111) the bins of the rods' samples: ends (rods, 2, 3) [m], the rest as in `read_rods`."""
    h, w = codes.shape
    frame = np.zeros(6)
    for r in range(ends.shape[0]):
        if not _frame_of(ends[r], projection, focal_px, widths_m[r], frame):
            continue
        for a in range(ALONG):
            for c in range(ACROSS):
                u = frame[0] + a * frame[2] + c * frame[4] - corner[0] + 0.5
                v = frame[1] + a * frame[3] + c * frame[5] - corner[1] + 0.5
                inside = u >= 0.0 and v >= 0.0 and u < w and v < h
                counts[r, (np.int64(codes[int(v), int(u)]) & 255) if inside else OUTSIDE] += 1


def rod_corners(ends: NDArray, projection: NDArray, focal_px: float, widths_m: NDArray) -> NDArray[np.floating]:
    """Return the corners of the rods' rectangles in the picture, in order round each: (rods, 4, 2) [px].

    ends (rods, 2, 3) [m], widths_m (rods,); NaN for a rod behind the camera.
    """
    corners, frame = np.full((len(ends), 4, 2), np.nan), np.zeros(6)
    for r, (pair, width_m) in enumerate(zip(np.asarray(ends, float), widths_m, strict=True)):
        if _frame_of(pair, projection, focal_px, float(width_m), frame):
            first, along, across = frame[0:2], frame[2:4], frame[4:6]
            first = first - along / 2 - across / 2
            sides = ALONG * along, ACROSS * across
            corners[r] = first, first + sides[0], first + sides[0] + sides[1], first + sides[1]
    return corners
