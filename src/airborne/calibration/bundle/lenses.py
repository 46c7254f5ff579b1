"""Projection with its derivatives, for cameras of both lens models. Arrays only."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airborne.cameras.distortion import distort, distort_fisheye
from airborne.types import Array

N_PARAMETERS = 15  # of a camera: turn (3) [rad], centre (3) [m], fx, fy, cx, cy [px], five lens terms
CAMERA_PARAMETERS = (
    *("turn_x_rad", "turn_y_rad", "turn_z_rad", "x_m", "y_m", "z_m"),
    *("fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3"),
)
FISHEYE_PARAMETERS = (*CAMERA_PARAMETERS[:10], "k1", "k2", "k3", "k4", "")
_NEAREST_DEPTH_M = 1e-9  # what lies no further in front of a camera is behind it


def project(R: Array, centre: Array, inner: Array, is_fisheye: NDArray[np.bool_], world: Array) -> Array:
    """Project one world point a row: (n, 2) [px]; NaN behind the camera.

    R (n, 3, 3) camera from world, centre (n, 3) [m], inner (n, 9) fx, fy, cx, cy and lens terms, world (n, 3) [m].
    """
    xyz = np.einsum("nij,nj->ni", R, world - centre)
    z = np.where(xyz[:, 2:] > _NEAREST_DEPTH_M, xyz[:, 2:], np.nan)
    return inner[:, :2] * _distort(xyz[:, :2] / z, inner[:, 4:], is_fisheye) + inner[:, 2:4]


def project_with_jacobian(
    R: Array, centre: Array, inner: Array, is_fisheye: NDArray[np.bool_], world: Array
) -> tuple[Array, Array, Array]:
    """Return pixels (n, 2) and their derivatives to the camera's numbers (n, 2, 15) and the point (n, 2, 3).

    Arguments as in `projected`. The numbers are those of `NUMBERS`: a turn about the camera's own axes,
    `R <- exp(turn) R`, and steps of the others. Behind the camera the pixels are NaN and the derivatives 0.
    """
    xyz = np.einsum("nij,nj->ni", R, world - centre)
    is_seen = xyz[:, 2] > _NEAREST_DEPTH_M
    z = np.where(is_seen, xyz[:, 2], 1.0)
    xy = np.where(is_seen[:, None], xyz[:, :2], 0.0) / z[:, None]
    bent = _distort(xy, inner[:, 4:], is_fisheye)
    bend, by_terms = _lens_jacobian(xy, inner[:, 4:], is_fisheye)
    to_plane = np.zeros((len(xy), 2, 3))  # d xy / d xyz
    to_plane[:, 0, 0] = to_plane[:, 1, 1] = 1 / z
    to_plane[:, :, 2] = -xy / z[:, None]
    by_xyz = inner[:, :2, None] * (bend @ to_plane)
    by_world = by_xyz @ R
    slopes = np.zeros((len(xy), 2, N_PARAMETERS))
    slopes[:, :, :3] = -by_xyz @ cross_matrices(xyz)
    slopes[:, :, 3:6] = -by_world
    slopes[:, [0, 1], [6, 7]] = bent
    slopes[:, [0, 1], [8, 9]] = 1.0
    slopes[:, :, 10:] = inner[:, :2, None] * by_terms
    px = np.where(is_seen[:, None], inner[:, :2] * bent + inner[:, 2:4], np.nan)
    return px, np.where(is_seen[:, None, None], slopes, 0.0), np.where(is_seen[:, None, None], by_world, 0.0)


def cross_matrices(v: Array) -> Array:
    """Return the matrices (n, 3, 3) with `matrix @ w = v x w` for vectors v (n, 3)."""
    m = np.zeros((len(v), 3, 3))
    m[:, 2, 1], m[:, 0, 2], m[:, 1, 0] = v[:, 0], v[:, 1], v[:, 2]
    return m - np.swapaxes(m, 1, 2)


def _distort(xy: Array, terms: Array, is_fisheye: NDArray[np.bool_]) -> Array:
    out = distort(xy, terms.T)
    if is_fisheye.any():
        out[is_fisheye] = distort_fisheye(xy[is_fisheye], terms[is_fisheye, :4].T)
    return out


def _lens_jacobian(xy: Array, terms: Array, is_fisheye: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return the derivatives of the bent points to the straight ones (n, 2, 2) and to the terms (n, 2, 5)."""
    bend, by_terms = _brown_jacobian(xy, terms)
    if is_fisheye.any():
        bend[is_fisheye], by_terms[is_fisheye] = _fisheye_jacobian(xy[is_fisheye], terms[is_fisheye])
    return bend, by_terms


def _brown_jacobian(xy: Array, terms: Array) -> tuple[Array, Array]:
    k1, k2, p1, p2, k3 = terms.T
    x, y = xy.T
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    steepness = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3))
    bend = np.empty((len(xy), 2, 2))
    bend[:, 0, 0] = radial + x * x * steepness + 2 * p1 * y + 6 * p2 * x
    bend[:, 1, 1] = radial + y * y * steepness + 6 * p1 * y + 2 * p2 * x
    bend[:, 0, 1] = bend[:, 1, 0] = x * y * steepness + 2 * p1 * x + 2 * p2 * y
    by_x = np.stack([x * r2, x * r2**2, 2 * x * y, r2 + 2 * x * x, x * r2**3], axis=-1)
    by_y = np.stack([y * r2, y * r2**2, r2 + 2 * y * y, 2 * x * y, y * r2**3], axis=-1)
    return bend, np.stack([by_x, by_y], axis=1)


def _fisheye_jacobian(xy: Array, terms: Array) -> tuple[Array, Array]:
    r = np.maximum(np.hypot(xy[:, 0], xy[:, 1]), 1e-8)
    angle = np.arctan(r)
    powers = angle[:, None] ** np.array([3, 5, 7, 9])
    radius = angle + np.einsum("nk,nk->n", terms[:, :4], powers)
    steepness = 1 + np.einsum("nk,nk->n", terms[:, :4] * [3, 5, 7, 9], powers / angle[:, None])
    scale = radius / r
    scale_slope = (steepness / (1 + r * r) - scale) / r  # d scale / d r
    unit = xy / r[:, None]
    bend = scale[:, None, None] * np.eye(2) + (scale_slope * r)[:, None, None] * unit[:, :, None] * unit[:, None, :]
    by_terms = np.zeros((len(xy), 2, 5))
    by_terms[:, :, :4] = unit[:, :, None] * powers[:, None, :]
    return bend, by_terms
