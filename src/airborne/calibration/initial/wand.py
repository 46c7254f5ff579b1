"""Initial cameras from a waved wand alone: the first pair by epipolar geometry, the others by resection.

Unknown focal lengths are those that keep the wand's length constant: a wrong one makes the wand long here and short
there. The known length also gives the scale.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration.initial.pinhole_pose import resect_pinhole
from airborne.calibration.initial.two_views import EpipolarGeometry, RelativePose, fit_epipolar_geometry, relative_pose
from airborne.calibration.sources.wand import WandTracks
from airborne.cameras.camera import Camera, Rig
from airborne.errors import CalibrationError
from airborne.geometry.robust import robust_sd
from airborne.types import Array

_EPIPOLAR_LIMIT_SHARE = 0.003  # of an image's longer side: how far a marker may lie from its epipolar line
_LEAST_SHARED, _LEAST_FRAMES = 15, 10  # markers that two cameras must both see, and in how many frames
# focal length over the image's longer side: fields of view of 96 to 16 degrees
_FOCAL_RATIOS = np.geomspace(0.45, 3.6, 10)
_N_SAMPLE_FRAMES = 120  # frames that test a focal length
_LEAST_FRONT = 0.75  # share of the markers in front of both cameras
_MOST_LENGTH_VARIATION = 0.2  # relative standard deviation of the wand's length: beyond it a pair is useless


@dataclass(frozen=True, slots=True, eq=False)
class _Pair:
    """Two cameras and the markers that both see."""

    a: int
    b: int
    is_inlier: NDArray[np.bool_]  # (frames, markers) of both cameras
    epipolar: EpipolarGeometry


def initial_rig_from_wand(
    tracks: WandTracks, sizes: Mapping[str, tuple[int, int]], lenses: Mapping[str, Camera] | None = None
) -> Rig:
    """Return initial values of the cameras that see the wand, in metres.

    lenses: cameras whose K and distortion are known; the others are taken as pinholes with the principal point in the
    image's middle. The world is the axes of the first camera of the best pair. Raises CalibrationError where cameras
    share too few markers, naming them, or where an image seems to be mirrored.
    """
    cameras = [_camera_without_pose(name, sizes[name], lenses or {}) for name in tracks.cameras]
    ideal = np.stack([camera.undistort_px(tracks.px[:, :, i]) for i, camera in enumerate(cameras)], axis=2)
    pairs = _pairs(ideal, cameras)
    _check_linked(tracks, pairs)
    unknown = [i for i, camera in enumerate(cameras) if camera.name not in (lenses or {})]
    cameras = _with_focal_lengths(cameras, unknown, pairs, replace(tracks, px=ideal))
    return _chain_cameras(cameras, pairs, replace(tracks, px=_without_outliers(ideal, pairs)))


def _camera_without_pose(name: str, size: tuple[int, int], lenses: Mapping[str, Camera]) -> Camera:
    identity = RigidTransform.identity()
    if name in lenses:
        return replace(lenses[name], camera_from_world=identity)
    f, middle = float(max(size)), (np.array(size) - 1) / 2
    return Camera(
        name=name,
        K=np.array([[f, 0, middle[0]], [0, f, middle[1]], [0, 0, 1]]),
        size=size,
        camera_from_world=identity,
    )


def _pairs(px: Array, cameras: Sequence[Camera]) -> list[_Pair]:
    """Return all pairs of cameras with enough inliers; px without distortion."""
    pairs = []
    is_seen = np.isfinite(px[..., 0])
    for a, b in combinations(range(len(cameras)), 2):
        is_shared = is_seen[:, :, a] & is_seen[:, :, b]
        limit = _EPIPOLAR_LIMIT_SHARE * max(*cameras[a].size, *cameras[b].size)
        geometry = fit_epipolar_geometry(px[is_shared][:, a], px[is_shared][:, b], limit_px=limit)
        if geometry is None or geometry.is_inlier.sum() < _LEAST_SHARED:
            continue
        is_inlier = np.zeros_like(is_shared)
        is_inlier[is_shared] = geometry.is_inlier
        if is_inlier.any(axis=1).sum() >= _LEAST_FRAMES:
            pairs.append(_Pair(a, b, is_inlier, geometry))
    return pairs


def _check_linked(tracks: WandTracks, pairs: Sequence[_Pair]) -> None:
    """Raise CalibrationError unless the pairs connect all cameras."""
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
        names, others = (", ".join(tracks.cameras[i] for i in each) for each in (apart, sorted(linked)))
        raise CalibrationError(
            f"the wand does not tie {names} to {others}: one of each sees it at the same time in {shared} frames at "
            f"most; at least {_LEAST_FRAMES} are needed in which {_LEAST_SHARED} of its places agree, 200 are good: "
            "wave it where both see it, and bring the cameras into step"
        )


def _with_focal_lengths(
    cameras: list[Camera], unknown: Sequence[int], pairs: Sequence[_Pair], tracks: WandTracks
) -> list[Camera]:
    """Give the unknown cameras the focal lengths that keep the wand's length most constant."""
    if not unknown:
        return cameras
    focal = np.array([camera.K[0, 0] for camera in cameras])
    longer = np.array([max(camera.size) for camera in cameras], float)
    samples = [_sample_frames(pair, tracks) for pair in pairs]

    @cache  # most steps change one camera, and leave the pairs of the others as they are
    def variation(k: int, focal_a: float, focal_b: float) -> float:
        pair = pairs[k]
        a, b = (_with_focal(cameras[i], f) for i, f in ((pair.a, focal_a), (pair.b, focal_b)))
        return _length_variation(pair, samples[k], tracks, K_a=a.K, K_b=b.K)

    def misfit(focals: Array, only: int | None = None) -> float:
        relevant = [(k, pair) for k, pair in enumerate(pairs) if only is None or only in (pair.a, pair.b)]
        return sum(variation(k, float(focals[pair.a]), float(focals[pair.b])) for k, pair in relevant)

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
    def scale_focals(logs: Array) -> Array:
        new = focal.copy()
        new[list(unknown)] *= np.exp(logs)
        return new

    n = len(unknown)
    simplex = np.vstack([np.zeros(n), 0.1 * np.eye(n)])
    # to a hundredth: all is fitted once more, of ten synthetic wands to the same cameras as after a thousandth
    options = {"maxfev": 40 * n, "xatol": 1e-2, "fatol": 1e-3, "initial_simplex": simplex}
    minimum = minimize(lambda logs: misfit(scale_focals(logs)), np.zeros(n), method="Nelder-Mead", options=options)
    return scale_focals(np.clip(minimum.x, -0.3, 0.3))


def _sample_frames(pair: _Pair, tracks: WandTracks) -> NDArray[np.integer]:
    """Return frames, evenly spaced, in which both cameras see a known length of the wand."""
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


def _length_variation(pair: _Pair, rows: NDArray[np.integer], tracks: WandTracks, *, K_a: Array, K_b: Array) -> float:
    """Return the relative variation of the wand's length in one pair, plus the share of markers behind the cameras."""
    if len(rows) < _LEAST_SHARED:
        return 0.0
    pose, points = _relative_pose(pair, rows, tracks, K_a=K_a, K_b=K_b)
    _, variation = wand_scale(points, pair.is_inlier[rows], tracks)
    return min(variation + 1 - pose.front_share, _MOST_LENGTH_VARIATION)


def _relative_pose(
    pair: _Pair, rows: NDArray[np.integer], tracks: WandTracks, *, K_a: Array, K_b: Array
) -> tuple[RelativePose, Array]:
    """Return the pair's relative pose from some frames, and their markers (frames, markers, 3) in a's axes."""
    is_inlier = pair.is_inlier[rows]
    px = tracks.px[rows][is_inlier]
    pose = relative_pose(pair.epipolar.F, K_a, K_b, px_a=px[:, pair.a], px_b=px[:, pair.b])
    points = np.full((*is_inlier.shape, 3), np.nan)
    points[is_inlier] = pose.points
    return pose, points


def wand_scale(points: Array, is_seen: NDArray[np.bool_], tracks: WandTracks) -> tuple[float, float]:
    """Return the factor that gives the wand its lengths, and their relative standard deviation (robust)."""
    factors = [
        length / np.linalg.norm(points[:, a] - points[:, b], axis=1)[is_seen[:, a] & is_seen[:, b]]
        for (a, b), length in tracks.lengths_m.items()
    ]
    logs = np.log(np.concatenate(factors))
    logs = logs[np.isfinite(logs)]
    if not len(logs):
        return 1.0, np.inf
    return float(np.exp(np.median(logs))), robust_sd(logs)


def _without_outliers(px: Array, pairs: Sequence[_Pair]) -> Array:
    """Set pixels to NaN that are outliers in half of their pairs or more."""
    n_inlier, n_pairs = np.zeros(px.shape[:-1]), np.zeros(px.shape[:-1])
    is_seen = np.isfinite(px[..., 0])
    for pair in pairs:
        is_shared = is_seen[:, :, pair.a] & is_seen[:, :, pair.b]
        for i in (pair.a, pair.b):
            n_pairs[:, :, i] += is_shared
            n_inlier[:, :, i] += pair.is_inlier
    return np.where((n_inlier > n_pairs / 2)[..., None], px, np.nan)


def _chain_cameras(cameras: Sequence[Camera], pairs: Sequence[_Pair], tracks: WandTracks) -> Rig:
    """Start with the best pair; then resect the camera that sees most of the triangulated markers, and so on.

    A camera that sees too few of them is placed by its relative pose to one other camera.
    """
    links = _links(cameras, pairs, tracks)
    best = links[0]
    posed = {best.a: cameras[best.a], best.b: replace(cameras[best.b], camera_from_world=best.b_from_a)}
    while len(posed) < len(cameras):
        rows = sorted(posed)
        points = Rig(tuple(posed[i] for i in rows)).points_from_px(tracks.px[:, :, rows])
        is_triangulated = np.isfinite(points).all(axis=-1)
        counts = {
            i: int((is_triangulated & np.isfinite(tracks.px[:, :, i, 0])).sum())
            for i in range(len(cameras))
            if i not in posed
        }
        i = max(counts, key=counts.__getitem__)
        if counts[i] < _LEAST_SHARED:
            i, new = _place_by_link(cameras, posed, links)
        else:
            new = resect_pinhole(cameras[i], points[is_triangulated], tracks.px[:, :, i][is_triangulated])
        if new is None:
            raise CalibrationError(
                f"the wand does not determine where camera '{cameras[i].name}' stands relative to "
                f"{', '.join(cameras[j].name for j in rows)}: wave it where they all see it, in every depth"
            )
        posed[i] = new
    return Rig(tuple(posed[i] for i in range(len(cameras))))


@dataclass(frozen=True, slots=True, eq=False)
class _Link:
    """Two cameras with their relative pose, in metres."""

    a: int
    b: int
    b_from_a: RigidTransform
    quality: float


def _links(cameras: Sequence[Camera], pairs: Sequence[_Pair], tracks: WandTracks) -> list[_Link]:
    """Return the pairs in which the wand's length is constant, best first: many markers with a large parallax."""
    links: list[_Link] = []
    least_variation = np.inf
    for pair in pairs:
        rows = np.flatnonzero(pair.is_inlier.any(axis=1))
        pose, points = _relative_pose(pair, rows, tracks, K_a=cameras[pair.a].K, K_b=cameras[pair.b].K)
        factor, variation = wand_scale(points, pair.is_inlier[rows], tracks)
        least_variation = min(least_variation, variation)
        if pose.front_share < _LEAST_FRONT or variation > _MOST_LENGTH_VARIATION:
            continue
        quality = float(np.sqrt(pair.is_inlier.sum()) * np.sin(pose.parallax_rad) / (0.01 + variation))
        b_from_a = RigidTransform.from_components(factor * pose.t, Rotation.from_matrix(pose.R))
        links.append(_Link(pair.a, pair.b, b_from_a, quality))
    if not links:
        raise CalibrationError(
            f"however the cameras stand, the wand's length varies by {least_variation:.0%}: an image is mirrored, the "
            "pixels count from another corner, the cameras are not in step, or the columns are in another order"
        )
    return sorted(links, key=lambda link: -link.quality)


def _place_by_link(
    cameras: Sequence[Camera], posed: Mapping[int, Camera], links: Sequence[_Link]
) -> tuple[int, Camera | None]:
    """Return the next camera, posed by the best link to a posed one; None where there is no link."""
    for link in links:
        for old, new, new_from_old in ((link.a, link.b, link.b_from_a), (link.b, link.a, link.b_from_a.inv())):
            if old in posed and new not in posed:
                pose = new_from_old * posed[old].camera_from_world
                return new, replace(cameras[new], camera_from_world=pose)
    return next(i for i in range(len(cameras)) if i not in posed), None
