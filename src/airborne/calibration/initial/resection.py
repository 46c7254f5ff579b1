"""A camera whose place is wrong, put where the points that the other cameras agree on say that it stands.

Its intrinsics are kept; position and rotation are a robust least-squares fit of the reprojection (Cauchy loss), begun
from the camera as it is and from a perspective-n-point solution. What a network takes for a hip or an elbow errs
steadily, so every point counts alike, however often it is seen, and the points' mean residuals, not the frames', say
how well the place is known. The face is left out: seen from behind it is guessed.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.cameras.camera import Camera, Rig
from airborne.cameras.consensus import OUTLIER_SHARE, triangulate_consensus, triangulate_views
from airborne.cameras.detections import Detections
from airborne.errors import CalibrationError
from airborne.types import Array

LEAST_RESECTION_VISIBILITY = 0.6  # detections less sure do not move a camera
_FEWEST_DETECTIONS = 50  # detections that a camera is placed by
_THINNEST_M = 0.05  # second largest spread of the points: on one line they leave the camera free to turn about it
_MOST_FRAMES = 300  # spread over the recording; more do not make a place better
_SCALE_PX = 5.0  # residuals much beyond this count ever less
_FACE = ("nose", "eye", "inner_eye", "outer_eye", "mouth")  # without the side
MISPLACED_PX = 10.0  # median distance that calls for mending ...
_MOST_LEFT_SHARE = 0.5  # ... where a better place leaves less than this share of it


@dataclass(frozen=True, slots=True, eq=False)
class Resection:
    """A camera in its new place, and what that changed."""

    camera: Camera
    n_detections: int
    before_px: float  # median distance of the detections from the points, camera as it was [px]
    after_px: float  # the same, camera as it is now [px]
    shift_m: float  # how far the camera's centre moved [m]
    shift_sd_m: float  # how well its new place is known, along the least certain direction [m]
    rotation_rad: float  # how far it turned [rad]

    def describe(self) -> str:
        """Say in one line what was done and what it brought."""
        return (
            f"{self.camera.name}: moved by {self.shift_m:.3f} m (sd {self.shift_sd_m:.3f}) and "
            f"{np.degrees(self.rotation_rad):.2f} degrees to agree with the other cameras: median of "
            f"{self.n_detections} detections {self.before_px:.1f} px off before, {self.after_px:.1f} px after"
        )


def resect_cameras(rig: Rig, detections: Detections, names: Sequence[str]) -> tuple[Rig, tuple[Resection, ...]]:
    """Place the named cameras anew by the points that the others agree on.

    The detections are of one moment a row, in any order of cameras. Raises CalibrationError where fewer than two other
    cameras are left, or where too few points are seen to place a camera.
    """
    for name in names:
        _ = rig[name]
    others = rig.select([name for name in rig.names if name not in names])
    if len(others) < 2:
        raise CalibrationError(
            f"mend = [{', '.join(names)}] leaves {len(others)} of {len(rig)} cameras; "
            "two others at least must say where the points are"
        )
    sure = sample_moments(detections).above_visibility(LEAST_RESECTION_VISIBILITY)
    seen = sure.select(others.names)
    points = triangulate_consensus(others, seen.px, seen.visibility).points
    done = tuple(resect(rig[name], points, sure.select([name]).px[:, :, 0]) for name in names)
    moved = {mending.camera.name: mending.camera for mending in done}
    return Rig(tuple(moved.get(camera.name, camera) for camera in rig)), done


def resect(camera: Camera, points: Array, px: Array) -> Resection:
    """Place a camera by world points (frames, n, 3) [m] and where it sees them (frames, n, 2) [px]; NaN where not.

    `shift_sd_px` of the new camera is what the points' own steady errors leave open: each of the n points keeps its
    mean residual over the frames, and so many independent ones average out. Raises CalibrationError.
    """
    ideal = camera.undistort_px(px)
    known = np.asarray(np.isfinite(np.concatenate([points, ideal], axis=-1)).all(axis=-1))
    xyz, uv = points[known], ideal[known]
    spread = float(np.sqrt(max(np.linalg.eigvalsh(np.cov(xyz.T))[1], 0.0))) if len(xyz) > 2 else 0.0
    if len(xyz) < _FEWEST_DETECTIONS or spread < _THINNEST_M:
        raise CalibrationError(
            f"camera '{camera.name}': {len(xyz)} detections of points that the other cameras agree on, "
            f"{spread:.2f} m wide; expected {_FEWEST_DETECTIONS} and {_THINNEST_M} m at least, so leave it out of mend"
        )
    straight = camera.without_distortion()
    weights = (np.ones(known.shape) / np.maximum(known.sum(axis=0), 1))[known]
    starts = [camera.camera_from_world, *_perspective_n_point(straight, xyz, uv)]
    place, jacobian = min((_fit_pose(straight, start, xyz, uv, weights) for start in starts), key=lambda fit: fit[0])[
        1:
    ]
    new = replace(camera, camera_from_world=place)
    residual = np.where(known[..., None], px - new.px_from_world(points), np.nan)
    steady_px = _systematic_error_px(residual)
    information = np.einsum("nij,n,nik->jk", jacobian, weights, jacobian) / steady_px**2
    turn = place.rotation * camera.camera_from_world.rotation.inv()
    return Resection(
        camera=replace(new, shift_sd_px=steady_px / np.sqrt(known.any(axis=0).sum())),
        n_detections=len(xyz),
        before_px=_median(np.linalg.norm(px[known] - camera.px_from_world(xyz), axis=-1)),
        after_px=_median(np.linalg.norm(residual[known], axis=-1)),
        shift_m=float(np.linalg.norm(new.centre - camera.centre)),
        shift_sd_m=float(np.sqrt(np.linalg.eigvalsh(np.linalg.inv(information)[:3, :3])[-1])),
        rotation_rad=float(turn.magnitude()),
    )


def find_misplaced_cameras(rig: Rig, detections: Detections) -> tuple[Resection, ...]:
    """Find the cameras that stand elsewhere than they say, and what mending would bring; the rig stays as it is.

    The camera goes first without which the others agree best. It is found to be wrong where half of its detections lie
    over WRONG_PX from the others' points and where another place would leave less than the share MENDABLE of that:
    scattered detections cannot be mended so. Two cameras alone cannot say which of them is wrong.
    """
    sure = sample_moments(detections).above_visibility(LEAST_RESECTION_VISIBILITY).select(rig.names)
    weights, trusted, found = sure.visibility, list(rig.names), []
    while len(trusted) > 2:
        rest_px, points = {}, {}
        for name in trusted:
            used = (weights > 0) & np.isin(rig.names, [other for other in trusted if other != name])
            points[name], distance = triangulate_views(rig, sure.px, weights, used)
            rest_px[name] = _median(distance[used])
        worst = min(rest_px, key=rest_px.__getitem__)
        try:
            mending = resect(rig[worst], points[worst], sure.px[:, :, rig.names.index(worst)])
        except CalibrationError:
            break
        if mending.before_px < MISPLACED_PX or mending.after_px > _MOST_LEFT_SHARE * mending.before_px:
            break
        found.append(mending)
        trusted.remove(worst)
    return tuple(found)


def sample_moments(detections: Detections) -> Detections:
    """Return at most MOST_FRAMES moments, evenly spread, without the face."""
    n = len(detections.px)
    rows = np.unique(np.linspace(0, n - 1, min(n, _MOST_FRAMES)).astype(int))
    kept = [i for i, name in enumerate(detections.points) if re.sub("_(left|right)$", "", name) not in _FACE]
    return replace(
        detections,
        points=tuple(detections.points[i] for i in kept),
        px=detections.px[rows][:, kept],
        visibility=detections.visibility[rows][:, kept],
    )


def _perspective_n_point(camera: Camera, xyz: Array, uv: Array) -> list[RigidTransform]:
    """Return the place by RANSAC over minimal sets of points, if one is found; `camera` has no distortion."""
    cv2.setRNGSeed(0)
    limit_px = OUTLIER_SHARE * max(camera.size)
    found, rotvec, translation, _ = cv2.solvePnPRansac(
        xyz, uv, camera.K, None, reprojectionError=limit_px, flags=cv2.SOLVEPNP_EPNP
    )
    if not found or not np.all(np.isfinite([rotvec, translation])):
        return []
    return [RigidTransform.from_components(translation.ravel(), Rotation.from_rotvec(rotvec.ravel()))]


def _fit_pose(
    camera: Camera, start: RigidTransform, xyz: Array, uv: Array, weights: Array
) -> tuple[float, RigidTransform, Array]:
    """Return the cost, the place that fits best near a start, and the residuals' derivative (n, 2, 6) there.

    The six are a shift of the camera's centre [m] and a turn about it [rad]; `camera` has no distortion.
    """
    centre = start.inv().translation

    def place(step: Array) -> RigidTransform:
        rotation = Rotation.from_rotvec(step[3:]) * start.rotation
        return RigidTransform.from_components(-rotation.apply(centre + step[:3]), rotation)

    def residual(step: Array) -> Array:
        projected = replace(camera, camera_from_world=place(step)).px_from_world(xyz)
        return np.nan_to_num(uv - projected, nan=float(max(camera.size))).ravel()  # behind the camera

    both = np.repeat(weights, 2)

    def cauchy(z: Array) -> Array:
        return np.stack([np.log1p(z), 1 / (1 + z), -1 / (1 + z) ** 2]) * both

    fit = least_squares(residual, np.zeros(6), loss=cauchy, f_scale=_SCALE_PX)  # pyright: ignore[reportArgumentType]
    steps = 1e-6 * np.eye(6)
    slopes = [(residual(fit.x + step) - residual(fit.x - step)) / 2e-6 for step in steps]
    return float(fit.cost), place(fit.x), np.stack(slopes, axis=-1).reshape(-1, 2, 6)


def _systematic_error_px(residual: Array) -> float:
    """Return how far, right or down, the points' mean residuals lie from zero; residual (frames, points, 2) [px]."""
    counts = np.isfinite(residual[..., 0]).sum(axis=0)
    means = np.nansum(residual, axis=0)[counts > 0] / counts[counts > 0, None]
    return float(np.sqrt(np.mean(means**2)))


def _median(values: Array) -> float:
    values = values[np.isfinite(values)]
    return float(np.median(values)) if values.size else np.inf
