"""Synchronisation by motion: the shifts at which the cameras' views of what moves fit one scene.

Each camera's pictures are compared with their own median; what differs is a silhouette. Two cameras and a point span a
plane through both centres, and of all such planes the outermost ones that touch a moving thing do so in both pictures
(epipolar tangency), whatever its shape. For right shifts the two cameras' outermost planes agree at every moment. Needs
calibrated cameras, but no body and no colours.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from airborne.cameras import Camera, Rig
from airborne.errors import VideoError
from airborne.geometry.robust import SD_OF_MEDIAN_DEVIATION, covariance_of_sum
from airborne.sync.offsets import Offsets, counting
from airborne.video.decoding import Picture, VideoFacts, VideoSource, inspect, pictures, rgb_from_picture

Array = NDArray[np.floating]
Told = Callable[[], None]

_WIDTH = 320  # of the pictures compared [px]
_LONGEST = 1500  # pictures looked at
_BACKGROUND = 60  # pictures that the median is made of
_CLEAR = 5.0  # robust sds of what stands still
_LEAST_GREY = 8.0
_DARKEST_SHADOW = 0.35  # of the background's light
_LEAST_SHARE = 2e-4  # of the picture that must differ
_BESIDE_LARGEST = 0.25  # things smaller than this share of the largest are not followed
_SMOOTHED = 3  # pictures before and after
_LOOSE = 0.003  # rad between the planes that two cameras see
_FEWEST = 6  # moments that two cameras share


@dataclass(frozen=True, slots=True, eq=False)
class Silhouettes:
    """What one camera sees move."""

    camera: Camera
    time_s: Array  # (n,) since its first picture
    hulls: tuple[Array, ...]  # n of (k, 3): rays to the silhouette's convex hull, in world axes; (0, 3) where none
    period_s: float


def offsets_by_motion(
    sources: Sequence[VideoSource],
    rig: Rig,
    *,
    within_s: float = 1.0,
    progress: Callable[[int, int | None], None] | None = None,
) -> Offsets:
    """Find the offsets at which the silhouettes of what moves fit one scene.

    Shifts up to `within_s` either way are tried, by half pictures, then between them. The sds come from the scatter and
    take neighbouring pictures to err alike. Raises VideoError where nothing moves in a camera, or where no shift fits.
    """
    told = counting(progress)
    seen = [silhouettes_of(source, camera, told) for source, camera in zip(sources, rig, strict=True)]
    still = [each.camera.name for each in seen if sum(len(hull) > 0 for hull in each.hulls) < _FEWEST]
    if still:
        raise VideoError(
            f"nothing is seen to move in {', '.join(still)}; synchronise by flash or sound, or check the videos"
        )
    offset_s, sd_s = solve_shifts(seen, within_s)
    unknown = [name for name, sd in zip(rig.names, sd_s, strict=True) if not np.isfinite(sd)]
    if unknown:
        raise VideoError(
            f"{', '.join(unknown)}: no shift within {within_s:g} s brings its motion together with the other cameras'; "
            "widen the search, or synchronise by flash or sound"
        )
    zeros = np.zeros(len(rig))
    return Offsets(rig.names, offset_s, sd_s, zeros, zeros, how="by what moves before the cameras")


def silhouettes_of(source: VideoSource, camera: Camera, told: Told = lambda: None) -> Silhouettes:
    """Find what moves in one camera's first 1500 pictures; `told` is called after each."""
    facts = inspect(source)
    times, small, parities = [], [], []
    for picture in pictures(source, facts):
        times.append(float(picture.time_s))
        small.append(_small(picture, facts))
        parities.append(picture.parity)
        told()
        if len(times) == _LONGEST:
            break
    hulls: list[Array] = [np.zeros((0, 3))] * len(times)
    for parity in set(parities):
        rows = [k for k, each in enumerate(parities) if each == parity]
        stack = np.stack([small[k] for k in rows])
        seen_by = _camera_of(stack.shape[1:3], camera, parity)
        for k, hull in zip(rows, _hulls(stack), strict=True):
            hulls[k] = _rays(seen_by, hull)
    return Silhouettes(camera, np.array(times), tuple(hulls), float(1 / facts.image_rate))


def solve_shifts(seen: Sequence[Silhouettes], within_s: float) -> tuple[Array, Array]:
    """Return what to add to each camera's times (c,) [s], the first's nothing, and the sds (c,); inf where unknown."""
    pairs = [_Pair.of(seen, a, b) for a, b in combinations(range(len(seen)), 2)]
    n, offset_s = len(seen) - 1, np.zeros(len(seen))
    for new in range(1, len(seen)):
        step_s = min(seen[new].period_s, seen[0].period_s) / 2
        shifts = np.arange(-np.ceil(within_s / step_s), np.ceil(within_s / step_s) + 1) * step_s
        with_placed = [pair for pair in pairs if pair.second == new and pair.first < new]
        costs = [np.mean([_cost(pair.apart(shift - offset_s[pair.first])) for pair in with_placed]) for shift in shifts]
        if not np.isfinite(costs).any():
            return offset_s, np.concatenate([np.zeros(new), np.full(len(seen) - new, np.inf)])
        offset_s[new] = shifts[int(np.argmin(costs))]
    period_s = min(each.period_s for each in seen)

    def apart(free_s: Array) -> Array:
        tried = np.concatenate([[0.0], free_s])
        return np.concatenate([pair.apart(tried[pair.second] - tried[pair.first]) for pair in pairs])

    around = np.vstack([np.eye(n), -np.eye(n), np.zeros((1, n))]) * period_s
    kept = np.all([np.isfinite(apart(offset_s[1:] + change)) for change in around], axis=0)  # the same throughout

    def residual(free_s: Array) -> Array:
        return np.nan_to_num(apart(free_s)[kept]) / _LOOSE

    near = offset_s[1:] - period_s, offset_s[1:] + period_s
    found = least_squares(residual, offset_s[1:], bounds=near, loss="cauchy", x_scale=period_s)
    return np.concatenate([[0.0], found.x]), np.concatenate([[0.0], _sd(residual, found.x, period_s / 8)])


@dataclass(frozen=True, slots=True, eq=False)
class _Pair:
    """The outermost planes that two cameras see over time: angles about the line through both centres [rad]."""

    first: int
    second: int
    time_s: Array  # (n,) of the first camera
    angles: Array  # (n, 2) lowest and highest, smoothed
    other_time_s: Array  # (m,)
    other_angles: Array  # (m, 2) as seen
    other_period_s: float

    @classmethod
    def of(cls, seen: Sequence[Silhouettes], first: int, second: int) -> _Pair:
        """Measure the planes of two cameras."""
        a, b = seen[first], seen[second]
        axes = _across(b.camera.centre - a.camera.centre, a, b)
        extents = [_extents(each, axes) for each in (a, b)]
        smooth = smoothed(a.time_s, extents[0], a.time_s, a.period_s)
        return cls(first, second, a.time_s, smooth, b.time_s, extents[1], b.period_s)

    def apart(self, shift_s: float) -> Array:
        """Return how far the planes are apart (2 n,) [rad] where the second camera's times get a shift; NaN: unseen."""
        other = smoothed(self.other_time_s, self.other_angles, self.time_s - shift_s, self.other_period_s)
        return (self.angles - other).ravel()


def smoothed(time_s: Array, values: Array, wanted_s: Array, period_s: float) -> Array:
    """Look values (n, d) up at other times: (m, d), on a parabola through some pictures before and after.

    NaN where too few are near, and outside. Every time is smoothed alike, so that none is preferred.
    """
    away = (time_s - wanted_s[:, None]) / ((_SMOOTHED + 0.5) * period_s)
    weight = np.where(np.isfinite(values).all(axis=1), np.maximum(1 - np.abs(away) ** 3, 0) ** 3, 0)
    powers = np.stack([np.ones_like(away), away, away**2], axis=2)
    A = np.einsum("mn,mni,mnj->mij", weight, powers, powers)
    b = np.einsum("mn,mni,nk->mik", weight, powers, np.nan_to_num(values))
    is_known = ((weight * (away <= 0)).sum(axis=1) > 1) & ((weight * (away >= 0)).sum(axis=1) > 1)
    A[~is_known] = np.eye(3)
    found = np.asarray(np.linalg.solve(A, b), float)[:, 0]
    return np.where(is_known[:, None], found, np.nan)


def _across(baseline: Array, a: Silhouettes, b: Silhouettes) -> Array:
    """Return two axes (2, 3) across the baseline, the first toward what moves."""
    along = baseline / np.linalg.norm(baseline)
    toward = np.concatenate([*a.hulls, *b.hulls]).mean(axis=0)
    u: Array = toward - (toward @ along) * along
    u /= np.linalg.norm(u)
    return np.stack([u, np.cross(along, u)])


def _extents(seen: Silhouettes, axes: Array) -> Array:
    """Return the lowest and highest plane of each silhouette (n, 2) [rad]; NaN where there is none."""
    found = np.full((len(seen.hulls), 2), np.nan)
    for k, hull in enumerate(seen.hulls):
        if len(hull):
            x, y = axes @ hull.T
            angle = np.arctan2(y, x)
            if np.ptp(angle) < np.pi / 2:
                found[k] = angle.min(), angle.max()
    return found


def _sd(residual: Callable[[Array], Array], x: Array, step: float) -> Array:
    """Return the sds (d,) from the robust curvature and the scatter; some neighbours count as one."""
    at, columns = residual(x), []
    for i in range(len(x)):
        change = np.eye(len(x))[i] * step
        columns.append((residual(x + change) - residual(x - change)) / (2 * step))
    J = np.stack(columns, axis=1)
    weight = 1 / (1 + at**2)
    H = J.T @ (weight[:, None] * J)
    if np.any(np.diag(H) <= 0) or np.linalg.cond(H) > 1e12:
        return np.full(len(x), np.inf)
    left, inverse = (weight * at)[:, None] * J, np.linalg.inv(H)
    together = covariance_of_sum(left, 2 * 2 * _SMOOTHED)  # two planes a moment
    return np.sqrt(np.maximum(np.diag(inverse @ together @ inverse), 0))


def _cost(apart: Array) -> float:
    known = apart[np.isfinite(apart)]
    return float(np.mean(np.log1p((known / _LOOSE) ** 2))) if len(known) >= 2 * _FEWEST else np.inf


def _small(picture: Picture, facts: VideoFacts) -> NDArray[np.uint8]:
    rgb = rgb_from_picture(picture, facts)
    height, width = rgb.shape[:2]
    scale = min(_WIDTH / width, 1.0)
    size = round(width * scale), max(1, round(height * scale * (1 if picture.parity is None else 2)))
    return np.asarray(
        cv2.resize(rgb, size, interpolation=cv2.INTER_AREA if scale < 0.5 else cv2.INTER_LINEAR), np.uint8
    )


def _hulls(stack: NDArray[np.uint8]) -> list[Array]:
    """Return the hull of what is not in the median, in small pixels: n of (k, 2); (0, 2) where cut by the border."""
    chosen = np.unique(np.linspace(0, len(stack) - 1, min(_BACKGROUND, len(stack))).round().astype(int))
    background = np.median(stack[chosen], axis=0).astype(np.float32)
    height, width = background.shape[:2]
    hulls = []
    for picture in stack:
        away = cv2.GaussianBlur(_difference(picture.astype(np.float32), background), (0, 0), 0.8)
        is_new = away > max(_CLEAR * SD_OF_MEDIAN_DEVIATION * float(np.median(away)), _LEAST_GREY)
        _, labels, boxes, _ = cv2.connectedComponentsWithStats(is_new.astype(np.uint8))
        areas = boxes[1:, cv2.CC_STAT_AREA]
        hulls.append(np.zeros((0, 2)))
        if len(areas) and areas.max() > max(_LEAST_SHARE * is_new.size, 4):
            large = 1 + np.flatnonzero(areas >= _BESIDE_LARGEST * areas.max())
            points = np.argwhere(np.isin(labels, large))[:, ::-1].astype(np.int32)
            if points.min() > 0 and points[:, 0].max() < width - 1 and points[:, 1].max() < height - 1:
                hulls[-1] = cv2.convexHull(points)[:, 0].astype(float)
    return hulls


def _difference(picture: Array, background: Array) -> Array:
    """Return how far pixels differ from the background (h, w) [grey levels]; where it is only darker, by hue alone."""
    share = (picture * background).sum(axis=2) / np.maximum((background**2).sum(axis=2), 1.0)
    is_shadow = (share > _DARKEST_SHADOW) & (share < 1)
    shown = np.where(is_shadow[..., None], share[..., None] * background, background)
    return np.abs(picture - shown).max(axis=2)


def _camera_of(small: tuple[int, ...], camera: Camera, parity: int | None) -> Camera:
    """Return the camera of the small pictures (height, width) of frames or fields."""
    image = camera if parity is None else camera.field(parity)
    x, y = image.size[0] / small[1], image.size[1] / small[0]
    return image.resampled(scale=(x, y), offset=((x - 1) / 2, (y - 1) / 2), size=(small[1], small[0]))


def _rays(camera: Camera, px: Array) -> Array:
    """Return the directions (k, 3) in world axes in which pixels (k, 2) are seen."""
    straight = np.column_stack([camera.undistorted_px(px), np.ones(len(px))])
    rays = straight @ np.linalg.inv(camera.K).T @ camera.camera_from_world.rotation.as_matrix()
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)
