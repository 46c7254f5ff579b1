"""Synchronisation by motion: the shifts at which the silhouettes of what moves agree by epipolar geometry.

Each camera's images are compared with their own median; what differs is a silhouette. Two cameras and a point span a
plane through both centres, and of all such planes the outermost ones that touch a moving thing do so in both images
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

from airborne.appearance.empty_scene import difference
from airborne.cameras import Camera, Rig
from airborne.errors import VideoError, count
from airborne.geometry.robust import SD_OF_MEDIAN_DEVIATION, covariance_of_sum
from airborne.sync.offsets import Offsets, image_counter
from airborne.types import Array, Progress
from airborne.video.decoding import DecodedImage, VideoFacts, VideoSource, decode, inspect, rgb_from_decoded

OnImage = Callable[[], None]

_WIDTH_PX = 320  # of the images compared [px]
MOST_IMAGES = 1500  # chosen: images read
_N_BACKGROUND = 60  # images that the median is made of
_LEAST_SDS = 5.0  # robust sds of the static scene
_LEAST_GREY = 8.0  # grey levels by which something must differ in any case
_LEAST_SHARE = 2e-4  # of the image that must differ
_LEAST_OF_LARGEST = 0.25  # regions smaller than this share of the largest are ignored
_HALF_WINDOW = 3  # images on either side of a smoothed one
_SCALE_RAD = 0.003  # of the robust cost: between two cameras' tangent planes
_LEAST_MOMENTS = 6  # moments that two cameras share
_MOST_LOST = 10  # chosen: images by which halves of a video are shifted
# of the mean cost, by which one half fits better with another shift; in right recordings of three throws and three
# blocks 0.24 at most, where three of 34 images are missing 1.75, where one is 1.14
_CLEAR_GAIN = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Silhouettes:
    """What moves in the images of one camera."""

    camera: Camera
    time_s: Array  # (n,) since its first image
    hulls: tuple[Array, ...]  # n of (k, 3): rays to the silhouette's convex hull, in world axes; (0, 3) where none
    period_s: float


def offsets_by_motion(
    sources: Sequence[VideoSource],
    rig: Rig,
    *,
    within_s: float = 1.0,
    progress: Progress | None = None,
) -> Offsets:
    """Find the offsets at which the silhouettes of what moves fit one scene.

    Shifts up to `within_s` either way are tried, by half images, then between them. The sds come from the scatter and
    take neighbouring images to err alike. Raises VideoError where nothing moves in a camera, where no shift fits, or
    another one before some moment than after it.
    """
    on_image = image_counter(progress)
    silhouettes = [silhouettes_of(source, camera, on_image) for source, camera in zip(sources, rig, strict=True)]
    still = [each.camera.name for each in silhouettes if sum(len(hull) > 0 for hull in each.hulls) < _LEAST_MOMENTS]
    if still:
        raise VideoError(
            f"nothing is seen to move in {', '.join(still)}; synchronise by flash or sound, or check the videos"
        )
    offset_s, sd_s = solve_shifts(silhouettes, within_s)
    unknown = [name for name, sd in zip(rig.names, sd_s, strict=True) if not np.isfinite(sd)]
    if unknown:
        raise VideoError(
            f"{', '.join(unknown)}: no shift within {within_s:g} s brings its motion together with the other cameras'; "
            "widen the search, or synchronise by flash or sound"
        )
    refuse_lost_images(silhouettes, offset_s)
    zeros = np.zeros(len(rig))
    return Offsets(rig.names, offset_s, sd_s, zeros, zeros, how="by what moves before the cameras")


def silhouettes_of(source: VideoSource, camera: Camera, on_image: OnImage = lambda: None) -> Silhouettes:
    """Segment what moves in one camera's first 1500 images; `on_image` is called after each."""
    facts = inspect(source)
    times, small, parities = [], [], []
    for image in decode(source, facts):
        times.append(float(image.time_s))
        small.append(_shrink(image, facts))
        parities.append(image.parity)
        on_image()
        if len(times) == MOST_IMAGES:
            break
    hulls: list[Array] = [np.zeros((0, 3))] * len(times)
    for parity in set(parities):
        rows = [k for k, each in enumerate(parities) if each == parity]
        stack = np.stack([small[k] for k in rows])
        small_camera = _shrunk_camera(stack.shape[1:3], camera, parity)
        for k, hull in zip(rows, _hulls(stack), strict=True):
            hulls[k] = _rays(small_camera, hull)
    return Silhouettes(camera, np.array(times), tuple(hulls), float(1 / facts.image_rate))


def solve_shifts(silhouettes: Sequence[Silhouettes], within_s: float) -> tuple[Array, Array]:
    """Return what to add to each camera's times (c,) [s], the first's nothing, and the sds (c,); inf where unknown."""
    pairs = [_EpipolarPair.of(silhouettes, a, b) for a, b in combinations(range(len(silhouettes)), 2)]
    n, offset_s = len(silhouettes) - 1, np.zeros(len(silhouettes))
    for new in range(1, len(silhouettes)):
        step_s = min(silhouettes[new].period_s, silhouettes[0].period_s) / 2
        shifts = np.arange(-np.ceil(within_s / step_s), np.ceil(within_s / step_s) + 1) * step_s
        with_earlier = [pair for pair in pairs if pair.second == new and pair.first < new]
        costs = [
            np.mean([_cost(pair.residuals(shift - offset_s[pair.first])) for pair in with_earlier]) for shift in shifts
        ]
        if not np.isfinite(costs).any():
            return offset_s, np.concatenate([np.zeros(new), np.full(len(silhouettes) - new, np.inf)])
        offset_s[new] = shifts[int(np.argmin(costs))]
    period_s = min(each.period_s for each in silhouettes)

    def residuals(free_s: Array) -> Array:
        tried = np.concatenate([[0.0], free_s])
        return np.concatenate([pair.residuals(tried[pair.second] - tried[pair.first]) for pair in pairs])

    around = np.vstack([np.eye(n), -np.eye(n), np.zeros((1, n))]) * period_s
    is_finite = np.all([np.isfinite(residuals(offset_s[1:] + change)) for change in around], axis=0)

    def in_scale(free_s: Array) -> Array:
        return np.nan_to_num(residuals(free_s)[is_finite]) / _SCALE_RAD

    near = offset_s[1:] - period_s, offset_s[1:] + period_s
    solution = least_squares(in_scale, offset_s[1:], bounds=near, loss="cauchy", x_scale=period_s)
    return np.concatenate([[0.0], solution.x]), np.concatenate([[0.0], _sd(in_scale, solution.x, period_s / 8)])


def refuse_lost_images(silhouettes: Sequence[Silhouettes], offset_s: Array) -> None:
    """Raise VideoError where half of a camera's motion fits that of the others with another shift, by images."""
    pairs = [_EpipolarPair.of(silhouettes, a, b) for a, b in combinations(range(len(silhouettes)), 2)]
    for number, own in enumerate(silhouettes):
        mine = [(pair, -1 if pair.first == number else 1) for pair in pairs if number in (pair.first, pair.second)]
        times = [pair.time_s + offset_s[pair.first] for pair, _ in mine]
        by_shift = []
        for n_images in range(-_MOST_LOST, _MOST_LOST + 1):
            shifts = [offset_s[p.second] - offset_s[p.first] + sign * n_images * own.period_s for p, sign in mine]
            by_shift.append([pair.residuals(shift) for (pair, _), shift in zip(mine, shifts, strict=True)])
        stays = by_shift[_MOST_LOST]
        is_seen = [np.isfinite(r).reshape(-1, 2).all(axis=1) for r in stays]
        seen_s = np.sort(np.concatenate([t[seen] for t, seen in zip(times, is_seen, strict=True)]))
        if len(seen_s) < 4 * _LEAST_MOMENTS:
            continue
        middle_s = float(np.median(seen_s))
        for is_first_half in (True, False):
            rows = [np.repeat((t < middle_s) == is_first_half, 2) for t in times]
            costs = [_cost(np.concatenate([r[k] for r, k in zip(each, rows, strict=True)])) for each in by_shift]
            n_lost = int(np.argmin(costs)) - _MOST_LOST
            if n_lost and costs[_MOST_LOST] - min(costs) > _CLEAR_GAIN:
                when, other = ("before", "after") if is_first_half else ("after", "before")
                n_later = f"{count(abs(n_lost), 'image')} {'later' if n_lost > 0 else 'earlier'}"
                raise VideoError(
                    f"{own.camera.name}: {when} {middle_s:.2f} s or so, its motion fits the other cameras' {n_later} "
                    f"than {other} it: images seem to be missing, or there twice, in the middle of a video; export it "
                    "again with all its images and times"
                )


@dataclass(frozen=True, slots=True, eq=False)
class _EpipolarPair:
    """The epipolar tangent planes of two cameras over time: angles about the baseline [rad]."""

    first: int
    second: int
    time_s: Array  # (n,) of the first camera
    angles: Array  # (n, 2) lowest and highest, smoothed
    other_time_s: Array  # (m,)
    other_angles: Array  # (m, 2) as seen
    other_period_s: float

    @classmethod
    def of(cls, silhouettes: Sequence[Silhouettes], first: int, second: int) -> _EpipolarPair:
        """Measure the tangent planes of two cameras."""
        a, b = silhouettes[first], silhouettes[second]
        axes = _axes_across(b.camera.centre - a.camera.centre, a, b)
        extents = [_tangent_angles(each, axes) for each in (a, b)]
        smooth = smooth_at(a.time_s, extents[0], a.time_s, a.period_s)
        return cls(first, second, a.time_s, smooth, b.time_s, extents[1], b.period_s)

    def residuals(self, shift_s: float) -> Array:
        """Return the angles between the planes (2 n,) [rad] with a shift of the second camera's times; NaN: unseen."""
        other = smooth_at(self.other_time_s, self.other_angles, self.time_s - shift_s, self.other_period_s)
        return (self.angles - other).ravel()


def smooth_at(time_s: Array, values: Array, at_s: Array, period_s: float) -> Array:
    """Smooth values (n, d) by local parabolas (tricube weights), and evaluate them at other times: (m, d).

    NaN outside, and where too few values are near. Every time is smoothed alike, so that none is preferred.
    """
    distance = (time_s - at_s[:, None]) / ((_HALF_WINDOW + 0.5) * period_s)
    weight = np.where(np.isfinite(values).all(axis=1), np.maximum(1 - np.abs(distance) ** 3, 0) ** 3, 0)
    powers = np.stack([np.ones_like(distance), distance, distance**2], axis=2)
    A = np.einsum("mn,mni,mnj->mij", weight, powers, powers)
    b = np.einsum("mn,mni,nk->mik", weight, powers, np.nan_to_num(values))
    is_known = ((weight * (distance <= 0)).sum(axis=1) > 1) & ((weight * (distance >= 0)).sum(axis=1) > 1)
    A[~is_known] = np.eye(3)
    values_at = np.asarray(np.linalg.solve(A, b), float)[:, 0]
    return np.where(is_known[:, None], values_at, np.nan)


def _axes_across(baseline: Array, a: Silhouettes, b: Silhouettes) -> Array:
    """Return two axes (2, 3) perpendicular to the baseline, the first toward what moves."""
    along = baseline / np.linalg.norm(baseline)
    toward = np.concatenate([*a.hulls, *b.hulls]).mean(axis=0)
    u: Array = toward - (toward @ along) * along
    u /= np.linalg.norm(u)
    return np.stack([u, np.cross(along, u)])


def _tangent_angles(silhouettes: Silhouettes, axes: Array) -> Array:
    """Return the lowest and highest plane of each silhouette (n, 2) [rad]; NaN where there is none."""
    angles = np.full((len(silhouettes.hulls), 2), np.nan)
    for k, hull in enumerate(silhouettes.hulls):
        if len(hull):
            x, y = axes @ hull.T
            angle = np.arctan2(y, x)
            if np.ptp(angle) < np.pi / 2:
                angles[k] = angle.min(), angle.max()
    return angles


def _sd(residual: Callable[[Array], Array], x: Array, step: float) -> Array:
    """Return the sandwich sds (d,): robust curvature, and scores whose neighbours are correlated."""
    at, columns = residual(x), []
    for i in range(len(x)):
        change = np.eye(len(x))[i] * step
        columns.append((residual(x + change) - residual(x - change)) / (2 * step))
    J = np.stack(columns, axis=1)
    weight = 1 / (1 + at**2)
    H = J.T @ (weight[:, None] * J)
    if np.any(np.diag(H) <= 0) or np.linalg.cond(H) > 1e12:
        return np.full(len(x), np.inf)
    scores, inverse = (weight * at)[:, None] * J, np.linalg.inv(H)
    covariance = covariance_of_sum(scores, 2 * 2 * _HALF_WINDOW)  # two planes a moment
    return np.sqrt(np.maximum(np.diag(inverse @ covariance @ inverse), 0))


def _cost(residuals: Array) -> float:
    finite = residuals[np.isfinite(residuals)]
    return float(np.mean(np.log1p((finite / _SCALE_RAD) ** 2))) if len(finite) >= 2 * _LEAST_MOMENTS else np.inf


def _shrink(image: DecodedImage, facts: VideoFacts) -> NDArray[np.uint8]:
    rgb = rgb_from_decoded(image, facts)
    height, width = rgb.shape[:2]
    scale = min(_WIDTH_PX / width, 1.0)
    size = round(width * scale), max(1, round(height * scale * (1 if image.parity is None else 2)))
    return np.asarray(
        cv2.resize(rgb, size, interpolation=cv2.INTER_AREA if scale < 0.5 else cv2.INTER_LINEAR), np.uint8
    )


def _hulls(stack: NDArray[np.uint8]) -> list[Array]:
    """Return the hull of what is not in the median, in small pixels: n of (k, 2); (0, 2) where cut by the border."""
    sample = np.unique(np.linspace(0, len(stack) - 1, min(_N_BACKGROUND, len(stack))).round().astype(int))
    background = np.median(stack[sample], axis=0).astype(np.float32)
    height, width = background.shape[:2]
    hulls = []
    for image in stack:
        distance = cv2.GaussianBlur(difference(image, background), (0, 0), 0.8)
        is_new = distance > max(_LEAST_SDS * SD_OF_MEDIAN_DEVIATION * float(np.median(distance)), _LEAST_GREY)
        _, labels, boxes, _ = cv2.connectedComponentsWithStats(is_new.astype(np.uint8))
        areas = boxes[1:, cv2.CC_STAT_AREA]
        hulls.append(np.zeros((0, 2)))
        if len(areas) and areas.max() > max(_LEAST_SHARE * is_new.size, 4):
            large = 1 + np.flatnonzero(areas >= _LEAST_OF_LARGEST * areas.max())
            points = np.argwhere(np.isin(labels, large))[:, ::-1].astype(np.int32)
            if points.min() > 0 and points[:, 0].max() < width - 1 and points[:, 1].max() < height - 1:
                hulls[-1] = cv2.convexHull(points)[:, 0].astype(float)
    return hulls


def _shrunk_camera(small: tuple[int, ...], camera: Camera, parity: int | None) -> Camera:
    """Return the camera of the small images (height, width) of frames or fields."""
    image = camera if parity is None else camera.field(parity)
    x, y = image.size[0] / small[1], image.size[1] / small[0]
    return image.resample(scale=(x, y), offset=((x - 1) / 2, (y - 1) / 2), size=(small[1], small[0]))


def _rays(camera: Camera, px: Array) -> Array:
    """Return the directions (k, 3) in world axes in which pixels (k, 2) are seen."""
    straight = np.column_stack([camera.undistort_px(px), np.ones(len(px))])
    rays = straight @ np.linalg.inv(camera.K).T @ camera.camera_from_world.rotation.as_matrix()
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)
