"""The evidence of a jumper in all cameras, and the normal equations of its pose and shape.

A state is one array (35,): the pose (18,), the lengths (9,) and the radii (8,) of `body.jumper`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from airborne.body.jumper import N_DOF, place, shares
from airborne.rendering.capsules import EXACT, evidence, project

N_LENGTHS, N_CAPSULES, N_POINTS = 9, 10, 9
_STEP = 1e-4  # [m, rad] of the differences that say how points and discs move


@njit(**EXACT)
def placed(state, points, ends, balls, share):
    """Place a state: fill points (9, 3) [m], the capsules' ends (10, 2, 3) and radii (10, 2) [m], and shares (10,)."""
    lengths, radii = state[N_DOF : N_DOF + N_LENGTHS], state[N_DOF + N_LENGTHS :]
    place(state[:N_DOF], lengths, radii, points, ends, balls)
    shares(lengths, radii, share)


@njit(**EXACT)
def gathered(state, n_free, cameras, kinds, maps, others, work, owned, equations):
    """Add up a jumper's evidence over the views and return it [nats times pixels].

    cameras (v, 4, 4) see the regions of maps: sums (v, k + 1, h, w + 1), the last empty, and contrast (v, k + 1), see
    `capsules.evidence`. The empty map belongs to `others`,
    capsules ends (m, 2, 3) and balls (m, 2) [m] of other players, who hide what lies behind them. kinds (10 + m, 2).
    Fills owned (v, 10 + m, 2, 2), see `capsules.evidence`, and equations: points (9, 3) [m], and with n_free > 0 their
    Jacobian (27, n_free), and for the first numbers of the state the gradient (n_free,), the curvature (n_free, n_free)
    and spread (n_free, n_free): the covariance of the gradient when every capsule's outline lies beside the player's by
    one metre's sd, right or down, in each view by itself.
    """
    points, by_state, gradient, curvature, spread = equations
    sums, contrast = maps
    other_ends, other_balls = others
    n, all_n = N_CAPSULES, N_CAPSULES + len(other_ends)
    ends, balls, share = np.empty((all_n, 2, 3)), np.empty((all_n, 2)), np.ones(all_n)
    ends[n:], balls[n:] = other_ends, other_balls
    discs, moved_discs = np.empty((all_n, 2, 3)), np.empty((n, 2, 3))
    depth, moved_depth = np.empty(all_n), np.empty(n)
    m = all_n if n_free > 0 else 0
    g, H, J = np.empty((m, 7)), np.empty((m, 7, 7)), np.empty((n, 7, n_free))
    HJ, beside = np.empty((n, 7, n_free)), np.empty((2 * n, n_free))
    moved_points = np.empty((N_POINTS, 3))
    moved_ends, moved_balls = np.empty((n_free, n, 2, 3)), np.empty((n_free, n, 2))
    moved_share = np.empty((n_free, n))
    placed(state, points, ends, balls, share)
    for k in range(n_free):
        kept = state[k]
        state[k] = kept + _STEP
        placed(state, moved_points, moved_ends[k], moved_balls[k], moved_share[k])
        state[k] = kept
        for i in range(N_POINTS):
            for p in range(3):
                by_state[3 * i + p, k] = (moved_points[i, p] - points[i, p]) / _STEP
    gradient[:], curvature[:], spread[:] = 0, 0, 0
    total, origin = 0.0, np.zeros(2)
    for v in range(len(cameras)):
        project(ends, balls, cameras[v], discs, depth)
        evidence(discs, depth, kinds, share, sums[v], contrast[v], origin, work, owned[v], g, H)
        for i in range(n):
            total += owned[v, i, 0, 0] + owned[v, i, 1, 0]
        for k in range(n_free):
            project(moved_ends[k], moved_balls[k], cameras[v], moved_discs, moved_depth)
            for i in range(n):
                for p in range(6):
                    J[i, p, k] = (moved_discs[i, p // 3, p % 3] - discs[i, p // 3, p % 3]) / _STEP
                J[i, 6, k] = (moved_share[k, i] - share[i]) / _STEP
        if n_free > 0:
            for i in range(n):
                px = cameras[v, 3, 0] / max(depth[i], 0.1)
                for p in range(7):
                    HJ[i, p] = 0
                    for q in range(7):
                        HJ[i, p] += H[i, p, q] * J[i, q]
                for p in range(2):
                    beside[2 * i + p] = px * (HJ[i, p] + HJ[i, p + 3])
            flat = J.reshape(7 * n, n_free)
            gradient += g[:n].reshape(7 * n) @ flat
            curvature += flat.T @ HJ.reshape(7 * n, n_free)
            spread += beside.T @ beside
    return total
