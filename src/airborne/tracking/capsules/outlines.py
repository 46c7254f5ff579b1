"""Tapered capsules in an image: the hull of two spheres projects to the hull of two discs, a span in each row.

Along its axis a capsule may change from one surface class to another (shorts to skin), at a share of the axis.
"""

from __future__ import annotations

import numpy as np

from airborne.kernels import kernel

BEHIND_M = 1e9  # depth of what is not in front of the camera [m]


@kernel
def project_capsules(ends, radii, camera, discs, depth):
    """Project capsules: ends (n, 2, 3) world [m], radii (n, 2) [m], camera (4, 4): K [R t], then the focal length [px].

    Fills discs (n, 2, 3), the centre (x, y) and the radius of each end's disc [px], and depth (n,) [m], BEHIND for a
    capsule that is not in front of the camera.
    """
    f = camera[3, 0]
    for i in range(len(ends)):
        nearest, mean = BEHIND_M, 0.0
        for e in range(2):
            x, y, z = ends[i, e, 0], ends[i, e, 1], ends[i, e, 2]
            w = camera[2, 0] * x + camera[2, 1] * y + camera[2, 2] * z + camera[2, 3]
            nearest = min(nearest, w)
            mean += 0.5 * w
            w = max(w, 1e-3)
            discs[i, e, 0] = (camera[0, 0] * x + camera[0, 1] * y + camera[0, 2] * z + camera[0, 3]) / w
            discs[i, e, 1] = (camera[1, 0] * x + camera[1, 1] * y + camera[1, 2] * z + camera[1, 3]) / w
            discs[i, e, 2] = f * radii[i, e] / w
        depth[i] = mean if nearest > 0.1 else BEHIND_M


@kernel
def outline(disc_a, disc_b, y_first, x, pieces, tangents):
    """Outline the hull of two discs (x, y, radius) [px] in rows at y_first, y_first + 1, ...

    Fills x (2, rows), where it begins and ends in each row; pieces (2, rows), what that end lies on: disc a (0), disc b
    (1), or one of the common tangents (2, 3); and tangents (2, 7), NaN where there are none: where each touches disc a
    (x, y), y of disc b, its slope, its normal (x, y), x of disc b. Returns the first and one past the last row met.
    """
    n = x.shape[1]
    tangents[:] = np.nan
    top = min(disc_a[1] - disc_a[2], disc_b[1] - disc_b[2])
    bottom = max(disc_a[1] + disc_a[2], disc_b[1] + disc_b[2])
    first = int(min(max(np.ceil(top - y_first), 0.0), n))
    last = int(min(max(np.floor(bottom - y_first) + 1, first), n))
    x[0, first:last], x[1, first:last] = BEHIND_M, -BEHIND_M
    for k in range(2):
        disc = disc_a if k == 0 else disc_b
        start = int(min(max(np.ceil(disc[1] - disc[2] - y_first), first), last))
        stop = int(min(max(np.floor(disc[1] + disc[2] - y_first) + 1, start), last))
        for i in range(start, stop):
            dy = y_first + i - disc[1]
            h = np.sqrt(max(disc[2] * disc[2] - dy * dy, 0.0))
            if disc[0] - h < x[0, i]:
                x[0, i], pieces[0, i] = disc[0] - h, k
            if disc[0] + h > x[1, i]:
                x[1, i], pieces[1, i] = disc[0] + h, k
    ux, uy, dr = disc_b[0] - disc_a[0], disc_b[1] - disc_a[1], disc_a[2] - disc_b[2]
    d2 = ux * ux + uy * uy
    if d2 <= dr * dr * 1.0001:  # one disc lies in the other
        return first, last
    cosine, sine = dr / d2, np.sqrt(d2 - dr * dr) / d2
    for k in range(2):
        sign = 1.0 - 2.0 * k
        nx, ny = ux * cosine - sign * uy * sine, uy * cosine + sign * ux * sine
        ax, ay = disc_a[0] + disc_a[2] * nx, disc_a[1] + disc_a[2] * ny
        bx, by = disc_b[0] + disc_b[2] * nx, disc_b[1] + disc_b[2] * ny
        slope = (bx - ax) / (by - ay) if abs(by - ay) > 1e-9 else 0.0
        for p, value in enumerate((ax, ay, by, slope, nx, ny, bx)):
            tangents[k, p] = value
        start = int(min(max(np.ceil(min(ay, by) - y_first), first), last))
        stop = int(min(max(np.floor(max(ay, by) - y_first) + 1, start), last))
        for i in range(start, stop):
            edge = ax + slope * (y_first + i - ay)
            if edge < x[0, i]:
                x[0, i], pieces[0, i] = edge, 2 + k
            if edge > x[1, i]:
                x[1, i], pieces[1, i] = edge, 2 + k
    return first, last


@kernel(inline="always")
def border_in_row(disc, share, y, x_middle):
    """Return where a row meets the border across a capsule, at a share of its axis: (x, weight, split).

    split is 0 where the border lies along the row: then `weight` of the row belongs to the first map; else 1 where the
    first map lies left of x, -1 where it lies right.
    """
    ux, uy = disc[1, 0] - disc[0, 0], disc[1, 1] - disc[0, 1]
    cx, cy = disc[0, 0] + share * ux, disc[0, 1] + share * uy
    if abs(ux) > 0.3 * abs(uy):
        return cx - (y - cy) * uy / ux, 1.0, 1 if ux > 0 else -1
    if uy == 0:
        return cx, 1.0, 0
    y_border = cy - (x_middle - cx) * ux / uy
    beyond = (y - y_border) * (1.0 if uy > 0 else -1.0)
    return cx, min(max(0.5 - beyond, 0.0), 1.0), 0


@kernel(inline="always")
def part_at(disc, share, u, y):
    """Return which of a capsule's two classes lies at a point."""
    ux, uy = disc[1, 0] - disc[0, 0], disc[1, 1] - disc[0, 1]
    cx, cy = disc[0, 0] + share * ux, disc[0, 1] + share * uy
    return 0 if share >= 1 or (u - cx) * ux + (y - cy) * uy < 0 else 1


@kernel
def draw_labels(discs, depth, classes, share, out):
    """Fill out (h, w) with the class of the nearest capsule at each pixel, -1 where none; see `capsule_evidence`."""
    h, w = out.shape
    out[:] = -1
    x, pieces, tangents = np.empty((2, h)), np.empty((2, h), np.int64), np.empty((2, 7))
    order = np.argsort(-depth)
    for i in order:
        if depth[i] >= BEHIND_M:
            continue
        first, last = outline(discs[i, 0], discs[i, 1], 0.0, x, pieces, tangents)
        for y in range(first, last):
            for u in range(max(int(np.ceil(x[0, y])), 0), min(int(np.floor(x[1, y])), w - 1) + 1):
                out[y, u] = classes[i, part_at(discs[i], share[i], u, y)]
