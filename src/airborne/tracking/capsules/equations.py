"""The evidence of a jumper in all cameras, and the normal equations of its pose and shape.

A state is one array (35,): the pose (18,), the lengths (9,) and the radii (8,) of `jumper`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airborne.kernels import kernel
from airborne.kernels.arrays import assign
from airborne.tracking.capsules.evidence import capsule_evidence
from airborne.tracking.capsules.jumper import CAPSULES, N_DOF, SURFACE_CLASSES, border_shares, pose_capsules
from airborne.tracking.capsules.kernel_arguments import Capsules
from airborne.tracking.capsules.outlines import BEHIND_M, project_capsules

N_LENGTHS, N_CAPSULES, N_POINTS = 9, 10, 9  # see `jumper`
_STEP = 1e-4  # [m, rad] of the finite differences
_N_PARAMETERS = 9  # parameters of a capsule: both ends (6), both radii [m], the share


def classes_with(others: Capsules) -> NDArray[np.int64]:
    """Return the surface classes of a jumper's capsules and of others' (10 + m, 2), which share one of their own."""
    return np.concatenate([CAPSULES[:, :2], np.full((len(others.ends), 2), len(SURFACE_CLASSES))])


@kernel
def pose_state(state, points, ends, end_radii, share):
    """Pose a state: fill points (9, 3) [m], the capsules' ends (10, 2, 3) and radii (10, 2) [m], and shares (10,)."""
    lengths, radii = state[N_DOF : N_DOF + N_LENGTHS], state[N_DOF + N_LENGTHS :]
    pose_capsules(state[:N_DOF], lengths, radii, points, ends, end_radii)
    border_shares(lengths, radii, share)


@kernel
def accumulate_equations(state, n_free, images, owned, equations):
    """Sum a jumper's evidence over the views and return it [nats times pixels].

    Fills owned (v, 10 + m, 2, 2), as `capsule_evidence` does for each view, and the points of the equations; with
    n_free > 0 their Jacobian, and for the first numbers of the state the gradient, the curvature and the score
    covariance: that of the gradient if every capsule's outline is offset from the player's with a sd of one metre,
    right and down, independently in each view.

    Views are summed per capsule in the world, 9 parameters each; only the sums are mapped to the state.
    """
    points, jacobian, gradient, curvature, score_covariance = equations
    cameras, others, classes, work = images.cameras, images.others, images.classes, images.work
    sums, contrast = images.maps.sums, images.maps.contrast
    n, all_n, n_views = N_CAPSULES, N_CAPSULES + len(others.ends), len(cameras)
    ends, end_radii, share = np.empty((all_n, 2, 3)), np.empty((all_n, 2)), np.ones(all_n)
    assign(ends[n:], others.ends)
    assign(end_radii[n:], others.radii)
    discs, depth = np.empty((all_n, 2, 3)), np.empty(all_n)
    m = n if n_free > 0 else 0
    g, H = np.empty((m, 7)), np.empty((m, 7, 7))
    capsule_gradient, capsule_curvature = np.zeros((n, _N_PARAMETERS)), np.zeros((n, _N_PARAMETERS, _N_PARAMETERS))
    offset_gradient = np.zeros((n, 2 * n_views, _N_PARAMETERS))
    pose_state(state, points, ends, end_radii, share)
    total, origin = 0.0, np.zeros(2)
    for v in range(n_views):
        project_capsules(ends, end_radii, cameras[v], discs, depth)
        capsule_evidence(discs, depth, classes, share, sums[v], contrast[v], origin, work, owned[v], g, H)
        for i in range(n):
            total += owned[v, i, 0, 0] + owned[v, i, 1, 0]
            if n_free > 0 and depth[i] < BEHIND_M:
                rows = offset_gradient[i, 2 * v : 2 * v + 2]
                _chain_to_world(
                    ends[i], discs[i], depth[i], cameras[v], g[i], H[i], capsule_gradient[i], capsule_curvature[i], rows
                )
    if n_free > 0:
        capsule_jacobian = np.empty((n, _N_PARAMETERS, n_free))
        _differentiate(state, points, ends, end_radii, share, jacobian, capsule_jacobian)
        curved, state_offset = np.empty((n, _N_PARAMETERS, n_free)), np.empty((n, 2 * n_views, n_free))
        for i in range(n):
            assign(curved[i], capsule_curvature[i] @ capsule_jacobian[i])
            assign(state_offset[i], offset_gradient[i] @ capsule_jacobian[i])
        flat, flat_offset = capsule_jacobian.reshape(-1, n_free), state_offset.reshape(-1, n_free)
        assign(gradient, capsule_gradient.reshape(-1) @ flat)
        assign(curvature, flat.T @ curved.reshape(-1, n_free))
        assign(score_covariance, flat_offset.T @ flat_offset)
    return total


@kernel(is_inner=True)
def _chain_to_world(ends, discs, depth, camera, g, H, capsule_gradient, capsule_curvature, offset_gradient):
    """Chain a capsule's gradient (7,) and curvature (7, 7) by its discs and share to its parameters in the world.

    Adds to capsule_gradient (9,) and capsule_curvature (9, 9); fills offset_gradient (2, 9): how the gradient changes
    as the outline shifts right, and down, by a metre.
    """
    J, HJ = np.zeros((7, _N_PARAMETERS)), np.zeros((7, _N_PARAMETERS))
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
                for k in range(_N_PARAMETERS):
                    HJ[p, k] += H[p, q] * J[q, k]
    for p in range(7):
        for k in range(_N_PARAMETERS):
            if J[p, k] != 0:  # half of them are
                capsule_gradient[k] += J[p, k] * g[p]
                for i in range(_N_PARAMETERS):
                    capsule_curvature[k, i] += J[p, k] * HJ[p, i]
    px_per_m = camera[3, 0] / depth
    for p in range(2):
        for k in range(_N_PARAMETERS):
            offset_gradient[p, k] = px_per_m * (HJ[p, k] + HJ[p + 3, k])


@kernel(is_inner=True)
def _differentiate(state, points, ends, end_radii, share, jacobian, capsule_jacobian):
    """Fill the Jacobians of points (27, n_free) and capsules (10, 9, n_free) by the first numbers of a state."""
    n, n_free = N_CAPSULES, jacobian.shape[1]
    moved_points, moved_ends = np.empty((N_POINTS, 3)), np.empty((n, 2, 3))
    moved_radii, moved_share = np.empty((n, 2)), np.empty(n)
    for k in range(n_free):
        value = state[k]
        state[k] = value + _STEP
        pose_state(state, moved_points, moved_ends, moved_radii, moved_share)
        state[k] = value
        for i in range(N_POINTS):
            for p in range(3):
                jacobian[3 * i + p, k] = (moved_points[i, p] - points[i, p]) / _STEP
        for i in range(n):
            for e in range(2):
                for p in range(3):
                    capsule_jacobian[i, 3 * e + p, k] = (moved_ends[i, e, p] - ends[i, e, p]) / _STEP
                capsule_jacobian[i, 6 + e, k] = (moved_radii[i, e] - end_radii[i, e]) / _STEP
            capsule_jacobian[i, 8, k] = (moved_share[i] - share[i]) / _STEP
