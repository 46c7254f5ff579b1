"""Projection and its Jacobian, for cameras of both lens models, as arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airborne.cameras.camera import Camera
from airborne.cameras.distortion import distort, distort_fisheye, radial_factor
from airborne.types import Array

N_PARAMETERS = 18  # of a camera: rotation (3) [rad], centre (3) [m], fx, fy, cx, cy [px], eight lens terms
CAMERA_PARAMETERS = (
    *("turn_x_rad", "turn_y_rad", "turn_z_rad", "x_m", "y_m", "z_m"),
    *("fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
)
FISHEYE_PARAMETERS = (*CAMERA_PARAMETERS[:10], "k1", "k2", "k3", "k4", "", "", "", "")
_NEAREST_DEPTH_M = 1e-9  # a point at a smaller depth counts as behind the camera


def project(R: Array, centre: Array, intrinsics: Array, *, is_fisheye: NDArray[np.bool_], world: Array) -> Array:
    """Project one world point a row: (n, 2) [px]; NaN behind the camera.

    R (n, 3, 3) camera from world, centre (n, 3) [m], intrinsics (n, 12) fx, fy, cx, cy and lens terms,
    world (n, 3) [m].
    """
    xyz = np.einsum("nij,nj->ni", R, world - centre)
    z = np.where(xyz[:, 2:] > _NEAREST_DEPTH_M, xyz[:, 2:], np.nan)
    return intrinsics[:, :2] * _distort(xyz[:, :2] / z, intrinsics[:, 4:], is_fisheye) + intrinsics[:, 2:4]


def project_with_jacobian(
    R: Array, centre: Array, intrinsics: Array, *, is_fisheye: NDArray[np.bool_], world: Array
) -> tuple[Array, Array, Array]:
    """Return pixels (n, 2) and their derivatives by the camera's parameters (n, 2, 18) and the point (n, 2, 3).

    Arguments as in `project`. The parameters are `CAMERA_PARAMETERS`: a rotation about the camera's own axes,
    `R <- exp(rotation) R`, and steps of the others. Behind the camera the pixels are NaN and the derivatives 0.
    """
    xyz = np.einsum("nij,nj->ni", R, world - centre)
    is_seen = xyz[:, 2] > _NEAREST_DEPTH_M
    z = np.where(is_seen, xyz[:, 2], 1.0)
    xy = np.where(is_seen[:, None], xyz[:, :2], 0.0) / z[:, None]
    distorted = _distort(xy, intrinsics[:, 4:], is_fisheye)
    by_xy, by_terms = _lens_jacobian(xy, intrinsics[:, 4:], is_fisheye)
    to_plane = np.zeros((len(xy), 2, 3))  # d xy / d xyz
    to_plane[:, 0, 0] = to_plane[:, 1, 1] = 1 / z
    to_plane[:, :, 2] = -xy / z[:, None]
    by_xyz = intrinsics[:, :2, None] * (by_xy @ to_plane)
    by_world = by_xyz @ R
    jacobian = np.zeros((len(xy), 2, N_PARAMETERS))
    jacobian[:, :, :3] = -by_xyz @ cross_matrices(xyz)
    jacobian[:, :, 3:6] = -by_world
    jacobian[:, [0, 1], [6, 7]] = distorted
    jacobian[:, [0, 1], [8, 9]] = 1.0
    jacobian[:, :, 10:] = intrinsics[:, :2, None] * by_terms
    px = np.where(is_seen[:, None], intrinsics[:, :2] * distorted + intrinsics[:, 2:4], np.nan)
    return px, np.where(is_seen[:, None, None], jacobian, 0.0), np.where(is_seen[:, None, None], by_world, 0.0)


def cross_matrices(v: Array) -> Array:
    """Return the matrices (n, 3, 3) with `matrix @ w = v x w` for vectors v (n, 3)."""
    m = np.zeros((len(v), 3, 3))
    m[:, 2, 1], m[:, 0, 2], m[:, 1, 0] = v[:, 0], v[:, 1], v[:, 2]
    return m - np.swapaxes(m, 1, 2)


def left_jacobian(rotation: Array) -> Array:
    """Return the derivative (3, 3) of `exp(rotation)`'s own small rotation by the rotation vector (3,)."""
    angle, K = np.linalg.norm(rotation), cross_matrices(rotation[None])[0]
    if angle < 1e-6:
        return np.eye(3) + K / 2
    return np.eye(3) + (1 - np.cos(angle)) / angle**2 * K + (angle - np.sin(angle)) / angle**3 * K @ K


def project_by_camera(camera: Camera, world: Array) -> tuple[Array, Array, Array]:
    """Return one camera's pixels of points (n, 3) [m], and their derivatives as in `project_with_jacobian`."""
    n, R = len(world), camera.camera_from_world.rotation.as_matrix()
    return project_with_jacobian(
        np.broadcast_to(R, (n, 3, 3)),
        camera.centre,
        np.broadcast_to(intrinsics_of(camera), (n, 12)),
        is_fisheye=np.full(n, camera.lens == "fisheye"),
        world=world,
    )


def intrinsics_of(camera: Camera) -> Array:
    """Return a camera's fx, fy, cx, cy [px] and eight lens terms, 0 where its lens has fewer: (12,)."""
    K, terms = camera.K, np.pad(camera.distortion, (0, 8 - len(camera.distortion)))
    return np.array([K[0, 0], K[1, 1], K[0, 2], K[1, 2], *terms])


def _distort(xy: Array, terms: Array, is_fisheye: NDArray[np.bool_]) -> Array:
    distorted = distort(xy, terms.T)
    if is_fisheye.any():
        distorted[is_fisheye] = distort_fisheye(xy[is_fisheye], terms[is_fisheye, :4].T)
    return distorted


def _lens_jacobian(xy: Array, terms: Array, is_fisheye: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return the derivatives of the distorted points by the undistorted ones (n, 2, 2) and by the terms (n, 2, 8)."""
    by_xy, by_terms = _brown_jacobian(xy, terms)
    if is_fisheye.any():
        by_xy[is_fisheye], by_terms[is_fisheye] = _fisheye_jacobian(xy[is_fisheye], terms[is_fisheye])
    return by_xy, by_terms


def _brown_jacobian(xy: Array, terms: Array) -> tuple[Array, Array]:
    _, _, p1, p2, _, k4, k5, k6 = terms.T
    x, y = xy.T
    r2 = x * x + y * y
    radial, radial_derivative = radial_factor(r2, terms.T)
    by_xy = np.empty((len(xy), 2, 2))
    by_xy[:, 0, 0] = radial + x * x * radial_derivative + 2 * p1 * y + 6 * p2 * x
    by_xy[:, 1, 1] = radial + y * y * radial_derivative + 6 * p1 * y + 2 * p2 * x
    by_xy[:, 0, 1] = by_xy[:, 1, 0] = x * y * radial_derivative + 2 * p1 * x + 2 * p2 * y
    by_above = np.stack([r2, r2**2, r2**3], axis=-1) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))[:, None]
    by_terms = np.empty((len(xy), 2, 8))
    by_terms[:, :, [0, 1, 4]] = xy[:, :, None] * by_above[:, None]
    by_terms[:, :, 5:] = -radial[:, None, None] * by_terms[:, :, [0, 1, 4]]
    by_terms[:, 0, 2], by_terms[:, 0, 3] = 2 * x * y, r2 + 2 * x * x
    by_terms[:, 1, 2], by_terms[:, 1, 3] = r2 + 2 * y * y, 2 * x * y
    return by_xy, by_terms


def _fisheye_jacobian(xy: Array, terms: Array) -> tuple[Array, Array]:
    r = np.maximum(np.hypot(xy[:, 0], xy[:, 1]), 1e-8)
    angle = np.arctan(r)
    powers = angle[:, None] ** np.array([3, 5, 7, 9])
    radius = angle + np.einsum("nk,nk->n", terms[:, :4], powers)
    radius_derivative = 1 + np.einsum("nk,nk->n", terms[:, :4] * [3, 5, 7, 9], powers / angle[:, None])
    scale = radius / r
    scale_derivative = (radius_derivative / (1 + r * r) - scale) / r  # d scale / d r
    unit = xy / r[:, None]
    by_xy = (
        scale[:, None, None] * np.eye(2) + (scale_derivative * r)[:, None, None] * unit[:, :, None] * unit[:, None, :]
    )
    by_terms = np.zeros((len(xy), 2, 8))
    by_terms[:, :, :4] = unit[:, :, None] * powers[:, None, :]
    return by_xy, by_terms
