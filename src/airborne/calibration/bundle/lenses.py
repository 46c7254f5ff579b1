"""Projection and its Jacobian, for cameras of both lens models, as arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airborne.cameras.camera import Camera
from airborne.cameras.distortion import distort, distort_fisheye
from airborne.kernels import kernel
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
    n = len(world)
    shapes = (n, 3, 3), (n, 3), (n, 12), (n, 3)
    arrays = [  # copies, as the kernel is compiled once more for arrays that cannot be written
        np.array(np.broadcast_to(each, shape), np.float64, order="C")
        for each, shape in zip((R, centre, intrinsics, world), shapes, strict=True)
    ]
    return _linearise(*arrays, np.ascontiguousarray(is_fisheye))


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


@kernel
def _linearise(R, centre, intrinsics, world, is_fisheye):
    """Return pixels and derivatives as `project_with_jacobian`."""
    n = len(world)
    px, by_camera, by_world = np.empty((n, 2)), np.zeros((n, 2, N_PARAMETERS)), np.zeros((n, 2, 3))
    xyz, distorted, by_xy, by_terms, by_xyz = np.empty(3), np.empty(2), np.empty((2, 2)), np.empty((2, 8)), np.empty(3)
    for k in range(n):
        for i in range(3):
            xyz[i] = 0.0
            for j in range(3):
                xyz[i] += R[k, i, j] * (world[k, j] - centre[k, j])
        if xyz[2] <= _NEAREST_DEPTH_M:
            px[k, 0] = px[k, 1] = np.nan
            continue
        x, y = xyz[0] / xyz[2], xyz[1] / xyz[2]
        if is_fisheye[k]:
            _distort_fisheye(x, y, intrinsics[k, 4:], distorted, by_xy, by_terms)
        else:
            _distort_brown(x, y, intrinsics[k, 4:], distorted, by_xy, by_terms)
        for i in range(2):
            f, of_image = intrinsics[k, i], by_camera[k, i]
            px[k, i] = f * distorted[i] + intrinsics[k, 2 + i]
            by_xyz[0], by_xyz[1] = f * by_xy[i, 0] / xyz[2], f * by_xy[i, 1] / xyz[2]
            by_xyz[2] = -(x * by_xyz[0] + y * by_xyz[1])
            for j in range(3):  # by a rotation: xyz x by_xyz
                one, two = (j + 1) % 3, (j + 2) % 3
                of_image[j] = xyz[one] * by_xyz[two] - xyz[two] * by_xyz[one]
            for j in range(3):
                by_world[k, i, j] = by_xyz[0] * R[k, 0, j] + by_xyz[1] * R[k, 1, j] + by_xyz[2] * R[k, 2, j]
                of_image[3 + j] = -by_world[k, i, j]
            of_image[6 + i], of_image[8 + i] = distorted[i], 1.0
            for j in range(8):
                of_image[10 + j] = f * by_terms[i, j]
    return px, by_camera, by_world


@kernel(is_inner=True)
def _distort_brown(x, y, terms, distorted, by_xy, by_terms):
    """Fill in a distorted point (2,), its derivatives by the point (2, 2) and by the terms (2, 8)."""
    k1, k2, p1, p2, k3, k4, k5, k6 = terms[0], terms[1], terms[2], terms[3], terms[4], terms[5], terms[6], terms[7]
    r2 = x * x + y * y
    below = 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / below
    slope = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3)) - radial * 2 * (k4 + r2 * (2 * k5 + r2 * 3 * k6))
    slope /= below
    distorted[0] = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    distorted[1] = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    by_xy[0, 0] = radial + x * x * slope + 2 * p1 * y + 6 * p2 * x
    by_xy[1, 1] = radial + y * y * slope + 6 * p1 * y + 2 * p2 * x
    by_xy[0, 1] = by_xy[1, 0] = x * y * slope + 2 * p1 * x + 2 * p2 * y
    for i, at in ((0, x), (1, y)):
        power = at / below
        for j in range(3):
            power *= r2
            by_terms[i, 4 if j == 2 else j], by_terms[i, 5 + j] = power, -radial * power
    by_terms[0, 2], by_terms[0, 3] = 2 * x * y, r2 + 2 * x * x
    by_terms[1, 2], by_terms[1, 3] = r2 + 2 * y * y, 2 * x * y


@kernel(is_inner=True)
def _distort_fisheye(x, y, terms, distorted, by_xy, by_terms):
    """Fill in the same of a fisheye lens, which has four terms."""
    r = max(np.sqrt(x * x + y * y), 1e-8)
    angle, by_terms[:] = np.arctan(r), 0.0
    radius, radius_slope, power = angle, 1.0, angle
    for j in range(4):
        power *= angle * angle
        radius += terms[j] * power
        radius_slope += (3 + 2 * j) * terms[j] * power / angle
        by_terms[0, j], by_terms[1, j] = x / r * power, y / r * power
    scale = radius / r
    slope = radius_slope / (1 + r * r) - scale  # of the scale by r, times r
    distorted[0], distorted[1] = scale * x, scale * y
    by_xy[0, 0], by_xy[1, 1] = scale + slope * (x / r) ** 2, scale + slope * (y / r) ** 2
    by_xy[0, 1] = by_xy[1, 0] = slope * (x / r) * (y / r)
