"""Pictures that are not what the lens saw: mirrored, turned, of another size, exchanged between cameras."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np

from airborne.cameras.camera import Rig
from airborne.cameras.dlt import decompose, fit_dlt
from airborne.cameras.finding import Finding, join_names
from airborne.geometry.triangulation import px_from_points
from airborne.types import Array

_LIMIT_SHARE = 0.01  # of a picture's longer side: how far points may lie off that tell a mirror
_FEWEST_POINTS = 15  # that tell it
_INLIER_SHARE, _N_TRIMS = 0.8, 10  # share of the points that must fit
_FAR_PX = 1e6  # what lies behind a camera
_MOST_ROLL = np.radians(60)
_STEEPEST = np.radians(70)  # a camera that looks further up or down has no upright
_SWAPPED_PX, _SWAPPED_SHARE = 8.0, 0.4  # median distance that calls for it, and what exchanging must leave of it
_MOST_POINTS = 500
_SAME_SHAPE = 0.01


def check_mirroring(camera: str, size: tuple[int, int], points: Array, px: Array) -> list[Finding]:
    """Say whether a camera sees points (n, 3) [m], which other cameras found, at px (n, 2) as only a mirror shows them.

    By the direct linear transformation, which knows no focal length and may come out left-handed; a fifth of the points
    may be wrong.
    """
    known = np.isfinite(points).all(axis=1) & np.isfinite(px).all(axis=1)
    xyz, uv = points[known], px[known]
    if len(xyz) < _FEWEST_POINTS:
        return []
    kept = np.ones(len(xyz), bool)
    P, off = np.zeros((3, 4)), np.zeros(len(xyz))
    for _ in range(_N_TRIMS):
        P = fit_dlt(xyz[kept], uv[kept])
        off = np.nan_to_num(np.linalg.norm(px_from_points(P[None], xyz)[:, 0] - uv, axis=1), nan=_FAR_PX)
        kept = off <= np.quantile(off, _INLIER_SHARE)
    fit_px = float(np.quantile(off, _INLIER_SHARE))
    if fit_px > _LIMIT_SHARE * max(size) or not decompose(P).is_mirrored:
        return []
    return [
        Finding(
            kind="mirrored",
            what=f"{camera} fits what the other cameras see, to {fit_px:.1f} px, but only as in a mirror",
            advice="its pictures are mirrored; switch that off in the camera, and record or convert anew",
            cameras=(camera,),
        )
    ]


def check_roll(rig: Rig, up: Array | None = None) -> list[Finding]:
    """Say which cameras' pictures lie on their side or upside down.

    up (3,): the world's; where it is not known, the direction that most cameras agree on, which only tells the others.
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
    found = []
    for camera in rig:
        x, y, z = camera.camera_from_world.rotation.apply(up)
        roll = np.arctan2(x, -y)
        if abs(z) < np.sin(_STEEPEST) and abs(roll) > _MOST_ROLL:
            found.append(
                Finding(
                    kind="turned",
                    what=f"{camera.name} comes out turned by {np.degrees(roll):.0f} degrees about its line of sight",
                    advice=("if it does not hang so, its video is stored turned: turn it, and calibrate again"),
                    cameras=(camera.name,),
                )
            )
    return found


def check_image_size(camera: str, calibrated: tuple[int, int], picture: tuple[int, int]) -> list[Finding]:
    """Say how a picture's size (width, height) differs from the one that the lens was calibrated with."""
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
            "it was cropped (give saved_offset_px), or the camera has another mode",
        )
    what = (
        f"{camera} was calibrated with pictures of {calibrated[0]}×{calibrated[1]}, "
        f"these have {picture[0]}×{picture[1]}"
    )
    return [Finding(kind=kind, what=what, advice=advice, cameras=(camera,))]


def check_swapped_files(rig: Rig, px: Array) -> list[Finding]:
    """Say which two cameras' pictures are exchanged, by points (n, cameras, 2) [px] that a known rig agrees on."""
    rows = np.unique(np.linspace(0, len(px) - 1, _MOST_POINTS).astype(int)) if len(px) else np.zeros(0, int)

    def misfit_px(order: Sequence[int]) -> float:
        exchanged = px[rows][:, list(order)]
        points = rig.points_from_px(exchanged)
        off = np.stack([camera.px_from_world(points) for camera in rig], axis=1) - exchanged
        seen_twice = np.isfinite(exchanged[..., 0]).sum(axis=1) >= 2
        distance = np.linalg.norm(off, axis=-1)[np.isfinite(exchanged[..., 0]) & seen_twice[:, None]]
        return float(np.median(np.nan_to_num(distance, nan=np.inf))) if len(distance) else np.inf

    return check_swaps(rig.names, misfit_px)


def check_swaps(names: tuple[str, ...], misfit_px: Callable[[Sequence[int]], float]) -> list[Finding]:
    """Say which two cameras fit far better when exchanged.

    misfit_px gives the typical distance [px] for an order of the evidence's cameras; (0, 1, ...) is as it is given.
    """
    order = list(range(len(names)))
    as_is = misfit_px(order)
    if not as_is > _SWAPPED_PX:
        return []
    tried = {}
    for a, b in combinations(order, 2):
        exchanged = order.copy()
        exchanged[a], exchanged[b] = b, a
        tried[a, b] = misfit_px(exchanged)
    best = min(tried, key=tried.__getitem__, default=None)
    if best is None or tried[best] > _SWAPPED_SHARE * as_is:
        return []
    pair = [names[i] for i in best]
    before = f"{as_is:.1f} px" if np.isfinite(as_is) else "nowhere"
    return [
        Finding(
            kind="swapped",
            what=f"points fit to {before} as the files are named, {tried[best]:.1f} px with {join_names(pair)} exchanged",
            advice=f"the files of {join_names(pair)} are swapped; exchange them",
            cameras=tuple(pair),
        )
    ]


def check_floor(rig: Rig) -> list[Finding]:
    """Say which cameras come out below the floor z = 0 of a court: a mirror image of where they stand."""
    low = [camera.name for camera in rig if camera.centre[2] < 0]
    if not low:
        return []
    deepest = min(camera.centre[2] for camera in rig)
    return [
        Finding(
            kind="mirrored",
            what=f"{join_names(low)} {'come' if len(low) > 1 else 'comes'} out below the floor, at z = {deepest:.1f} m",
            advice="left and right, or near and far, are exchanged in the points' names, or the pictures are mirrored",
            cameras=tuple(low),
        )
    ]
