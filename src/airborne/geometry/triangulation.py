"""Points from pixels: linear triangulation, the maximum-likelihood point. Arrays only."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airborne.types import Array

_SMALLEST_EIGENVALUE_RATIO = 1e-12  # below it the rays are parallel to working precision
_N_STEPS = 6  # Gauss-Newton steps; each squares the error, and the linear start is within a few pixels


def px_from_points(P: Array, points: Array) -> Array:
    """Project points (..., 3) [m] by projection matrices P (..., c, 3, 4): (..., c, 2) [px]; NaN behind the camera.

    P is scaled so that its third row gives a positive depth in front of the camera, as in `P = K [R|t]`.
    """
    xyw = _homogeneous_px(P, np.asarray(points, float))
    return xyw[..., :2] / np.where(xyw[..., 2:] > 0, xyw[..., 2:], np.nan)


def triangulate(P: Array, px: Array, weights: Array | None = None) -> Array:
    """Return the points (..., 3) [m] whose projections lie nearest to px (..., c, 2) [px], in the least-squares sense.

    P (..., c, 3, 4) as in `px_from_points`; px without distortion, NaN where a camera does not see the point. With
    independent click errors of variance 1 / weight, weights (..., c) above zero, all alike if not given, this is the
    maximum-likelihood point: the linear solution, then Gauss-Newton on the reprojection. NaN where fewer than two
    cameras see the point, where their rays are parallel, or where the solution lies behind a camera that sees it.
    """
    px = np.asarray(px, float)
    points = triangulate_linear(P, px)
    root = np.ones(px.shape[:-1]) if weights is None else np.sqrt(weights)
    for _ in range(_N_STEPS):
        points = points + _gauss_newton_step(P, points, px, root)
    residual, jacobian = _residual_and_jacobian(P, points, px)
    is_lost = np.isnan(residual).any(axis=(-2, -1), keepdims=True) | np.isnan(_inverse(jacobian))
    return np.where(is_lost.any(axis=-1), np.nan, points)


def _gauss_newton_step(P: Array, points: Array, px: Array, root: Array) -> Array:
    """Return the step (..., 3) of least squares, residuals weighted by the squares of `root` (..., c)."""
    residual, jacobian = _residual_and_jacobian(P, points, px)
    jacobian = root[..., None, None] * jacobian
    gradient = np.einsum("...cik,...ci->...k", jacobian, root[..., None] * residual)
    return np.einsum("...jk,...k->...j", _inverse(jacobian), gradient)


def triangulate_linear(P: Array, px: Array) -> Array:
    """Return the points (..., 3) [m] that solve `u P3 X = P1 X, v P3 X = P2 X` over all views in the algebraic sense.

    P (..., c, 3, 4), px (..., c, 2) [px] with NaN for a missing view; NaN where fewer than two views remain.
    """
    px = np.asarray(px, float)
    rows = px[..., None] * P[..., 2:, :] - P[..., :2, :]  # (..., c, 2, 4)
    rows = np.where(_is_seen(px)[..., None, None], rows, 0.0)
    rows = rows.reshape(*rows.shape[:-3], 2 * rows.shape[-3], 4)
    if rows.shape[-2] < 4:
        return np.full((*rows.shape[:-2], 3), np.nan)
    homogeneous = np.linalg.svd(rows, full_matrices=False)[2][..., -1, :]
    w = homogeneous[..., 3:]
    is_finite = (_is_seen(px).sum(-1) >= 2)[..., None] & (np.abs(w) > 1e-12)
    return np.where(is_finite, homogeneous[..., :3] / np.where(is_finite, w, 1.0), np.nan)


def _homogeneous_px(P: Array, points: Array) -> Array:
    return np.einsum("...cij,...j->...ci", P[..., :3], points) + P[..., 3]


def _is_seen(px: Array) -> NDArray[np.bool_]:
    return np.asarray(~np.isnan(px).any(axis=-1))


def _residual_and_jacobian(P: Array, points: Array, px: Array) -> tuple[Array, Array]:
    """Residual (..., c, 2) and the projection's derivative (..., c, 2, 3); zero for views that do not see the point."""
    is_seen = _is_seen(px)[..., None]
    projected = px_from_points(P, points)
    depth = _homogeneous_px(P, points)[..., 2]
    depth = np.where(depth > 0, depth, np.nan)
    jacobian = (P[..., :2, :3] - projected[..., None] * P[..., 2:, :3]) / depth[..., None, None]
    return np.where(is_seen, px - projected, 0.0), np.where(is_seen[..., None], jacobian, 0.0)


def _inverse(jacobian: Array) -> Array:
    """Return `(J^T J)^-1` (..., 3, 3) for J (..., c, 2, 3); NaN where it does not exist."""
    information = np.einsum("...cij,...cik->...jk", jacobian, jacobian)
    is_finite = np.isfinite(information).all(axis=(-2, -1))[..., None, None]
    values, vectors = np.linalg.eigh(np.where(is_finite, information, 0.0))
    is_regular = values[..., :1] > _SMALLEST_EIGENVALUE_RATIO * values[..., -1:]
    scaled = vectors / np.where(is_regular, values, np.nan)[..., None, :]
    return scaled @ np.swapaxes(vectors, -1, -2)
