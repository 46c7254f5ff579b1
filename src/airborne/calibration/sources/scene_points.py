"""Known points of the scene, court or survey: as a source, and for initial values of each camera.

Initial values need four points a camera, which may all lie on the floor, and no focal length: the best of a range of
focal lengths is taken.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace

import cv2
import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration.bundle.lenses import cross_matrices, left_jacobian, project_by_camera
from airborne.calibration.bundle.source import Lengths, Source
from airborne.calibration.sources.control_points import ControlPoints
from airborne.cameras.camera import Camera, Rig
from airborne.types import Array

_N_POINTS = 4  # of a resection
_FOCAL_RATIOS = np.geomspace(0.4, 5.0, 14)  # focal length over the image's longer side
_SCALE_PX = 3.0  # of the Cauchy loss
_FAR_M = 1000.0  # of an anchor: so far off that its distance changes with one coordinate only
_EXACT_SD_M = 1e-6  # a point measured better than this stays fixed
_LARGEST_LOG_CHANGE = 5.0  # bound of a step of the focal length's logarithm


def initial_rig_from_points(
    points: ControlPoints,
    sizes: Mapping[str, tuple[int, int]],
    lenses: Mapping[str, Camera] | None = None,
    *,
    fisheyes: Collection[str] = (),
) -> Rig:
    """Return initial values of every camera that sees four known points or more.

    lenses: cameras whose K and distortion are known; the others are pinholes, or `fisheyes` without terms, with the
    principal point in the image's middle. Robust against a few wrong clicks. Cameras with too few points are left out.
    """
    cameras = []
    for i, name in enumerate(points.cameras):
        is_seen = points.is_seen_by(name)
        if is_seen.sum() >= _N_POINTS:
            lens = (lenses or {}).get(name)
            guesses = [lens] if lens is not None else _focal_guesses(name, sizes[name], is_fisheye=name in fisheyes)
            cameras.append(
                _best_camera(guesses, points.world[is_seen], points.px[is_seen, i], is_lens_known=lens is not None)
            )
    return Rig(tuple(camera for camera in cameras if camera is not None))


def scene_source(rig_names: Sequence[str], points: ControlPoints, *, name: str) -> Source:
    """Return known points as a source; coordinates with a standard deviation (`sd_m`) are free within it.

    A length ties a free coordinate to an anchor: a known point far off along that axis.
    """
    columns = [(i, rig_names.index(camera)) for i, camera in enumerate(points.cameras) if camera in rig_names]
    row, column = np.nonzero(np.isfinite(points.px[:, [i for i, _ in columns]]).all(axis=-1))
    seen_points, number = np.unique(row, return_inverse=True)  # without points that no camera sees
    world = points.world[seen_points]
    sd_m = np.zeros(world.shape) if points.sd_m is None else points.sd_m[seen_points]
    is_free = sd_m > _EXACT_SD_M
    point, axis = np.nonzero(is_free)
    anchors = world[point] + _FAR_M * np.eye(3)[axis]
    ties = Lengths(
        first=point,
        second=len(world) + np.arange(len(point)),
        length_m=np.full(len(point), _FAR_M),
        sd_m=sd_m[point, axis],
    )
    return Source(
        name=name,
        camera=np.array([r for _, r in columns], int)[column],
        point=number,
        px=points.px[row, np.array([i for i, _ in columns], int)[column]],
        points=np.concatenate([world, anchors]),
        is_free=np.concatenate([is_free, np.zeros(anchors.shape, bool)]) if len(anchors) else None,
        lengths=ties if len(anchors) else None,
        is_surveyed=True,
    )


def _focal_guesses(name: str, size: tuple[int, int], *, is_fisheye: bool) -> list[Camera]:
    middle = (np.array(size) - 1) / 2
    focals = _FOCAL_RATIOS * max(size)
    return [
        Camera(
            name=name,
            K=np.array([[f, 0, middle[0]], [0, f, middle[1]], [0, 0, 1]]),
            size=size,
            camera_from_world=RigidTransform.identity(),
            distortion=np.zeros(4 if is_fisheye else 5),
            lens="fisheye" if is_fisheye else "brown",
        )
        for f in focals
    ]


def _best_camera(guesses: Sequence[Camera], world: Array, px: Array, *, is_lens_known: bool) -> Camera | None:
    """Resect every guess from points (n, 3) [m] and their pixels (n, 2), refine the best three, return the best."""
    candidates = [camera for guess in guesses for camera in _resect_by_points(guess, world, px)]
    if not candidates:
        return None
    best = sorted(candidates, key=lambda camera: _misfit(camera, world, px))[:3]
    refined = [_refine_camera(camera, world, px, is_focal_free=not is_lens_known) for camera in best]
    return min(refined, key=lambda camera: _misfit(camera, world, px))


def _resect_by_points(camera: Camera, world: Array, px: Array) -> Iterator[Camera]:
    ideal = camera.undistort_px(px)
    is_usable = np.isfinite(ideal).all(axis=1)
    if is_usable.sum() < _N_POINTS:
        return
    xyz, uv = world[is_usable], ideal[is_usable]
    cv2.setRNGSeed(0)
    solutions = [cv2.solvePnPGeneric(xyz, uv, camera.K, None, flags=cv2.SOLVEPNP_SQPNP)[1:3]]
    if len(xyz) > _N_POINTS:
        limit = 0.01 * max(camera.size)
        is_solved, rotvec, t, _ = cv2.solvePnPRansac(
            xyz, uv, camera.K, None, reprojectionError=limit, iterationsCount=200, flags=cv2.SOLVEPNP_SQPNP
        )
        solutions.append(([rotvec], [t]) if is_solved else ([], []))
    for rotvecs, translations in solutions:
        for rotvec, t in zip(rotvecs, translations, strict=True):
            if np.all(np.isfinite([rotvec, t])):
                pose = RigidTransform.from_components(t.ravel(), Rotation.from_rotvec(rotvec.ravel()))
                yield replace(camera, camera_from_world=pose)


def _misfit(camera: Camera, world: Array, px: Array) -> float:
    """Return the mean Cauchy loss; points behind the camera have a large residual."""
    return float(np.mean(np.log1p(np.sum((_residual(camera, world, px) / _SCALE_PX) ** 2, axis=1))))


def _residual(camera: Camera, world: Array, px: Array) -> Array:
    return np.nan_to_num(px - camera.px_from_world(world), nan=float(max(camera.size)))


def _refine_camera(camera: Camera, world: Array, px: Array, *, is_focal_free: bool) -> Camera:
    """Refine the pose, and the focal length if it is free, by robust least squares."""
    n_free = 7 if is_focal_free and 2 * len(world) >= 7 else 6

    def residual(step: Array) -> Array:
        return (_residual(step_camera(camera, step), world, px) / _SCALE_PX).ravel()

    def jacobian(step: Array) -> Array:
        return -step_jacobian(step_camera(camera, step), step, world)[:, :n_free] / _SCALE_PX

    fit = least_squares(
        residual,
        np.zeros(n_free),
        jacobian,  # pyright: ignore[reportArgumentType]
        loss="cauchy",
        x_scale="jac",
        max_nfev=100,
    )
    return min((camera, step_camera(camera, fit.x)), key=lambda each: _misfit(each, world, px))


def step_camera(camera: Camera, step: Array) -> Camera:
    """Return the camera after a step (6 or 7,): a rotation vector [rad] and a shift of the points in its axes [m].

    The seventh is a change of the focal length's logarithm.
    """
    pose_step = RigidTransform.from_components(step[3:6], Rotation.from_rotvec(step[:3]))
    K = camera.K.copy()
    K[[0, 1], [0, 1]] *= np.exp(np.clip(step[6:7].sum(), -_LARGEST_LOG_CHANGE, _LARGEST_LOG_CHANGE))
    return replace(camera, K=K, camera_from_world=pose_step * camera.camera_from_world)


def step_jacobian(camera: Camera, step: Array, world: Array) -> Array:
    """Return the derivatives (2 n, 7) of the pixels of points (n, 3) [m] by the step that led to the camera."""
    pose = camera.camera_from_world
    _, by_camera, by_world = project_by_camera(camera, world)
    by_xyz = by_world @ pose.rotation.as_matrix().T
    rotated = pose.apply(world) - step[3:6]
    by_focal = by_camera[:, :, 6:8] @ np.diag(camera.K)[:2, None]
    by_step = [-by_xyz @ cross_matrices(rotated) @ left_jacobian(step[:3]), by_xyz, by_focal]
    return np.concatenate(by_step, axis=2).reshape(2 * len(world), 7)
