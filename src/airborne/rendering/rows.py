"""Kernels that turn spans into pixels: one row at a time, 16 pixels at a time, float32.

A row's pixels live in blocks of 16: each block holds nine planes of 16 numbers side by side, so that every distance in
memory is a constant and LLVM can put a whole plane into one register. Inverse depth is the z-buffer: larger is nearer.
A lane loop that is too small gets unrolled instead of vectorised, and then costs ten times as much; so does one that
adds to memory under a condition (add a selected value instead). Measure with `benchmarks/speed/yardstick.py` after any
change.
"""

from __future__ import annotations

import numpy as np

from airborne.kernels import kernel
from airborne.rendering.shapes import ALPHA, B_1, B_U, B_V, COLOUR, ID, N_STEP, NORMAL, W_STEP, G

LANES = 16  # pixels computed together: a vector register of 512 bits holds as many floats
# planes of a block, as offsets: inverse depth, normal (3), colour (3), shape, light
W, NX, NY, NZ, RED, GREEN, BLUE, SHAPE, SHADE, BLOCK = 0, 16, 32, 48, 64, 80, 96, 112, 128, 144
f4 = np.float32


@kernel(fastmath=True, is_inner=True)
def new_row(width):
    """Allocate the blocks of one row, all empty."""
    row = np.empty((width // LANES + 2) * BLOCK, np.float32)
    for i in range(len(row)):
        row[i] = 0
    return row


@kernel(fastmath=True, is_inner=True)
def block_range(ends, start, stop):
    """Return the first block that the spans `start` to `stop - 1` touch, and the last."""
    first, last = ends[start, 0], ends[start, 1]
    for i in range(start + 1, stop):
        first, last = min(first, ends[i, 0]), max(last, ends[i, 1])
    return first // LANES, last // LANES


@kernel(fastmath=True, is_inner=True)
def draw_row(row, outlines, surfaces, ends, curves, start, stop, v, first_block, lights=True):
    """Draw the spans `start` to `stop - 1` of row v into the blocks of `row`, the nearest surface on top.

    Where `lights` is None no normals are drawn, in half the time.
    """
    for i in range(start, stop):
        u0, u1, s = ends[i, 0], ends[i, 1], ends[i, 2]
        outline, surface = outlines[s], surfaces[s]
        alpha, w_step, half_squared = surface[ALPHA], surface[W_STEP], f4(curves[i, 1])
        s0, s1, s2 = surface[N_STEP], surface[N_STEP + 1], surface[N_STEP + 2]
        g0, g1, g2 = surface[G], surface[G + 1], surface[G + 2]
        red, green, blue, shape = surface[COLOUR], surface[COLOUR + 1], surface[COLOUR + 2], surface[ID]
        w_row = outline[B_V] * v + outline[B_1]
        n0_row = outline[NORMAL + 1] * v + outline[NORMAL + 2]
        n1_row = outline[NORMAL + 4] * v + outline[NORMAL + 5]
        n2_row = outline[NORMAL + 7] * v + outline[NORMAL + 8]
        for b in range(u0 // LANES, u1 // LANES + 1):
            u = b * LANES
            block = row[(b - first_block) * BLOCK : (b - first_block) * BLOCK + BLOCK]
            first, last, x = f4(u0 - u), f4(u1 - u), f4(u - curves[i, 0])
            w_0 = f4(outline[B_U] * u + w_row)
            if lights is None:
                for j in range(LANES):
                    f = f4(j)
                    dx = x + f
                    w = w_0 + w_step * f + np.sqrt(alpha * max(half_squared - dx * dx, f4(0)))
                    is_nearest = (f >= first) & (f <= last) & (w > block[W + j])
                    block[W + j] = w if is_nearest else block[W + j]
                    block[RED + j] = red if is_nearest else block[RED + j]
                    block[GREEN + j] = green if is_nearest else block[GREEN + j]
                    block[BLUE + j] = blue if is_nearest else block[BLUE + j]
                    block[SHAPE + j] = shape if is_nearest else block[SHAPE + j]
                continue
            n0_0 = f4(outline[NORMAL] * u + n0_row)
            n1_0 = f4(outline[NORMAL + 3] * u + n1_row)
            n2_0 = f4(outline[NORMAL + 6] * u + n2_row)
            for j in range(LANES):
                f = f4(j)
                dx = x + f
                w = w_0 + w_step * f + np.sqrt(alpha * max(half_squared - dx * dx, f4(0)))
                is_nearest = (f >= first) & (f <= last) & (w > block[W + j])
                block[W + j] = w if is_nearest else block[W + j]
                block[NX + j] = n0_0 + s0 * f - w * g0 if is_nearest else block[NX + j]
                block[NY + j] = n1_0 + s1 * f - w * g1 if is_nearest else block[NY + j]
                block[NZ + j] = n2_0 + s2 * f - w * g2 if is_nearest else block[NZ + j]
                block[RED + j] = red if is_nearest else block[RED + j]
                block[GREEN + j] = green if is_nearest else block[GREEN + j]
                block[BLUE + j] = blue if is_nearest else block[BLUE + j]
                block[SHAPE + j] = shape if is_nearest else block[SHAPE + j]


@kernel(fastmath=True, is_inner=True)
def light_block(block, lights, x, x_step, y, y_step):
    """Add to the block's light what each lamp gives: intensity times the cosine to the normal, inside its cone.

    `lights` (l, 8): position in camera axes, intensity, axis of the cone, cosine of its half angle (-2: no cone). The
    ray of lane j is (x + j x_step, y + j y_step, 1). With w times the vector to the lamp, depth is never divided by.
    """
    for i in range(len(lights)):
        p0, p1, p2, intensity = lights[i, 0], lights[i, 1], lights[i, 2], lights[i, 3]
        d0, d1, d2, cone = lights[i, 4], lights[i, 5], lights[i, 6], lights[i, 7]
        for j in range(LANES):
            w, n0, n1, n2 = block[W + j], block[NX + j], block[NY + j], block[NZ + j]
            a0, a1, a2 = w * p0 - (x + x_step * f4(j)), w * p1 - (y + y_step * f4(j)), w * p2 - f4(1)
            near = f4(1) / np.sqrt(a0 * a0 + a1 * a1 + a2 * a2)
            facing = max(n0 * a0 + n1 * a1 + n2 * a2, f4(0)) * near * (f4(1) / np.sqrt(n0 * n0 + n1 * n1 + n2 * n2))
            is_lit = -(a0 * d0 + a1 * d1 + a2 * d2) * near >= cone
            block[SHADE + j] += intensity * facing if is_lit else f4(0)
