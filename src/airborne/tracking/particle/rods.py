"""Rods in an image: each covers a rectangle along its projection, sampled on a grid of 15 by 7 points.

A rod is a pair of points in the world with a width [m]. Its rectangle runs from one projected end to the other; across,
it is as wide as the width at the depth of the rod's middle. The cost does not depend on the rod's size in the image.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from airborne.appearance.hue_saturation import HSV_BINS, OUTSIDE
from airborne.kernels import kernel

N_ALONG, N_ACROSS = 15, 7  # samples of a rod's rectangle
N_SAMPLES = N_ALONG * N_ACROSS
CLASS_SHIFT = 8  # a code holds the bin in its low byte and one bit for each class above
_FAR_PX = 1e6  # no image is this large
_FIXED_BITS = 16  # of a pixel, after the binary point
_FIXED = float(1 << _FIXED_BITS)  # pixels are stepped through in whole numbers: a third faster
_ROOT_STEPS = np.diff(np.sqrt(np.arange(N_SAMPLES + 1) / N_SAMPLES)).astype(np.float32)


@kernel
def _sampling_grid(ends, projection, focal_px, width_m, grid):
    """Fill grid (6,): the pixel of one corner's cell, the step along, the step across; False behind the camera."""
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
        cu, cv = -dv / length * width / N_ACROSS, du / length * width / N_ACROSS
    else:
        cu, cv = width / N_ACROSS, 0.0
    grid[2], grid[3], grid[4], grid[5] = du / N_ALONG, dv / N_ALONG, cu, cv
    grid[0] = ua + 0.5 * grid[2] - 0.5 * (N_ACROSS - 1) * cu
    grid[1] = va + 0.5 * grid[3] - 0.5 * (N_ACROSS - 1) * cv
    return abs(grid[0]) < _FAR_PX and abs(grid[1]) < _FAR_PX and length + width < _FAR_PX


@kernel
def compare_rods(codes, corner, projection, focal_px, ends, widths_m, roots, classes, overlap, share):
    """Compare many rods with their references in one image.

    codes (h, w) uint16: each pixel's bin, and above it one bit for each class; corner (2,): the pixel (x, y) of codes'
    first; projection (3, 4) px from world; ends (n, rods, 2, 3) [m]; widths_m (rods,); roots (rods, 111): square roots
    of the normalised reference histograms; classes (rods,): those that a rod may show, as bits. Fills overlap (n, rods)
    with the Bhattacharyya coefficient, and share (n, rods) with the share of samples in the rod's classes. Samples
    outside are background: a bin of their own and no class. Rods behind the camera get zeros.
    """
    h, w = codes.shape
    counts = np.zeros(HSV_BINS + 1, np.int64)
    grid = np.zeros(6)
    for i in range(ends.shape[0]):
        for r in range(ends.shape[1]):
            overlap[i, r], share[i, r] = 0.0, 0.0
            if not _sampling_grid(ends[i, r], projection, focal_px, widths_m[r], grid):
                continue
            counts[:] = 0
            total, hits, wanted = np.float32(0.0), 0, classes[r] << CLASS_SHIFT
            u0, v0 = np.int64((grid[0] - corner[0] + 0.5) * _FIXED), np.int64((grid[1] - corner[1] + 0.5) * _FIXED)
            along_u, along_v = np.int64(grid[2] * _FIXED), np.int64(grid[3] * _FIXED)
            across_u, across_v = np.int64(grid[4] * _FIXED), np.int64(grid[5] * _FIXED)
            for a in range(N_ALONG):
                u, v = u0 + a * along_u, v0 + a * along_v
                for _ in range(N_ACROSS):
                    x, y = u >> _FIXED_BITS, v >> _FIXED_BITS
                    code = np.int64(codes[y, x]) if x >= 0 and y >= 0 and x < w and y < h else OUTSIDE
                    bin_ = code & 255
                    hits += (code & wanted) != 0
                    count = counts[bin_]
                    total += _ROOT_STEPS[count] * roots[r, bin_]
                    counts[bin_] = count + 1
                    u += across_u
                    v += across_v
            overlap[i, r], share[i, r] = total, hits / N_SAMPLES


@kernel
def count_rods(codes, corner, projection, focal_px, ends, widths_m, counts):
    """Add to counts (rods, 111) the bins of the rods' samples: ends (rods, 2, 3) [m], the rest as in `read_rods`."""
    h, w = codes.shape
    grid = np.zeros(6)
    for r in range(ends.shape[0]):
        if not _sampling_grid(ends[r], projection, focal_px, widths_m[r], grid):
            continue
        for a in range(N_ALONG):
            for c in range(N_ACROSS):
                u = grid[0] + a * grid[2] + c * grid[4] - corner[0] + 0.5
                v = grid[1] + a * grid[3] + c * grid[5] - corner[1] + 0.5
                inside = u >= 0.0 and v >= 0.0 and u < w and v < h
                counts[r, (np.int64(codes[int(v), int(u)]) & 255) if inside else OUTSIDE] += 1


def rod_corners(ends: NDArray, projection: NDArray, focal_px: float, widths_m: NDArray) -> NDArray[np.floating]:
    """Return the corners of the rods' rectangles in the image, in order around each: (rods, 4, 2) [px].

    ends (rods, 2, 3) [m], widths_m (rods,); NaN for a rod behind the camera.
    """
    corners, grid = np.full((len(ends), 4, 2), np.nan), np.zeros(6)
    for r, (pair, width_m) in enumerate(zip(np.asarray(ends, float), widths_m, strict=True)):
        if _sampling_grid(pair, projection, focal_px, float(width_m), grid):
            first, along, across = grid[0:2], grid[2:4], grid[4:6]
            first = first - along / 2 - across / 2
            sides = N_ALONG * along, N_ACROSS * across
            corners[r] = first, first + sides[0], first + sides[0] + sides[1], first + sides[1]
    return corners
