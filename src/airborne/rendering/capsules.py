"""Evidence under the outline of tapered capsules: one pose of a person in one picture, without visiting its pixels.

A capsule is the hull of two balls; in the picture, of two discs. Its outline in a row is a span; the sum of a map over
a span is the difference of two running sums along that row. Where capsules overlap, the nearer one owns the pixels.
Along its axis a capsule may change from one map to another (shorts to skin). How the sum changes as the discs move is
read off at the ends of the spans: only there, and at the border between its two maps, pixels change hands.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

# no fast maths: sums keep their order, so that a run is the same to the last bit however the code was compiled
EXACT: dict[str, Any] = {"nogil": True, "error_model": "numpy", "cache": True}
INLINE: dict[str, Any] = {**EXACT, "inline": "always"}  # what is called for every span: handing arrays over costs more

MOST_SPANS = 64  # capsules in one row
BEHIND = 1e9  # depth of what is not in front of the camera [m]
_BORDER_SAMPLES = 5
_LEVEL = 2.0  # tangents that run this much further across than down are gone along column by column, not row by row


@njit(**EXACT)
def running_sums(maps, out):
    """Fill out (k, h, w + 1) with the sums of maps (k, h, w) over all pixels to the left of each pixel's left side."""
    k, h, w = maps.shape
    for c in range(k):
        for y in range(h):
            total = np.float32(0)
            out[c, y, 0] = 0
            for x in range(w):
                total += maps[c, y, x]
                out[c, y, x + 1] = total


@njit(**EXACT)
def project(ends, radii, camera, discs, depth):
    """Project capsules: ends (n, 2, 3) world [m], radii (n, 2) [m], camera (4, 4): K [R t], then the focal length [px].

    Fills discs (n, 2, 3), the centre (x, y) and the radius of each end's disc [px], and depth (n,) [m], BEHIND for a
    capsule that is not in front of the camera.
    """
    f = camera[3, 0]
    for i in range(len(ends)):
        nearest, mean = BEHIND, 0.0
        for e in range(2):
            x, y, z = ends[i, e, 0], ends[i, e, 1], ends[i, e, 2]
            w = camera[2, 0] * x + camera[2, 1] * y + camera[2, 2] * z + camera[2, 3]
            nearest = min(nearest, w)
            mean += 0.5 * w
            w = max(w, 1e-3)
            discs[i, e, 0] = (camera[0, 0] * x + camera[0, 1] * y + camera[0, 2] * z + camera[0, 3]) / w
            discs[i, e, 1] = (camera[1, 0] * x + camera[1, 1] * y + camera[1, 2] * z + camera[1, 3]) / w
            discs[i, e, 2] = f * radii[i, e] / w
        depth[i] = mean if nearest > 0.1 else BEHIND


@njit(**EXACT)
def outline(disc_a, disc_b, y_first, x, pieces, tangents):
    """Outline the hull of two discs (x, y, radius) [px] in rows at y_first, y_first + 1, ...

    Fills x (2, rows), where it begins and ends in each row; pieces (2, rows), of what that end is: disc a (0), disc b
    (1), or one of the common tangents (2, 3); and tangents (2, 7), NaN where there are none: where each touches disc a
    (x, y), y of disc b, its slope, its normal (x, y), x of disc b. Returns the first and one past the last row met.
    """
    n = x.shape[1]
    tangents[:] = np.nan
    top = min(disc_a[1] - disc_a[2], disc_b[1] - disc_b[2])
    bottom = max(disc_a[1] + disc_a[2], disc_b[1] + disc_b[2])
    first = int(min(max(np.ceil(top - y_first), 0.0), n))
    last = int(min(max(np.floor(bottom - y_first) + 1, first), n))
    x[0, first:last], x[1, first:last] = BEHIND, -BEHIND
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


@njit(**INLINE)
def _stretch(top, bottom, y):
    """Return what of a stretch of heights counts for the row at y: half way to its neighbours, or to the end."""
    return top if y - 1 < top else y - 0.5, bottom if y + 1 > bottom else y + 0.5


@njit(**INLINE)
def _motion(discs, tangents, who, piece, y, outward):
    """Say how an end of a span of capsule `who` moves: (x0, x1, t, by_y, by_r).

    It moves along with x of the discs, by_y times y and by_r times their radius: 1 - t of disc a and t of disc b. Over
    the height that counts for the row the outline runs over a stretch (x0, x1): a flat edge gains and loses pixels all
    along it.
    """
    if piece >= 2:
        k = piece - 2
        ax, ay, by = tangents[who, k, 0], tangents[who, k, 1], tangents[who, k, 2]
        slope, nx, ny = tangents[who, k, 3], tangents[who, k, 4], tangents[who, k, 5]
        top, bottom = _stretch(min(ay, by), max(ay, by), y)
        run = slope * (bottom - top)
        t = min(max((0.5 * (top + bottom) - ay) / (by - ay), 0.0), 1.0) if abs(by - ay) > 1e-9 else 0.5
        along = nx - run * ny  # what a larger radius does
        return ax + slope * (top - ay), ax + slope * (bottom - ay), t, -run, along
    cx, cy, r = discs[who, piece, 0], discs[who, piece, 1], discs[who, piece, 2]
    top, bottom = _stretch(cy - r, cy + r, y)
    top, bottom = min(max(top - cy, -r), r), min(max(bottom - cy, -r), r)
    h_top, h_bottom = np.sqrt(max(r * r - top * top, 0.0)), np.sqrt(max(r * r - bottom * bottom, 0.0))
    turn = outward * r * (np.arcsin(bottom / r) - np.arcsin(top / r))
    return cx + outward * h_top, cx + outward * h_bottom, float(piece), -outward * (h_bottom - h_top), turn


@njit(**INLINE)
def _read(row, x):
    """Read running sums between pixels: pixel i reaches from i - 0.5 to i + 0.5."""
    i = int(x + np.float32(0.5))
    return row[i] + (x + np.float32(0.5) - i) * (row[i + 1] - row[i])


@njit(**INLINE)
def _value(row, x):
    """Read the map itself from its running sums: linear between the pixels' middles."""
    i = int(x)
    f = x - i
    return (1 - f) * (row[i + 1] - row[i]) + f * (row[i + 2] - row[i + 1])


@njit(**EXACT)
def evidence(discs, depth, kinds, share, sums, contrast, origin, work, out, gradient, curvature):
    """Add up maps under the capsules, and how the sum changes as their discs move.

    discs (n, 2, 3) and depth (n,) as `project` gives them, in the pixels of the maps; kinds (n, 2) the map at either
    end of each capsule and share (n,) how far along its axis the first one reaches; sums (k, h, w + 1) running sums of
    the maps over a region whose first pixel is origin (x, y); contrast (k,) by how much each map falls across an edge
    of what it shows. What lies outside the region counts nothing. work is x (n, 2, h), pieces (n, 2, h) and tangents
    (n, 2, 7). Fills out (n, 2, 2), the sum and the area [px] that each capsule owns of its first and its second map;
    and of the first m capsules the gradient (m, 7) and the curvature (m, 7, 7), which is what maps have that fall by
    their contrast within a pixel of every edge, by (x, y, radius) of both discs and the share.
    """
    n, (_, h, w) = len(discs), sums.shape
    n_moving = len(gradient)
    order = np.argsort(depth)
    out[:], gradient[:], curvature[:] = 0, 0, 0
    first, last = np.zeros(n, np.int64), np.zeros(n, np.int64)
    top, bottom = h, 0
    x, pieces, tangents = work
    for i in range(n):
        if depth[i] < BEHIND:
            first[i], last[i] = outline(discs[i, 0], discs[i, 1], origin[1], x[i], pieces[i], tangents[i])
            if last[i] > first[i]:
                top, bottom = min(top, first[i]), max(bottom, last[i])
    taken_x, taken_by = np.empty((MOST_SPANS, 2), np.float32), np.empty((MOST_SPANS, 2), np.int64)
    least, most = np.float32(0), np.float32(w) - np.float32(2)
    ox = np.float32(origin[0])
    for row in range(top, bottom):
        taken, y = 0, row + origin[1]
        for j in range(n):
            i = order[j]
            if row < first[i] or row >= last[i]:
                continue
            a, b = max(np.float32(x[i, 0, row]) - ox, least), min(np.float32(x[i, 1, row]) - ox, most)
            if b <= a:
                continue
            cut, weight, split = _border(discs[i], share[i], y, 0.5 * (a + b) + ox)
            cut -= ox
            border = cut, weight, split
            map_0, map_1 = sums[kinds[i, 0], row], sums[kinds[i, 1], row]
            at, from_k = a, -1  # walk through what nearer capsules have left free
            for k in range(taken + 1):
                if k < taken and taken_x[k, 1] <= at:
                    continue
                is_open = k >= taken or taken_x[k, 0] >= b
                end = b if is_open else taken_x[k, 0]
                if end > at:
                    _own(map_0, map_1, at, end, cut, weight, split, out[i])
                    if n_moving > 0:
                        who, side = (i, 0) if from_k < 0 else (taken_by[from_k, 1], 1)
                        if at > least and who < n_moving:
                            edge = who, pieces[who, side, row], y, side, at, ox
                            pull = -1.0, _at_edge_of(contrast, kinds[i, 0], kinds[i, 1], at, border)
                            _pull(discs, tangents, edge, map_0, map_1, border, pull, gradient, curvature)
                        who, side = (i, 1) if is_open else (taken_by[k, 0], 0)
                        if end < most and who < n_moving:
                            edge = who, pieces[who, side, row], y, side, end, ox
                            pull = 1.0, _at_edge_of(contrast, kinds[i, 0], kinds[i, 1], end, border)
                            _pull(discs, tangents, edge, map_0, map_1, border, pull, gradient, curvature)
                if is_open:
                    break
                at, from_k = max(at, taken_x[k, 1]), k
            taken = _claim(taken_x, taken_by, taken, a, b, i)
    for i in range(n):
        if last[i] <= first[i]:
            continue
        nearer = order, i, first, last, x
        _go_along_level(discs, share, tangents[i], kinds, sums, contrast, nearer, origin, out, gradient, curvature)
        if i < n_moving and kinds[i, 0] != kinds[i, 1]:
            sums_of = sums[kinds[i, 0]], sums[kinds[i, 1]]
            between = 0.5 * (contrast[kinds[i, 0]] + contrast[kinds[i, 1]])
            _pull_border(discs[i], share[i], sums_of, between, nearer, origin, gradient[i], curvature[i])
    for i in range(n_moving):
        for p in range(6):
            for q in range(p):
                curvature[i, q, p] = curvature[i, p, q]


@njit(**INLINE)
def _border(disc, share, y, x_middle):
    """Say where a row meets the border across a capsule, at a share of its axis: (x, weight, split).

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


@njit(**INLINE)
def _own(map_0, map_1, at, end, cut, weight, split, out):
    """Add the sums and the areas from `at` to `end` of a row of running sums to out (2, 2)."""
    if split == 0:
        if weight > 0:
            out[0, 0] += weight * (_read(map_0, end) - _read(map_0, at))
            out[0, 1] += weight * (end - at)
        if weight < 1:
            out[1, 0] += (1 - weight) * (_read(map_1, end) - _read(map_1, at))
            out[1, 1] += (1 - weight) * (end - at)
        return
    middle = min(max(np.float32(cut), at), end)
    i, j = (0, 1) if split > 0 else (1, 0)
    on_left, on_right = (map_0, map_1) if split > 0 else (map_1, map_0)
    out[i, 0] += _read(on_left, middle) - _read(on_left, at)
    out[i, 1] += middle - at
    out[j, 0] += _read(on_right, end) - _read(on_right, middle)
    out[j, 1] += end - middle


@njit(**INLINE)
def _at_edge(map_0, map_1, edge, cut, weight, split):
    """Read the map that holds at an edge of a span."""
    if split == 0:
        return weight * _value(map_0, edge) + (1 - weight) * _value(map_1, edge)
    return _value(map_0, edge) if (edge < cut) == (split > 0) else _value(map_1, edge)


@njit(**INLINE)
def _at_edge_of(contrast, kind_0, kind_1, edge, border):
    """Read the contrast of the map that holds at an edge of a span."""
    cut, weight, split = border
    if split == 0:
        return weight * contrast[kind_0] + (1 - weight) * contrast[kind_1]
    return contrast[kind_0] if (edge < cut) == (split > 0) else contrast[kind_1]


@njit(**INLINE)
def _pull(discs, tangents, edge, map_0, map_1, border, pull, gradient, curvature):
    """Add what the end of a span gains when its capsule's discs move: `pull` is its sign and the contrast there.

    A flat edge gains all along the stretch that it runs over within the row. Level ones are left to `_go_along_level`.
    """
    who, piece, y, side, at, ox = edge
    if piece >= 2 and _is_level(tangents[who, piece - 2]):
        return
    cut, weight, split = border
    sign, contrast = pull
    x0, x1, t, by_y, by_r = _motion(discs, tangents, who, piece, y, 2.0 * side - 1.0)
    last = np.float32(len(map_0) - 2.0)
    left = min(max(np.float32(min(x0, x1)) - ox, np.float32(0)), last)
    right = min(max(np.float32(max(x0, x1)) - ox, np.float32(0)), last)
    if right - left > 1:
        inside = _read_mixed(map_0, map_1, right, cut, weight, split) - _read_mixed(
            map_0, map_1, left, cut, weight, split
        )
        value = sign * inside / (right - left)
    else:
        value = sign * _at_edge(map_0, map_1, at, cut, weight, split)
    _add(1.0, by_y, by_r, t, value, contrast / np.sqrt(1 + by_y * by_y), gradient[who], curvature[who])


@njit(**INLINE)
def _add(by_x, by_y, by_r, t, value, facing, gradient, curvature):
    """Add an edge that moves by_x, by_y, by_r times as x, y, radius: 1 - t of disc a, t of b; `value` is its gain."""
    of_a, of_b, by = 1 - t, t, (by_x, by_y, by_r)
    if of_a > 0:
        for p in range(3):
            gradient[p] += value * of_a * by[p]
            for q in range(p + 1):
                curvature[p, q] += facing * of_a * of_a * by[p] * by[q]
    if of_b > 0:
        for p in range(3):
            gradient[3 + p] += value * of_b * by[p]
            for q in range(p + 1):
                curvature[3 + p, 3 + q] += facing * of_b * of_b * by[p] * by[q]
        if of_a > 0:
            for p in range(3):
                for q in range(3):
                    curvature[3 + p, q] += facing * of_a * of_b * by[p] * by[q]


@njit(**INLINE)
def _is_level(tangent):
    """Say whether a tangent runs across rather than down; False where there is none."""
    return abs(tangent[6] - tangent[0]) > _LEVEL * abs(tangent[2] - tangent[1])


@njit(**EXACT)
def _go_along_level(discs, share, tangents, kinds, sums, contrast, nearer, origin, out, gradient, curvature):
    """Make the sums along the level tangents of a capsule exact, column by column, and add what these gain in moving.

    Rows meet such an edge once or not at all, and count whole: its sum would be a staircase. What it gains in moving
    out is the map there, less that of what lies behind; where a nearer capsule lies over it, it gains nothing.
    """
    order, i, first, last, x = nearer
    _, h, w = sums.shape
    for k in range(2):
        tangent = tangents[k]
        if not _is_level(tangent):
            continue
        ax, ay, by, ny, bx = tangent[0], tangent[1] - origin[1], tangent[2] - origin[1], tangent[5], tangent[6]
        low, high, m, outward = min(ay, by), max(ay, by), (by - ay) / (bx - ax), 1.0 if ny > 0 else -1.0
        for above in range(max(int(np.floor(low)), 0), min(int(np.floor(high)), h - 2) + 1):  # between two rows each
            t_0, t_1 = 0.0, 1.0
            if high - low > 1e-9:
                t_0, t_1 = (max(low, above) - ay) / (by - ay), (min(high, above + 1) - ay) / (by - ay)
            n = int(np.ceil(abs((t_1 - t_0) * (bx - ax))))
            for s in range(n):
                t, step = t_0 + (s + 0.5) / n * (t_1 - t_0), abs((t_1 - t_0) * (bx - ax)) / n
                u, height = ax + t * (bx - ax), ay + t * (by - ay)
                column, y, row = u - origin[0], height + origin[1], int(np.floor(height + 0.5))
                if not 0 <= column < w - 2 or _is_hidden(nearer, u, row):
                    continue
                rows_end = np.floor(height) + 0.5 if ny > 0 else np.ceil(height) - 0.5
                missed = step * outward * (height - rows_end)  # of the area
                half = _half(discs[i], share[i], u, y)
                value, facing = _value_between(sums[kinds[i, half]], column, height, above), contrast[kinds[i, half]]
                out[i, half, 0] += missed * value
                out[i, half, 1] += missed
                is_behind = False
                for j in order:
                    if is_behind and first[j] <= row < last[j] and x[j, 0, row] <= u <= x[j, 1, row]:
                        half = _half(discs[j], share[j], u, y)
                        lost = _value_between(sums[kinds[j, half]], column, height, above)
                        out[j, half, 0] -= missed * lost
                        out[j, half, 1] -= missed
                        value, facing = value - lost, facing + contrast[kinds[j, half]]
                        break
                    is_behind = is_behind or j == i
                if i < len(gradient):
                    facing *= step / np.sqrt(1 + m * m)
                    _add(-m, 1.0, 1 / ny, t, outward * step * value, facing, gradient[i], curvature[i])


@njit(**INLINE)
def _half(disc, share, u, y):
    """Say which of a capsule's two kinds lies at a place."""
    ux, uy = disc[1, 0] - disc[0, 0], disc[1, 1] - disc[0, 1]
    cx, cy = disc[0, 0] + share * ux, disc[0, 1] + share * uy
    return 0 if share >= 1 or (u - cx) * ux + (y - cy) * uy < 0 else 1


@njit(**INLINE)
def _value_between(sums, x, y, above):
    """Read a map between its rows, of which `above` is the upper one."""
    return (above + 1 - y) * _value(sums[above], x) + (y - above) * _value(sums[above + 1], x)


@njit(**INLINE)
def _read_mixed(map_0, map_1, x, cut, weight, split):
    """Read the running sums of the maps that hold left of x, up to a constant."""
    if split == 0:
        return weight * _read(map_0, x) + (1 - weight) * _read(map_1, x)
    on_left, on_right = (map_0, map_1) if split > 0 else (map_1, map_0)
    middle = min(max(np.float32(cut), np.float32(0)), np.float32(len(map_0) - 2.0))
    if x <= middle:
        return _read(on_left, x)
    return _read(on_left, middle) + _read(on_right, x) - _read(on_right, middle)


@njit(**EXACT)
def _is_hidden(nearer, u, row):
    """Say whether a nearer capsule lies over a place of a row."""
    order, i, first, last, x = nearer
    for j in order:
        if j == i:
            return False
        if first[j] <= row < last[j] and x[j, 0, row] <= u <= x[j, 1, row]:
            return True
    return False


@njit(**EXACT)
def _pull_border(disc, share, maps, contrast, nearer, origin, gradient, curvature):
    """Add what a border across a capsule gains when it moves along the axis."""
    ux, uy = disc[1, 0] - disc[0, 0], disc[1, 1] - disc[0, 1]
    length = np.sqrt(ux * ux + uy * uy)
    if length < 1 or not 0 < share < 1:
        return
    ux, uy = ux / length, uy / length
    radius = (1 - share) * disc[0, 2] + share * disc[1, 2]
    cx = (1 - share) * disc[0, 0] + share * disc[1, 0] - origin[0]
    cy = (1 - share) * disc[0, 1] + share * disc[1, 1] - origin[1]
    h, w = maps[0].shape
    step = 2 * radius / _BORDER_SAMPLES
    for i in range(_BORDER_SAMPLES):
        offset = radius * ((2 * i + 1) / _BORDER_SAMPLES - 1)
        x, row = cx - offset * uy, int(np.floor(cy + offset * ux + 0.5))
        if not (0 <= row < h and 0 <= x < w - 2) or _is_hidden(nearer, x + origin[0], row):
            continue
        value = (_value(maps[0][row], x) - _value(maps[1][row], x)) * step
        along = (ux * (1 - share), uy * (1 - share), 0.0, ux * share, uy * share, 0.0, length)
        for p in range(7):
            gradient[p] += value * along[p]
            for q in range(7):
                curvature[p, q] += contrast * step * along[p] * along[q]


@njit(**INLINE)
def _claim(taken_x, taken_by, taken, a, b, owner):
    """Join a span to the ordered, separate ones taken so far, each end with its owner; return how many there are."""
    left_by, right_by, kept = owner, owner, 0
    for k in range(taken):
        if taken_x[k, 1] < a or taken_x[k, 0] > b:
            taken_x[kept], taken_by[kept] = taken_x[k], taken_by[k]
            kept += 1
            continue
        if taken_x[k, 0] <= a:
            a, left_by = taken_x[k, 0], taken_by[k, 0]
        if taken_x[k, 1] >= b:
            b, right_by = taken_x[k, 1], taken_by[k, 1]
    if kept == MOST_SPANS:
        return kept
    k = kept
    while k > 0 and taken_x[k - 1, 0] > a:
        taken_x[k], taken_by[k] = taken_x[k - 1], taken_by[k - 1]
        k -= 1
    taken_x[k, 0], taken_x[k, 1], taken_by[k, 0], taken_by[k, 1] = a, b, left_by, right_by
    return kept + 1


@njit(**EXACT)
def labels(discs, depth, kinds, share, out):
    """Fill out (h, w) with the kind of the nearest capsule at each pixel, -1 where there is none; see `evidence`."""
    h, w = out.shape
    out[:] = -1
    x, pieces, tangents = np.empty((2, h)), np.empty((2, h), np.int64), np.empty((2, 7))
    order = np.argsort(-depth)
    for i in order:
        if depth[i] >= BEHIND:
            continue
        first, last = outline(discs[i, 0], discs[i, 1], 0.0, x, pieces, tangents)
        for y in range(first, last):
            for u in range(max(int(np.ceil(x[0, y])), 0), min(int(np.floor(x[1, y])), w - 1) + 1):
                out[y, u] = kinds[i, _half(discs[i], share[i], u, y)]
