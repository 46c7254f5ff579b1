"""The evidence of a jumper in all cameras, and the normal equations of its pose and shape.

A state is one array (35,): the pose (18,), the lengths (9,) and the radii (8,) of `body.jumper`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airborne.kernels import kernel
from airborne.tracking.capsules.evidence import evidence
from airborne.tracking.capsules.jumper import CAPSULES, KINDS, N_DOF, place, shares
from airborne.tracking.capsules.outlines import BEHIND, project

N_LENGTHS, N_CAPSULES, N_POINTS = 9, 10, 9
NOBODY = np.empty((0, 2, 3)), np.empty((0, 2))  # the capsules of no other players
_STEP = 1e-4  # [m, rad] of the differences that say how points and capsules move
_OF_CAPSULE = 9  # what says where a capsule is: both ends (6), both radii [m], the share


def kinds_with(others: tuple[NDArray, NDArray]) -> NDArray[np.int64]:
    """Return the kinds of a jumper's capsules and of others' (10 + m, 2); these have one of their own."""
    return np.concatenate([CAPSULES[:, :2], np.full((len(others[0]), 2), len(KINDS))])


@kernel
def placed(state, points, ends, balls, share):
    """Place a state: fill points (9, 3) [m], the capsules' ends (10, 2, 3) and radii (10, 2) [m], and shares (10,)."""
    lengths, radii = state[N_DOF : N_DOF + N_LENGTHS], state[N_DOF + N_LENGTHS :]
    place(state[:N_DOF], lengths, radii, points, ends, balls)
    shares(lengths, radii, share)


@kernel
def gathered(state, n_free, cameras, kinds, maps, others, work, owned, equations):
    """Add up a jumper's evidence over the views and return it [nats times pixels].

    cameras (v, 4, 4) see the regions of maps: sums (v, k + 1, h, w + 1), the last empty, and contrast (v, k + 1), as
    `capsule_evidence.evidence` takes them. The empty map belongs to `others`, capsules ends (m, 2, 3) and balls (m, 2)
    [m] of other players, who hide what lies behind them. kinds (10 + m, 2).
    Fills owned (v, 10 + m, 2, 2), see there, and equations: points (9, 3) [m], and with n_free > 0 their Jacobian
    (27, n_free), and for the first numbers of the state the gradient (n_free,), the curvature (n_free, n_free) and
    spread (n_free, n_free): the covariance of the gradient when every capsule's outline lies beside the player's by one
    metre's sd, right or down, in each view by itself.

    Views add up capsule by capsule in the world, 9 numbers each; only the sums are mapped to the state.
    """
    points, by_state, gradient, curvature, spread = equations
    sums, contrast = maps
    other_ends, other_balls = others
    n, all_n, n_views = N_CAPSULES, N_CAPSULES + len(other_ends), len(cameras)
    ends, balls, share = np.empty((all_n, 2, 3)), np.empty((all_n, 2)), np.ones(all_n)
    ends[n:], balls[n:] = other_ends, other_balls
    discs, depth = np.empty((all_n, 2, 3)), np.empty(all_n)
    m = n if n_free > 0 else 0
    g, H = np.empty((m, 7)), np.empty((m, 7, 7))
    pull, stiffness = np.zeros((n, _OF_CAPSULE)), np.zeros((n, _OF_CAPSULE, _OF_CAPSULE))
    beside = np.zeros((n, 2 * n_views, _OF_CAPSULE))
    placed(state, points, ends, balls, share)
    total, origin = 0.0, np.zeros(2)
    for v in range(n_views):
        project(ends, balls, cameras[v], discs, depth)
        evidence(discs, depth, kinds, share, sums[v], contrast[v], origin, work, owned[v], g, H)
        for i in range(n):
            total += owned[v, i, 0, 0] + owned[v, i, 1, 0]
            if n_free > 0 and depth[i] < BEHIND:
                rows = beside[i, 2 * v : 2 * v + 2]
                _lift(ends[i], discs[i], depth[i], cameras[v], g[i], H[i], pull[i], stiffness[i], rows)
    if n_free > 0:
        by_capsule = np.empty((n, _OF_CAPSULE, n_free))
        _differentiate(state, points, ends, balls, share, by_state, by_capsule)
        stiff, aside = np.empty((n, _OF_CAPSULE, n_free)), np.empty((n, 2 * n_views, n_free))
        for i in range(n):
            stiff[i] = stiffness[i] @ by_capsule[i]
            aside[i] = beside[i] @ by_capsule[i]
        flat, flat_aside = by_capsule.reshape(-1, n_free), aside.reshape(-1, n_free)
        gradient[:] = pull.reshape(-1) @ flat
        curvature[:] = flat.T @ stiff.reshape(-1, n_free)
        spread[:] = flat_aside.T @ flat_aside
    return total


@kernel
def _lift(ends, discs, depth, camera, g, H, pull, stiffness, beside):
    """Add a capsule's gradient (7,) and curvature (7, 7) by its discs and share to those by where it is in the world.

    Adds to pull (9,) and stiffness (9, 9); fills beside (2, 9): how the pull changes as the outline shifts right, and
    down, by a metre.
    """
    J, HJ = np.zeros((7, _OF_CAPSULE)), np.zeros((7, _OF_CAPSULE))
    for e in range(2):
        x, y, z = ends[e]
        w = camera[2, 0] * x + camera[2, 1] * y + camera[2, 2] * z + camera[2, 3]
        for k in range(3):
            J[3 * e, 3 * e + k] = (camera[0, k] - discs[e, 0] * camera[2, k]) / w
            J[3 * e + 1, 3 * e + k] = (camera[1, k] - discs[e, 1] * camera[2, k]) / w
            J[3 * e + 2, 3 * e + k] = -discs[e, 2] * camera[2, k] / w
        J[3 * e + 2, 6 + e] = camera[3, 0] / w
    J[6, 8] = 1
    for p in range(7):
        for q in range(7):
            if H[p, q] != 0:
                for k in range(_OF_CAPSULE):
                    HJ[p, k] += H[p, q] * J[q, k]
    for p in range(7):
        for k in range(_OF_CAPSULE):
            if J[p, k] != 0:  # half of them are
                pull[k] += J[p, k] * g[p]
                for i in range(_OF_CAPSULE):
                    stiffness[k, i] += J[p, k] * HJ[p, i]
    px_per_m = camera[3, 0] / depth
    for p in range(2):
        for k in range(_OF_CAPSULE):
            beside[p, k] = px_per_m * (HJ[p, k] + HJ[p + 3, k])


@kernel
def _differentiate(state, points, ends, balls, share, by_state, by_capsule):
    """Fill how the points (27, n_free) and the capsules (10, 9, n_free) move with the first numbers of a state."""
    n, n_free = N_CAPSULES, by_state.shape[1]
    moved_points, moved_ends = np.empty((N_POINTS, 3)), np.empty((n, 2, 3))
    moved_balls, moved_share = np.empty((n, 2)), np.empty(n)
    for k in range(n_free):
        kept = state[k]
        state[k] = kept + _STEP
        placed(state, moved_points, moved_ends, moved_balls, moved_share)
        state[k] = kept
        for i in range(N_POINTS):
            for p in range(3):
                by_state[3 * i + p, k] = (moved_points[i, p] - points[i, p]) / _STEP
        for i in range(n):
            for e in range(2):
                for p in range(3):
                    by_capsule[i, 3 * e + p, k] = (moved_ends[i, e, p] - ends[i, e, p]) / _STEP
                by_capsule[i, 6 + e, k] = (moved_balls[i, e] - balls[i, e]) / _STEP
            by_capsule[i, 8, k] = (moved_share[i] - share[i]) / _STEP
