"""Checks of images: mirrored, rotated, of another size, exchanged between cameras."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np

from airborne.cameras.camera import Rig
from airborne.cameras.dlt import decompose, fit_dlt
from airborne.cameras.finding import Finding, join_names
from airborne.geometry.triangulation import px_from_points
from airborne.types import Array

_LIMIT_SHARE = 0.01  # of an image's longer side: the largest error of a mirrored fit
_FEWEST_POINTS = 15  # of a mirrored fit
_INLIER_SHARE, _N_TRIMS = 0.8, 10  # share of the points that must fit; rounds of trimming
_FAR_PX = 1e6  # distance of points behind a camera
_MOST_ROLL = np.radians(60)  # about the optical axis: cameras stand roughly upright
_STEEPEST = np.radians(70)  # a camera that looks further up or down has no roll
_SWAPPED_PX, _SWAPPED_SHARE = 8.0, 0.4  # least median distance, and the most that exchanging may leave of it
_MOST_POINTS = 500  # evenly spaced, that are compared
_SAME_SHAPE = 0.01  # relative difference of two ratios of width to height


def check_mirroring(camera: str, size: tuple[int, int], points: Array, px: Array) -> list[Finding]:
    """Report a camera whose px (n, 2) of points (n, 3) [m], triangulated by other cameras, fit only when mirrored.

    By the direct linear transformation, which needs no focal length and may come out left-handed; trimmed, so a fifth
    of the points may be outliers.
    """
    is_valid = np.isfinite(points).all(axis=1) & np.isfinite(px).all(axis=1)
    xyz, uv = points[is_valid], px[is_valid]
    if len(xyz) < _FEWEST_POINTS:
        return []
    is_inlier = np.ones(len(xyz), bool)
    P, distance = np.zeros((3, 4)), np.zeros(len(xyz))
    for _ in range(_N_TRIMS):
        P = fit_dlt(xyz[is_inlier], uv[is_inlier])
        distance = np.nan_to_num(np.linalg.norm(px_from_points(P[None], xyz)[:, 0] - uv, axis=1), nan=_FAR_PX)
        is_inlier = distance <= np.quantile(distance, _INLIER_SHARE)
    fit_px = float(np.quantile(distance, _INLIER_SHARE))
    if fit_px > _LIMIT_SHARE * max(size) or not decompose(P).is_mirrored:
        return []
    return [
        Finding(
            kind="mirrored",
            what=f"{camera} fits what the other cameras see, to {fit_px:.1f} px, but only as in a mirror",
            advice="its images are mirrored; switch that off in the camera, and record or convert anew",
            cameras=(camera,),
        )
    ]


def check_roll(rig: Rig, up: Array | None = None) -> list[Finding]:
    """Report cameras whose images lie on their side or upside down.

    up (3,): the world's; if unknown, the direction that most cameras agree on.
    """
    ups = np.array([-camera.camera_from_world.rotation.as_matrix()[1] for camera in rig])
    if up is None:
        if len(rig) < 3:
            return []
        agreeing = ups @ ups.T > np.cos(_MOST_ROLL)
        main = agreeing[np.argmax(agreeing.sum(axis=1))]
        if main.sum() <= len(rig) / 2:
            return []
        up = np.mean(ups[main], axis=0)
    up = np.asarray(up) / np.linalg.norm(np.asarray(up))
    findings = []
    for camera in rig:
        x, y, z = camera.camera_from_world.rotation.apply(up)
        roll = np.arctan2(x, -y)
        if abs(z) < np.sin(_STEEPEST) and abs(roll) > _MOST_ROLL:
            findings.append(
                Finding(
                    kind="turned",
                    what=f"{camera.name} comes out turned by {np.degrees(roll):.0f} degrees about its line of sight",
                    advice=("if it does not hang so, its video is stored turned: turn it, and calibrate again"),
                    cameras=(camera.name,),
                )
            )
    return findings


def check_image_size(camera: str, calibrated: tuple[int, int], picture: tuple[int, int]) -> list[Finding]:
    """Report an image size (width, height) that differs from the one of the calibration."""
    if calibrated == picture:
        return []
    ratios = picture[0] / calibrated[0], picture[1] / calibrated[1]
    if picture == calibrated[::-1]:
        kind, advice = "turned", "one of them is turned by 90 degrees; turn the videos alike and calibrate with those"
    elif abs(ratios[0] / ratios[1] - 1) < _SAME_SHAPE:
        kind = "size"
        advice = f"it was saved {ratios[0]:.3f} times as large; give saved_scale = {1 / ratios[0]:.4f}"
    else:
        kind, advice = (
            "size",
            "it was cropped (give saved_offset_px, and saved_scale if it was resized too), or the camera has another "
            "mode",
        )
    what = (
        f"{camera} was calibrated with images of {calibrated[0]}×{calibrated[1]}, these have {picture[0]}×{picture[1]}"
    )
    return [Finding(kind=kind, what=what, advice=advice, cameras=(camera,))]


def check_swapped_files(rig: Rig, px: Array) -> list[Finding]:
    """Report two cameras whose videos are exchanged, from points (n, cameras, 2) [px] and a known rig."""
    rows = np.unique(np.linspace(0, len(px) - 1, _MOST_POINTS).astype(int)) if len(px) else np.zeros(0, int)

    def misfit_px(order: Sequence[int]) -> float:
        exchanged = px[rows][:, list(order)]
        points = rig.points_from_px(exchanged)
        residual = np.stack([camera.px_from_world(points) for camera in rig], axis=1) - exchanged
        is_seen_twice = np.isfinite(exchanged[..., 0]).sum(axis=1) >= 2
        distance = np.linalg.norm(residual, axis=-1)[np.isfinite(exchanged[..., 0]) & is_seen_twice[:, None]]
        return float(np.median(np.nan_to_num(distance, nan=np.inf))) if len(distance) else np.inf

    return check_swaps(rig.names, misfit_px)


def check_swaps(names: tuple[str, ...], misfit_px: Callable[[Sequence[int]], float]) -> list[Finding]:
    """Report two cameras that fit far better when exchanged.

    misfit_px returns the median distance [px] for an order of the observations' cameras; (0, 1, ...) is as labelled.
    """
    order = list(range(len(names)))
    misfit = misfit_px(order)
    if not misfit > _SWAPPED_PX:
        return []
    misfits = {}
    for a, b in combinations(order, 2):
        exchanged = order.copy()
        exchanged[a], exchanged[b] = b, a
        misfits[a, b] = misfit_px(exchanged)
    best = min(misfits, key=misfits.__getitem__, default=None)
    if best is None or misfits[best] > _SWAPPED_SHARE * misfit:
        return []
    pair = [names[i] for i in best]
    both = join_names(pair)
    before = f"{misfit:.1f} px" if np.isfinite(misfit) else "nowhere"
    return [
        Finding(
            kind="swapped",
            what=f"points fit to {before} as the files are named, {misfits[best]:.1f} px with {both} exchanged",
            advice=f"the files of {both} are swapped; exchange them",
            cameras=tuple(pair),
        )
    ]


def check_floor(rig: Rig) -> list[Finding]:
    """Report cameras below the floor z = 0 of a court: the mirrored solution."""
    names = [camera.name for camera in rig if camera.centre[2] < 0]
    if not names:
        return []
    come = "come" if len(names) > 1 else "comes"
    deepest = min(camera.centre[2] for camera in rig)
    return [
        Finding(
            kind="mirrored",
            what=f"{join_names(names)} {come} out below the floor, at z = {deepest:.1f} m",
            advice="left and right, or near and far, are exchanged in the points' names, or the images are mirrored",
            cameras=tuple(names),
        )
    ]
