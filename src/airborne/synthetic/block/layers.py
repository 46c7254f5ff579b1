"""Kernels that compose a frame: shadows on the floor, bodies and the net over the background, the noise."""

from __future__ import annotations

import numpy as np

from airborne.kernels import kernel


@kernel(fastmath=True)
def cast_shadows(patch, x0, y0, floor_from_px, shadows, boxes, tint):
    """Darken the floor in a patch (h, w, 3), whose top left is the pixel x0, y0, under shadows (k, 4).

    A shadow is x, y, radius [m] and depth: it takes `depth` times `tint` (3,) of the light away at its middle,
    and nothing at its radius. `boxes` (k, 4) bound each in the image: x0, y0, x1, y1 [px].
    `floor_from_px` (3, 3) is the homography to the floor.
    """
    height, width, _ = patch.shape
    f = floor_from_px
    for k in range(len(shadows)):
        for v in range(max(boxes[k, 1] - y0, 0), min(boxes[k, 3] - y0, height)):
            for u in range(max(boxes[k, 0] - x0, 0), min(boxes[k, 2] - x0, width)):
                px, py = u + x0, v + y0
                w = 1 / (f[2, 0] * px + f[2, 1] * py + f[2, 2])
                dx = ((f[0, 0] * px + f[0, 1] * py + f[0, 2]) * w - shadows[k, 0]) / shadows[k, 2]
                dy = ((f[1, 0] * px + f[1, 1] * py + f[1, 2]) * w - shadows[k, 1]) / shadows[k, 2]
                d = 1 - dx * dx - dy * dy
                if d > 0:
                    for c in range(3):
                        patch[v, u, c] *= 1 - tint[c] * shadows[k, 3] * d * d


@kernel(fastmath=True)
def composite(patch, x0, y0, colour, part):
    """Composite a body over a patch at its pixel x0, y0: colour (h, 2 w, 3) and part (h, 2 w) hold two samples a pixel.

    `part` is negative where there is no body.
    """
    half = np.float32(0.5)
    for v in range(part.shape[0]):
        for u in range(part.shape[1] // 2):
            n = np.float32(part[v, 2 * u] >= 0) + np.float32(part[v, 2 * u + 1] >= 0)
            if n > 0:
                bare = 1 - half * n
                for c in range(3):
                    body = colour[v, 2 * u, c] + colour[v, 2 * u + 1, c]
                    patch[y0 + v, x0 + u, c] = bare * patch[y0 + v, x0 + u, c] + half * body


@kernel(fastmath=True)
def blend_layer(patch, colour, alpha):
    """Blend a layer (h, w, 3) of opacity `alpha` (h, w), 0 to 255, over a patch."""
    height, width, _ = patch.shape
    for v in range(height):
        for u in range(width):
            if alpha[v, u]:
                share = np.float32(alpha[v, u]) / np.float32(255)
                for c in range(3):
                    patch[v, u, c] += share * (colour[v, u, c] - patch[v, u, c])


@kernel(fastmath=True)
def expose(patch, gain, noise, out):
    """Write a patch (h, w, 3) as recorded: times `gain` (3,), plus noise (h, w, 3), to whole grey levels."""
    height, width, _ = patch.shape
    red, green, blue = np.float32(gain[0]), np.float32(gain[1]), np.float32(gain[2])
    half, white, black = np.float32(0.5), np.float32(255), np.float32(0)
    for v in range(height):
        for u in range(width):
            r, g, b = patch[v, u, 0] * red, patch[v, u, 1] * green, patch[v, u, 2] * blue
            out[v, u, 0] = np.uint8(min(max(r + np.float32(noise[v, u, 0]) + half, black), white))
            out[v, u, 1] = np.uint8(min(max(g + np.float32(noise[v, u, 1]) + half, black), white))
            out[v, u, 2] = np.uint8(min(max(b + np.float32(noise[v, u, 2]) + half, black), white))
