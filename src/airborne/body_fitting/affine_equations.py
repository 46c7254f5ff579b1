"""A kernel: normal equations of the segments' affine motions, summed over one view's pixels.

As `tracking.model_based.twist_equations`, for surfaces that also change their shape: see `shape_motion`.
"""

from __future__ import annotations

import numpy as np

from airborne.kernels import kernel

_EDGE = 0.01  # blurred coverage below which a pixel is not used


@kernel(fastmath=True)
def add_affine_equations(
    residual, shape, coverage, weights, owner, nearness, is_border, border_axes, background, projection, A, g
):
    """Add one view's normal equations of the motion of each of s segments, A (s, 13, 13) and g (s, 13): A motion = g.

    residual, shape (3, h, w): blurred observed minus rendered, and the blurred colours of the body on black; coverage
    (h, w) blurred alike; weights (h, w); owner, nearness (h, w) as `find_owners` has them; is_border (h, w) where a
    segment changes colour, which moves along border_axes (s, 3), world; background (3, h, w). Lower triangles of A.
    """
    view, K, origin = projection.packed_view, projection.K, projection.origin
    c, h, w = residual.shape
    fx, fy, cx, cy = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    a, b = np.zeros(13), np.zeros(13)
    o = np.zeros(3)
    for y in range(1, h - 1):
        ry = (y - cy) / fy
        for x in range(1, w - 1):
            e = owner[y, x]
            if coverage[y, x] < _EDGE or e < 0:
                continue
            sxx, sxy, syy, sx, sy = 0.0, 0.0, 0.0, 0.0, 0.0
            mx = 0.5 * (coverage[y, x + 1] - coverage[y, x - 1])
            my = 0.5 * (coverage[y + 1, x] - coverage[y - 1, x])
            for k in range(c):
                behind = background[k, y, x]  # uncovered where the body leaves
                gx = 0.5 * (shape[k, y, x + 1] - shape[k, y, x - 1]) - behind * mx
                gy = 0.5 * (shape[k, y + 1, x] - shape[k, y - 1, x]) - behind * my
                sxx += gx * gx
                sxy += gx * gy
                syy += gy * gy
                sx += gx * residual[k, y, x]
                sy += gy * residual[k, y, x]
            if sxx + syy < 1e-10:
                continue
            inv_z, weight = nearness[y, x], weights[y, x]
            rx = (x - cx) / fx
            px, py, pz = rx / inv_z - view[9], ry / inv_z - view[10], 1.0 / inv_z - view[11]
            for i in range(3):
                o[i] = view[i] * px + view[3 + i] * py + view[6 + i] * pz - origin[i]
                a[i] = fx * inv_z * (view[i] - rx * view[6 + i])
                b[i] = fy * inv_z * (view[3 + i] - ry * view[6 + i])
            for i in range(3):
                for j in range(3):
                    a[3 + 3 * i + j] = a[i] * o[j]
                    b[3 + 3 * i + j] = b[i] * o[j]
            a[12], b[12] = 0.0, 0.0
            if is_border[y, x]:
                for i in range(3):
                    a[12] += a[i] * border_axes[e, i]
                    b[12] += b[i] * border_axes[e, i]
            sxx *= weight
            sxy *= weight
            syy *= weight
            sx *= weight
            sy *= weight
            for i in range(13):
                # a body that moves by du takes its image along: the image changes by -gradient du
                g[e, i] -= sx * a[i] + sy * b[i]
                ai = sxx * a[i] + sxy * b[i]
                bi = sxy * a[i] + syy * b[i]
                for j in range(i + 1):
                    A[e, i, j] += ai * a[j] + bi * b[j]
