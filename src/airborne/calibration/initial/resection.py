"""Resection of a misplaced camera: its pose from the points that the other cameras agree on.

Its intrinsics stay; the pose minimises the reprojection error robustly (Cauchy loss), starting from the camera as it is
and from a perspective-n-point solution. A network's hip or elbow has a systematic error, so every point has the same
weight, however often it is seen, and the uncertainty follows from the points' mean residuals, not the frames'. The face
is left out: seen from behind it is guessed.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import cv2
import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.cameras.camera import Camera, Rig
from airborne.cameras.consensus import OUTLIER_SHARE, triangulate_consensus, triangulate_views
from airborne.cameras.detections import Detections
from airborne.cameras.finding import Finding, join_names
from airborne.errors import CalibrationError
from airborne.types import Array

LEAST_RESECTION_VISIBILITY = 0.6  # detections below it are not used
_FEWEST_DETECTIONS = 50  # detections that determine a pose
_THINNEST_M = 0.05  # second largest standard deviation of the points: points on one line leave a rotation free
_MOST_FRAMES = 300  # spread over the recording; more do not improve the pose
_SCALE_PX = 5.0  # of the Cauchy loss
_FACE = ("nose", "eye", "inner_eye", "outer_eye", "mouth")  # without the side
MISPLACED_PX = 10.0  # median distance of a misplaced camera ...
_MOST_LEFT_SHARE = 0.5  # ... if resection leaves less than this share of it
# chosen: share of the distance that is left at most once two cameras' detections are exchanged back. Of a man on a beam
# it is 0.12 and 0.17; exchanged though they are right, distances grow fivefold or more
_MOST_LEFT_EXCHANGED = 0.4


@dataclass(frozen=True, slots=True, eq=False)
class Resection:
    """A camera in its new pose, and what that changed."""

    camera: Camera
    n_detections: int
    before_px: float  # median distance of the detections from the points, camera as it was [px]
    after_px: float  # the same, camera as it is now [px]
    shift_m: float  # how far the camera's centre moved [m]
    shift_sd_m: float  # standard deviation of its new position, in the least certain direction [m]
    rotation_rad: float  # how far it rotated [rad]

    def describe(self) -> str:
        """Say in one line what was done and what it improved."""
        return (
            f"{self.camera.name}: moved by {self.shift_m:.3f} m (sd {self.shift_sd_m:.3f}) and "
            f"{np.degrees(self.rotation_rad):.2f} degrees to agree with the other cameras: median of "
            f"{self.n_detections} detections {self.before_px:.1f} px off before, {self.after_px:.1f} px after"
        )


def resect_cameras(rig: Rig, detections: Detections, names: Sequence[str]) -> tuple[Rig, tuple[Resection, ...]]:
    """Resect the named cameras from the points that the others agree on.

    The detections are of one moment a row, in any order of cameras. Raises CalibrationError where fewer than two other
    cameras are left, or where a camera sees too few points.
    """
    for name in names:
        _ = rig[name]
    others = rig.select([name for name in rig.names if name not in names])
    if len(others) < 2:
        raise CalibrationError(
            f"mend = [{', '.join(names)}] leaves {len(others)} of {len(rig)} cameras; "
            "two others at least must say where the points are"
        )
    detections_above = sample_moments(detections).above_visibility(LEAST_RESECTION_VISIBILITY)
    visible = detections_above.select(others.names)
    points = triangulate_consensus(others, visible.px, visible.visibility).points
    resections = tuple(resect(rig[name], points, detections_above.select([name]).px[:, :, 0]) for name in names)
    for each in resections:
        if each.after_px > OUTLIER_SHARE * max(each.camera.size):
            raise CalibrationError(
                f"camera '{each.camera.name}' cannot be mended: wherever it stands, half of its {each.n_detections} "
                f"detections lie over {each.after_px:.0f} px from where the others see the points; check that all "
                "detections and calibrations are of the cameras that they name, and that all clocks agree"
            )
    resected = {resection.camera.name: resection.camera for resection in resections}
    return Rig(tuple(resected.get(camera.name, camera) for camera in rig)), resections


def resect(camera: Camera, points: Array, px: Array) -> Resection:
    """Estimate a camera's pose from world points (frames, n, 3) [m] and their pixels (frames, n, 2) [px], with NaN.

    `shift_sd_px` of the new camera follows from the points' systematic errors: each of the n points has its own mean
    residual over the frames, and n independent ones average out. Raises CalibrationError.
    """
    ideal = camera.undistort_px(px)
    is_valid = np.asarray(np.isfinite(np.concatenate([points, ideal], axis=-1)).all(axis=-1))
    xyz, uv = points[is_valid], ideal[is_valid]
    spread = float(np.sqrt(max(np.linalg.eigvalsh(np.cov(xyz.T))[1], 0.0))) if len(xyz) > 2 else 0.0
    if len(xyz) < _FEWEST_DETECTIONS or spread < _THINNEST_M:
        raise CalibrationError(
            f"camera '{camera.name}': {len(xyz)} detections of points that the other cameras agree on, "
            f"{spread:.2f} m wide; expected {_FEWEST_DETECTIONS} and {_THINNEST_M} m at least, so leave it out of mend"
        )
    pinhole = camera.without_distortion()
    weights = (np.ones(is_valid.shape) / np.maximum(is_valid.sum(axis=0), 1))[is_valid]
    initial_poses = [camera.camera_from_world, *_perspective_n_point(pinhole, xyz, uv)]
    pose, jacobian = min(
        (_fit_pose(pinhole, initial, xyz=xyz, uv=uv, weights=weights) for initial in initial_poses),
        key=lambda fit: fit[0],
    )[1:]
    resected = replace(camera, camera_from_world=pose, covariance=None)
    residual = np.where(is_valid[..., None], px - resected.px_from_world(points), np.nan)
    systematic_px = _systematic_error_px(residual)
    information = np.einsum("nij,n,nik->jk", jacobian, weights, jacobian) / systematic_px**2
    rotation = pose.rotation * camera.camera_from_world.rotation.inv()
    return Resection(
        camera=replace(resected, shift_sd_px=systematic_px / np.sqrt(is_valid.any(axis=0).sum())),
        n_detections=len(xyz),
        before_px=_median(np.linalg.norm(px[is_valid] - camera.px_from_world(xyz), axis=-1)),
        after_px=_median(np.linalg.norm(residual[is_valid], axis=-1)),
        shift_m=float(np.linalg.norm(resected.centre - camera.centre)),
        shift_sd_m=float(np.sqrt(np.linalg.eigvalsh(np.linalg.inv(information)[:3, :3])[-1])),
        rotation_rad=float(rotation.magnitude()),
    )


def find_misplaced_cameras(rig: Rig, detections: Detections) -> tuple[Resection, ...]:
    """Find the cameras that are misplaced, and what resection would improve; the rig itself does not change.

    Tested first is the camera without which the others agree best. It is misplaced if half of its detections lie over
    MISPLACED_PX from the others' points and resection leaves less than _MOST_LEFT_SHARE of that distance: resection
    does not help against scattered detections. Two cameras alone cannot say which of them is wrong.
    """
    confident = sample_moments(detections).above_visibility(LEAST_RESECTION_VISIBILITY).select(rig.names)
    weights, trusted, misplaced = confident.visibility, list(rig.names), []
    while len(trusted) > 2:
        misfit_px, points = {}, {}
        for name in trusted:
            is_used = (weights > 0) & np.isin(rig.names, [other for other in trusted if other != name])
            points[name], distance = triangulate_views(rig, confident.px, weights, is_used)
            misfit_px[name] = _median(distance[is_used])
        worst = min(misfit_px, key=misfit_px.__getitem__)
        try:
            resection = resect(rig[worst], points[worst], confident.px[:, :, rig.names.index(worst)])
        except CalibrationError:
            break
        if resection.before_px < MISPLACED_PX or resection.after_px > _MOST_LEFT_SHARE * resection.before_px:
            break
        misplaced.append(resection)
        trusted.remove(worst)
    return tuple(misplaced)


def find_exchanged_detections(rig: Rig, detections: Detections) -> Finding | None:
    """Find two cameras with each other's detections: exchanged, all cameras agree far better; None if there are none.

    The detections are of one moment a row, in any order of cameras.
    """
    confident = sample_moments(detections).above_visibility(LEAST_RESECTION_VISIBILITY).select(rig.names)

    def misfit_px(order: Sequence[int]) -> float:
        weights = confident.visibility[:, :, order]
        distance = triangulate_views(rig, confident.px[:, :, order], weights, weights > 0)[1]
        return _median(distance[weights > 0])

    columns = list(range(len(rig)))
    own_px = misfit_px(columns)
    if not own_px > MISPLACED_PX:
        return None
    exchanged = {}
    for first, second in combinations(columns, 2):
        order = [{first: second, second: first}.get(column, column) for column in columns]
        exchanged[first, second] = misfit_px(order)
    pair = min(exchanged, key=exchanged.__getitem__)
    if not exchanged[pair] < _MOST_LEFT_EXCHANGED * own_px:
        return None
    cameras = tuple(rig.names[column] for column in pair)
    return Finding(
        kind="swapped",
        what=f"they lie {own_px:.0f} px from where all cameras together see the points, {exchanged[pair]:.0f} px once "
        f"those of {join_names(cameras)} are exchanged",
        advice="these two, or their calibrations, are exchanged; exchange them back, or say whose they are with "
        "detections_cameras",
        cameras=cameras,
    )


def sample_moments(detections: Detections) -> Detections:
    """Return at most _MOST_FRAMES moments, evenly spaced, without the face."""
    n = len(detections.px)
    rows = np.unique(np.linspace(0, n - 1, min(n, _MOST_FRAMES)).astype(int))
    columns = [i for i, name in enumerate(detections.points) if re.sub("_(left|right)$", "", name) not in _FACE]
    return replace(
        detections,
        points=tuple(detections.points[i] for i in columns),
        px=detections.px[rows][:, columns],
        visibility=detections.visibility[rows][:, columns],
    )


def _perspective_n_point(camera: Camera, xyz: Array, uv: Array) -> list[RigidTransform]:
    """Return the pose by RANSAC over minimal sets of points, if one fits; `camera` has no distortion."""
    cv2.setRNGSeed(0)
    limit_px = OUTLIER_SHARE * max(camera.size)
    is_solved, rotvec, translation, _ = cv2.solvePnPRansac(
        xyz, uv, camera.K, None, reprojectionError=limit_px, flags=cv2.SOLVEPNP_EPNP
    )
    if not is_solved or not np.all(np.isfinite([rotvec, translation])):
        return []
    return [RigidTransform.from_components(translation.ravel(), Rotation.from_rotvec(rotvec.ravel()))]


def _fit_pose(
    camera: Camera, initial: RigidTransform, *, xyz: Array, uv: Array, weights: Array
) -> tuple[float, RigidTransform, Array]:
    """Return the cost, the pose that fits best near the initial one, and the residuals' Jacobian (n, 2, 6) there.

    The six are a shift of the camera's centre [m] and a rotation about it [rad]; `camera` has no distortion.
    """
    centre = initial.inv().translation

    def pose_at(step: Array) -> RigidTransform:
        rotation = Rotation.from_rotvec(step[3:]) * initial.rotation
        return RigidTransform.from_components(-rotation.apply(centre + step[:3]), rotation)

    def residual(step: Array) -> Array:
        projected = replace(camera, camera_from_world=pose_at(step)).px_from_world(xyz)
        return np.nan_to_num(uv - projected, nan=float(max(camera.size))).ravel()  # behind the camera

    row_weights = np.repeat(weights, 2)

    def cauchy(z: Array) -> Array:
        return np.stack([np.log1p(z), 1 / (1 + z), -1 / (1 + z) ** 2]) * row_weights

    fit = least_squares(residual, np.zeros(6), loss=cauchy, f_scale=_SCALE_PX)  # pyright: ignore[reportArgumentType]
    steps = 1e-6 * np.eye(6)
    columns = [(residual(fit.x + step) - residual(fit.x - step)) / 2e-6 for step in steps]
    return float(fit.cost), pose_at(fit.x), np.stack(columns, axis=-1).reshape(-1, 2, 6)


def _systematic_error_px(residual: Array) -> float:
    """Return the RMS coordinate of the points' mean residuals; residual (frames, points, 2) [px]."""
    counts = np.isfinite(residual[..., 0]).sum(axis=0)
    means = np.nansum(residual, axis=0)[counts > 0] / counts[counts > 0, None]
    return float(np.sqrt(np.mean(means**2)))


def _median(values: Array) -> float:
    values = values[np.isfinite(values)]
    return float(np.median(values)) if values.size else np.inf
