"""Where cameras stand, from nothing but a waved wand: pairs by epipolar geometry, the rest chained on.

The focal lengths that are not known are those with which the wand keeps its length: a wrong one makes the wand long
here and short there. The known length also gives the scale.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration.diagnosis.images import check_mirroring
from airborne.calibration.initial.two_views import EpipolarGeometry, RelativePose, fit_epipolar_geometry, relative_pose
from airborne.calibration.sources.wand import WandTracks
from airborne.cameras.camera import Camera, Rig
from airborne.errors import CalibrationError
from airborne.geometry.robust import robust_sd
from airborne.types import Array

_EPIPOLAR_LIMIT_SHARE = 0.003  # of a picture's longer side: how far a marker may lie from its epipolar line
_LEAST_SHARED, _LEAST_FRAMES = 15, 10  # markers that two cameras must both see, and in how many frames
_FOCAL_RATIOS = np.geomspace(0.45, 3.6, 10)  # focal length over the picture's longer side: 96 to 16 degrees across
_N_SAMPLE_FRAMES = 120  # frames that judge a focal length
_RESECTION_LIMIT_SHARE = 0.02  # of the longer side: how far a marker may lie off when a camera is chained on
_INLIER_SHARE = 0.8  # share of the markers that must then lie nearer
_LEAST_FRONT = 0.75  # share of the markers in front of both cameras
_MOST_LENGTH_VARIATION = 0.2  # relative spread of the wand's length: beyond it two cameras tell nothing


@dataclass(frozen=True, slots=True, eq=False)
class _Pair:
    """Two cameras and the markers that both see."""

    a: int
    b: int
    is_inlier: NDArray[np.bool_]  # (frames, markers), by both and in agreement
    epipolar: EpipolarGeometry


def initial_rig_from_wand(
    tracks: WandTracks, sizes: Mapping[str, tuple[int, int]], lenses: Mapping[str, Camera] | None = None
) -> Rig:
    """Find the cameras that saw the wand, roughly: a start for the adjustment, in metres.

    lenses: cameras whose K and distortion are known; the others are taken as pinholes with the axis in the picture's
    middle. The world is the axes of the camera that is best tied to the others. Raises CalibrationError where
    cameras share too few markers (their names are told), or where a picture seems to be mirrored.
    """
    cameras = [_unposed_camera(name, sizes[name], lenses or {}) for name in tracks.cameras]
    straight = np.stack([camera.undistort_px(tracks.px[:, :, i]) for i, camera in enumerate(cameras)], axis=2)
    pairs = _pairs(straight, cameras)
    _check_linked(tracks, pairs)
    unknown = [i for i, camera in enumerate(cameras) if camera.name not in (lenses or {})]
    cameras = _with_focal_lengths(cameras, unknown, pairs, replace(tracks, px=straight))
    return _chain_cameras(cameras, pairs, replace(tracks, px=_without_outliers(straight, pairs)))


def _unposed_camera(name: str, size: tuple[int, int], lenses: Mapping[str, Camera]) -> Camera:
    still = RigidTransform.identity()
    if name in lenses:
        return replace(lenses[name], camera_from_world=still)
    f, middle = float(max(size)), (np.array(size) - 1) / 2
    return Camera(
        name=name,
        K=np.array([[f, 0, middle[0]], [0, f, middle[1]], [0, 0, 1]]),
        size=size,
        camera_from_world=still,
    )


def _pairs(px: Array, cameras: Sequence[Camera]) -> list[_Pair]:
    """Return every two cameras that agree on enough markers; px without distortion."""
    found = []
    is_seen = np.isfinite(px[..., 0])
    for a, b in combinations(range(len(cameras)), 2):
        both = is_seen[:, :, a] & is_seen[:, :, b]
        limit = _EPIPOLAR_LIMIT_SHARE * max(*cameras[a].size, *cameras[b].size)
        agreement = fit_epipolar_geometry(px[both][:, a], px[both][:, b], limit_px=limit)
        if agreement is None or agreement.is_inlier.sum() < _LEAST_SHARED:
            continue
        seen = np.zeros_like(both)
        seen[both] = agreement.is_inlier
        if seen.any(axis=1).sum() >= _LEAST_FRAMES:
            found.append(_Pair(a, b, seen, agreement))
    return found


def _check_linked(tracks: WandTracks, pairs: Sequence[_Pair]) -> None:
    """Raise CalibrationError where not every camera is tied to every other, at least through others."""
    if len(tracks.cameras) < 2:
        raise CalibrationError(
            f"only {', '.join(tracks.cameras)} saw the wand; it calibrates two cameras or more together"
        )
    linked = {0}
    for _ in tracks.cameras:
        linked |= {i for pair in pairs if {pair.a, pair.b} & linked for i in (pair.a, pair.b)}
    apart = [i for i in range(len(tracks.cameras)) if i not in linked]
    if apart:
        is_seen = np.isfinite(tracks.px[..., 0])
        shared = max(int((is_seen[..., i] & is_seen[..., j]).any(axis=1).sum()) for i in apart for j in linked)
        names, rest = (", ".join(tracks.cameras[i] for i in each) for each in (apart, sorted(linked)))
        raise CalibrationError(
            f"the wand does not tie {names} to {rest}: one of each sees it at the same time in {shared} frames at "
            f"most; at least {_LEAST_FRAMES} are needed in which {_LEAST_SHARED} of its places agree, 200 are good: "
            "wave it where both see it, and bring the cameras into step"
        )


def _with_focal_lengths(
    cameras: list[Camera], unknown: Sequence[int], pairs: Sequence[_Pair], tracks: WandTracks
) -> list[Camera]:
    """Give the unknown cameras the focal lengths with which the wand keeps its length best."""
    if not unknown:
        return cameras
    focal = np.array([camera.K[0, 0] for camera in cameras])
    longer = np.array([max(camera.size) for camera in cameras], float)
    samples = {id(pair): _sample_frames(pair, tracks) for pair in pairs}

    def misfit(focals: Array, only: int | None = None) -> float:
        told = [pair for pair in pairs if only is None or only in (pair.a, pair.b)]
        return sum(_length_variation(pair, samples[id(pair)], cameras, focals, tracks) for pair in told)

    for ratio in _FOCAL_RATIOS:  # all alike first: cameras of one recording mostly are
        guess = focal.copy()
        guess[unknown] = ratio * longer[unknown]
        focal = min(focal, guess, key=misfit)
    for _ in range(2):
        for i in unknown:
            guesses = [np.where(np.arange(len(focal)) == i, ratio * longer[i], focal) for ratio in _FOCAL_RATIOS]
            focal = min([focal, *guesses], key=lambda guess: misfit(guess, i))
    focal = _refine_focal_lengths(misfit, focal, unknown)
    return [_with_focal(camera, f) for camera, f in zip(cameras, focal, strict=True)]


def _refine_focal_lengths(misfit: Callable[[Array], float], focal: Array, unknown: Sequence[int]) -> Array:
    def changed(logs: Array) -> Array:
        new = focal.copy()
        new[list(unknown)] *= np.exp(logs)
        return new

    n = len(unknown)
    simplex = np.vstack([np.zeros(n), 0.1 * np.eye(n)])
    options = {"maxfev": 40 * n, "xatol": 1e-3, "fatol": 1e-5, "initial_simplex": simplex}
    found = minimize(lambda logs: misfit(changed(logs)), np.zeros(n), method="Nelder-Mead", options=options)
    return changed(np.clip(found.x, -0.3, 0.3))


def _sample_frames(pair: _Pair, tracks: WandTracks) -> NDArray[np.integer]:
    """Return frames, evenly spread, in which both cameras see a known length of the wand."""
    is_useful = np.zeros(len(tracks.px), bool)
    for a, b in tracks.lengths_m:
        is_useful |= pair.is_inlier[:, a] & pair.is_inlier[:, b]
    rows = np.flatnonzero(is_useful)
    return (
        rows[np.unique(np.linspace(0, len(rows) - 1, min(len(rows), _N_SAMPLE_FRAMES)).astype(int))]
        if len(rows)
        else rows
    )


def _with_focal(camera: Camera, focal_px: float) -> Camera:
    return replace(camera, K=np.array([[focal_px, 0, camera.K[0, 2]], [0, focal_px, camera.K[1, 2]], [0, 0, 1]]))


def _length_variation(
    pair: _Pair, rows: NDArray[np.integer], cameras: Sequence[Camera], focals: Array, tracks: WandTracks
) -> float:
    """Return how much the wand's length varies, relatively, by the pair alone, plus the share behind the cameras."""
    if len(rows) < _LEAST_SHARED:
        return 0.0
    K_a, K_b = (_with_focal(cameras[i], focals[i]).K for i in (pair.a, pair.b))
    place, points = _relative_pose(pair, rows, tracks, K_a, K_b)
    _, spread = _scale(points, pair.is_inlier[rows], tracks)
    return min(spread + 1 - place.front_share, _MOST_LENGTH_VARIATION)


def _relative_pose(
    pair: _Pair, rows: NDArray[np.integer], tracks: WandTracks, K_a: Array, K_b: Array
) -> tuple[RelativePose, Array]:
    """Return the pair's place by the markers of some frames, and these markers (frames, markers, 3) in a's axes."""
    seen = pair.is_inlier[rows]
    px = tracks.px[rows][seen]
    place = relative_pose(pair.epipolar.F, K_a, K_b, px[:, pair.a], px[:, pair.b])
    points = np.full((*seen.shape, 3), np.nan)
    points[seen] = place.points
    return place, points


def _scale(points: Array, seen: NDArray[np.bool_], tracks: WandTracks) -> tuple[float, float]:
    """Return the factor that gives the wand its lengths, and the relative spread of the lengths (robust)."""
    factors = [
        length / np.linalg.norm(points[:, a] - points[:, b], axis=1)[seen[:, a] & seen[:, b]]
        for (a, b), length in tracks.lengths_m.items()
    ]
    logs = np.log(np.concatenate(factors))
    logs = logs[np.isfinite(logs)]
    if not len(logs):
        return 1.0, np.inf
    return float(np.exp(np.median(logs))), robust_sd(logs)


def _without_outliers(px: Array, pairs: Sequence[_Pair]) -> Array:
    """Set places to NaN that most of the pairs in which they take part do not agree with."""
    agrees, takes_part = np.zeros(px.shape[:-1]), np.zeros(px.shape[:-1])
    is_seen = np.isfinite(px[..., 0])
    for pair in pairs:
        both = is_seen[:, :, pair.a] & is_seen[:, :, pair.b]
        for i in (pair.a, pair.b):
            takes_part[:, :, i] += both
            agrees[:, :, i] += pair.is_inlier
    return np.where((agrees > takes_part / 2)[..., None], px, np.nan)


def _chain_cameras(cameras: Sequence[Camera], pairs: Sequence[_Pair], tracks: WandTracks) -> Rig:
    """Begin with the best pair; then the camera that sees most of the markers found so far, and so on.

    A camera that sees too few of them is hung on one other camera by what the two see together.
    """
    links = _links(cameras, pairs, tracks)
    best = links[0]
    placed = {best.a: cameras[best.a], best.b: replace(cameras[best.b], camera_from_world=best.b_from_a)}
    while len(placed) < len(cameras):
        rows = sorted(placed)
        points = Rig(tuple(placed[i] for i in rows)).points_from_px(tracks.px[:, :, rows])
        is_known = np.isfinite(points).all(axis=-1)
        counts = {
            i: int((is_known & np.isfinite(tracks.px[:, :, i, 0])).sum())
            for i in range(len(cameras))
            if i not in placed
        }
        i = max(counts, key=counts.__getitem__)
        if counts[i] < _LEAST_SHARED:
            i, new = _place_by_link(cameras, placed, links)
        else:
            new = _resect(cameras[i], points[is_known], tracks.px[:, :, i][is_known])
        if new is None:
            raise CalibrationError(
                f"the wand does not tell where camera '{cameras[i].name}' stands beside "
                f"{', '.join(cameras[j].name for j in rows)}: wave it where they all see it, in every depth"
            )
        placed[i] = new
    return Rig(tuple(placed[i] for i in range(len(cameras))))


@dataclass(frozen=True, slots=True, eq=False)
class _Link:
    """Two cameras whose places beside each other the wand tells, in metres."""

    a: int
    b: int
    b_from_a: RigidTransform
    quality: float


def _links(cameras: Sequence[Camera], pairs: Sequence[_Pair], tracks: WandTracks) -> list[_Link]:
    """Return the pairs that see the wand keep its length, best first: many markers under a wide angle."""
    found: list[_Link] = []
    steadiest = np.inf
    for pair in pairs:
        rows = np.flatnonzero(pair.is_inlier.any(axis=1))
        place, points = _relative_pose(pair, rows, tracks, cameras[pair.a].K, cameras[pair.b].K)
        factor, spread = _scale(points, pair.is_inlier[rows], tracks)
        steadiest = min(steadiest, spread)
        if place.front_share < _LEAST_FRONT or spread > _MOST_LENGTH_VARIATION:
            continue
        worth = float(np.sqrt(pair.is_inlier.sum()) * np.sin(place.parallax_rad) / (0.01 + spread))
        b_from_a = RigidTransform.from_components(factor * place.t, Rotation.from_matrix(place.R))
        found.append(_Link(pair.a, pair.b, b_from_a, worth))
    if not found:
        raise CalibrationError(
            f"however the cameras stand, the wand's length varies by {steadiest:.0%}: a picture is mirrored, the "
            "pixels count from another corner, the cameras are not in step, or the columns are in another order"
        )
    return sorted(found, key=lambda link: -link.quality)


def _place_by_link(
    cameras: Sequence[Camera], placed: Mapping[int, Camera], links: Sequence[_Link]
) -> tuple[int, Camera | None]:
    """Return the next camera, placed by the best link to one that is placed; None where there is no link."""
    for link in links:
        for known, new, new_from_known in ((link.a, link.b, link.b_from_a), (link.b, link.a, link.b_from_a.inv())):
            if known in placed and new not in placed:
                place = new_from_known * placed[known].camera_from_world
                return new, replace(cameras[new], camera_from_world=place)
    return next(i for i in range(len(cameras)) if i not in placed), None


def _resect(camera: Camera, points: Array, px: Array) -> Camera | None:
    """Return the camera where it sees points (n, 3) [m] at px (n, 2), without distortion; None where nothing fits.

    Raises CalibrationError where only a mirror shows them so.
    """
    seen = np.isfinite(px).all(axis=-1)
    for finding in check_mirroring(camera.name, camera.size, points, px):
        raise CalibrationError(finding.sentence)
    cv2.setRNGSeed(0)
    limit = _RESECTION_LIMIT_SHARE * max(camera.size)
    found, turn, t, inliers = cv2.solvePnPRansac(
        points[seen], px[seen], camera.K, None, reprojectionError=limit, iterationsCount=300, flags=cv2.SOLVEPNP_SQPNP
    )
    if not found or inliers is None or len(inliers) < _INLIER_SHARE * seen.sum() or not np.all(np.isfinite([turn, t])):
        return None
    place = RigidTransform.from_components(t.ravel(), Rotation.from_rotvec(turn.ravel()))
    return replace(camera, camera_from_world=place)
