"""Registration of the tracked body's silhouette in one view alone, against what stands out from the empty scene.

The silhouette may be shifted, turned and scaled in the image; colours are not asked. Where a camera, the body's size or
a time is wrong, the views' silhouettes lie beside the pictures in ways that no pose explains.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.body import PosedBody
from airborne.cameras import Camera
from airborne.rendering.maps import SurfaceMaps
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.self_check.offset_equations import foreground_equations
from airborne.types import Array, Array32

_SIDES = 3**3  # that a part may face: along each of its axes forward, back or neither
N_SIMILARITY = 4  # shift right, shift down [px], turn clockwise [rad], log scale, about the silhouette's middle
_LONGEST_PX = 220  # images are reduced until the silhouette is no longer
_SHORTEST_PX = 16  # a smaller silhouette is not registered
_MARGIN = 0.45  # of the silhouette's length, around it
_NOISE_GREY = 14.0  # a pixel that differs by this from the empty scene is foreground at 1 - 1/e
_SCALES = np.exp(np.linspace(-0.18, 0.18, 7))  # of the coarse search
_TURNS = np.radians([-12, 0, 12])  # of the coarse search
_COARSE = 4  # reduction of the coarse search
_SIGMA_PX = (4.0, 2.0, 1.2)  # blurs of the fine registration, coarse to fine
_STEPS = 6  # at each blur, at most
_NEAR = 0.1  # of a blur but the last: a step that moves nothing further is its last, as the next goes on from there
CONVERGED_PX = 0.02  # a step that moves nothing further is the last; offsets err by some tenths of a pixel
_LEAST_STEEP = 0.02  # of the steepest gradient, below which a pixel is no outline
_CLIP = 0.35  # a residual of the foreground this large has a quarter of the weight
_LEAST_OVERLAP = 0.55  # correlation of silhouette and foreground below which a view says nothing
_CLEAR_OVERLAP = 0.9  # above it a silhouette is found from where it is: in 81 views of 81 as by a search
_LEAST_CONTRAST = 0.1  # of the foreground, below which nothing stands out
_FARTHEST = np.array([0.5, 0.5, 0.35, 0.3])  # offsets beyond these are mistakes [silhouettes' lengths, same, rad, log]
_LEAST_GAIN = 0.02  # correlation that a far displacement must gain to be preferred to none


@dataclass(frozen=True, slots=True)
class Silhouette:
    """A body's silhouette drawn in an image of about square pixels."""

    camera: Camera  # of that image
    mask: Array32  # (h, w) 0 or 1
    inverse_depth: Array32  # (h, w) [1/m]
    side: NDArray[np.int64]  # (h, w) which side of which part; -1 where there is none
    middle: Array  # (2,) [px] of the mask's bounding box
    box: tuple[int, int, int, int]  # x0, y0, x1, y1 of the view's image that it covers
    to_view: Array  # (2,) view pixels a pixel, right and down
    is_whole: bool  # the image's border cuts nothing off

    @property
    def part(self) -> NDArray[np.int64]:
        """The part that each pixel shows: (h, w), -1 where there is none."""
        return self.side // _SIDES


@dataclass(frozen=True, slots=True)
class SilhouetteOutline:
    """How a silhouette's outline changes by a twist of the body about its root [per m, per rad]."""

    by_twist: Array  # (4, 6) its offset
    edge: Array  # (6, 6) information of the whole outline for such a twist, in no unit
    edge_by_offset: Array  # (6, 4) the same for an outline that is offset as a whole


def draw_silhouette(render_model: RenderModel, posed: PosedBody, camera: Camera) -> Silhouette | None:
    """Draw the body in a view with a margin; None where it is too small."""
    corners = _mask_corners(render_model, posed, camera)
    if corners is None:
        return None
    low, high = corners
    size = np.array(camera.size)
    aspect = float(camera.K[1, 1] / camera.K[0, 0])
    extent = (high - low) / [1, aspect]
    length = float(extent.max())
    if length < _SHORTEST_PX:
        return None
    n = max(1, int(np.ceil(length / _LONGEST_PX)))
    margin = _MARGIN * length * np.array([1, aspect])
    x0, y0 = np.clip(np.floor(low - margin), 0, size).astype(int)
    x1, y1 = np.clip(np.ceil(high + margin), 0, size).astype(int)
    to_view = np.array([n, n * aspect])
    width, height = int((x1 - x0) / to_view[0]), int((y1 - y0) / to_view[1])
    if min(width, height) < _SHORTEST_PX:
        return None
    offset = (x0 + (to_view[0] - 1) / 2, y0 + (to_view[1] - 1) / 2)
    own = camera.resample(scale=(to_view[0], to_view[1]), offset=offset, size=(width, height))
    maps = render_model.draw(posed, own)
    mask = (maps.part >= 0).astype(np.float32)
    middle = ((low + high) / 2 - offset) / to_view
    is_whole = bool(np.all(low > 0) and np.all(high < size - 1))
    box = int(x0), int(y0), int(x1), int(y1)
    return Silhouette(own, mask, maps.inverse_depth, _sides(maps), middle, box, to_view, is_whole)


def _sides(maps: SurfaceMaps) -> NDArray[np.int64]:
    """Return a number for every side of every part, by where it faces: (h, w), -1 where there is none."""
    x, y, z = np.rint(maps.normals).astype(int)
    return np.where(maps.part >= 0, _SIDES * maps.part.astype(int) + 9 * x + 3 * y + z + 13, -1)


def _mask_corners(render_model: RenderModel, posed: PosedBody, camera: Camera) -> tuple[Array, Array] | None:
    """Return the corners of the body's mask in the image [px]; None where it is not there."""
    mask = render_model.draw(posed, camera).part >= 0
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not len(rows):
        return None
    return np.array([columns[0], rows[0]], float), np.array([columns[-1], rows[-1]], float)


def foreground(rgb: NDArray[np.uint8], empty: NDArray[np.uint8], silhouette: Silhouette) -> Array32:
    """Return how much each pixel of the silhouette's image stands out from the empty scene: (h, w), 0..1.

    rgb (H, W, 3): the view's image; empty (h', w', 3): the scene without the body, in the silhouette's box.
    """
    x0, y0, x1, y1 = silhouette.box
    d = rgb[y0:y1, x0:x1].astype(np.float32) - empty
    share = 1 - np.exp(-np.einsum("hwc,hwc->hw", d, d) / np.float32(_NOISE_GREY**2 * 3))
    return sample_box(silhouette, share)


def sample_box(silhouette: Silhouette, plane: Array32) -> Array32:
    """Sample what fills the silhouette's box in the view, (h', w') or (h', w', k), at the silhouette's pixels."""
    sx, sy = silhouette.to_view
    if sx > 1:
        plane = np.asarray(cv2.blur(plane, (int(sx), max(1, round(sy)))), np.float32)
    # pixel (i, j) of the silhouette lies at sx i + (sx - 1) / 2 of the box
    M = np.array([[sx, 0, (sx - 1) / 2], [0, sy, (sy - 1) / 2]])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    warped = cv2.warpAffine(plane, M, silhouette.camera.size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(warped, np.float32)


def register(silhouette: Silhouette, shown: Array32) -> Array | None:
    """Find the offset (4,) of the foreground `shown` (h, w) from a silhouette; None where they are not alike.

    Positive: the foreground lies right, down [px of the view's columns], turned clockwise [rad], is larger [log].
    """
    if np.ptp(shown) < _LEAST_CONTRAST:
        return None
    offset, overlap = _refine(silhouette, shown, np.zeros(N_SIMILARITY))
    if overlap < _CLEAR_OVERLAP:
        offset, overlap = _refine(silhouette, shown, _search(silhouette, shown))
    length = float(max(np.ptp(np.nonzero(silhouette.mask), axis=1)))
    if not np.all(np.abs(offset) < _FARTHEST * [length, length, 1, 1]):
        return None
    return offset * to_px(silhouette) if overlap > _LEAST_OVERLAP else None


def outline_of(silhouette: Silhouette, posed: PosedBody) -> SilhouetteOutline:
    """Differentiate a silhouette's outline."""
    C, B = _outline_derivatives(silhouette, posed)
    in_view = to_px(silhouette)
    by_twist = (np.linalg.pinv(B @ B.T, rcond=1e-12, hermitian=True) @ B @ C.T)[:N_SIMILARITY]
    return SilhouetteOutline(by_twist * in_view[:, None], C @ C.T, C @ B[:N_SIMILARITY].T / in_view)


def to_px(silhouette: Silhouette) -> Array:
    """Return what an offset (4,) in the silhouette's pixels is multiplied by to be one in the view's."""
    return np.array([silhouette.to_view[0], silhouette.to_view[0], 1, 1])


def _search(silhouette: Silhouette, shown: Array32) -> Array:
    """Find shift, turn and scale on reduced images by normalised correlation."""
    height, width = shown.shape
    size = (max(width // _COARSE, 8), max(height // _COARSE, 8))
    image = cv2.resize(shown, size, interpolation=cv2.INTER_AREA)
    best, best_score = np.zeros(4), -1.0
    pad = max(size) // 3
    padded = cv2.copyMakeBorder(image, pad, pad, pad, pad, cv2.BORDER_CONSTANT, value=0)
    for turn in _TURNS:
        for scale in _SCALES:
            candidate = np.array([0.0, 0.0, turn, np.log(scale)])
            template = cv2.resize(
                warp_plane(silhouette, candidate, silhouette.mask), size, interpolation=cv2.INTER_AREA
            )
            scores = cv2.matchTemplate(padded, template, cv2.TM_CCOEFF_NORMED)
            _, score, _, (x, y) = cv2.minMaxLoc(scores)
            if turn == 0 and np.isclose(scale, 1) and scores[pad, pad] + _LEAST_GAIN > score:
                score, (x, y) = float(scores[pad, pad]) + _LEAST_GAIN, (pad, pad)
            if score > best_score:
                shift = np.array([(x - pad) * width / size[0], (y - pad) * height / size[1]])
                best, best_score = np.array([*shift, turn, np.log(scale)]), score
    return best


def _refine(silhouette: Silhouette, shown: Array32, offset: Array) -> tuple[Array, float]:
    """Refine an offset (4,) on images less and less blurred; return it, and how silhouette and foreground correlate."""
    offset = np.append(offset, 0.0)  # the last: how much wider the outline is [px]
    for sigma in _SIGMA_PX:
        converged_px = CONVERGED_PX if sigma == _SIGMA_PX[-1] else _NEAR * sigma
        offset = _refine_at(silhouette, shown, offset, sigma, converged_px=converged_px)
    drawn = warp_plane(silhouette, offset, blur(silhouette.mask, _SIGMA_PX[-1]))
    return offset[:N_SIMILARITY], _correlation(drawn, blur(shown, _SIGMA_PX[-1]))


def _refine_at(silhouette: Silhouette, shown: Array32, offset: Array, sigma: float, *, converged_px: float) -> Array:
    """Step to the least squares of blurred silhouette and foreground, robustly.

    offset (5,): shift, turn, scale and how much wider the outline is [px of the silhouette].
    """
    image, mask = blur(shown, sigma), blur(silhouette.mask, sigma)
    reach = max(image.shape) / 2
    for _ in range(_STEPS):
        step = _refinement_step(silhouette, image, mask, offset, sigma=sigma)
        offset = offset + step
        offset[4] = np.clip(offset[4], -2, 2)
        if np.abs(step * [1, 1, reach, reach, 1]).max() < converged_px:
            break
    return offset


def _refinement_step(silhouette: Silhouette, image: Array32, mask: Array32, offset: Array, *, sigma: float) -> Array:
    """Return the step (5,) of least squares, no longer than the blur reaches."""
    drawn = warp_plane(silhouette, offset, mask)
    H, g = foreground_equations(drawn, image, silhouette.middle, offset, _CLIP, _LEAST_STEEP)
    H[np.diag_indices(5)] *= 1 + 1e-6
    H[4, 4] += 1e-9
    step = np.linalg.solve(H + 1e-9 * np.eye(5), g)
    step[:2] = np.clip(step[:2], -3 * sigma, 3 * sigma)
    step[2:4] = np.clip(step[2:4], -0.05, 0.05)
    return step


def warp_plane(silhouette: Silhouette, offset: Array, plane: Array32) -> Array32:
    """Shift, turn and scale a plane (h, w) about the silhouette's middle."""
    c, s = np.exp(offset[3]) * np.array([np.cos(offset[2]), np.sin(offset[2])])
    A = np.array([[c, -s], [s, c]])
    shift = silhouette.middle + offset[:2] - A @ silhouette.middle
    size: Any = plane.shape[::-1]
    return np.asarray(cv2.warpAffine(plane, np.column_stack([A, shift]), size, flags=cv2.INTER_LINEAR), np.float32)


def _outline_derivatives(silhouette: Silhouette, posed: PosedBody) -> tuple[Array, Array]:
    """Return how the m pixels of the outline change by a twist of the body (6, m), and by offset and width (5, m)."""
    camera = silhouette.camera
    mask = blur(silhouette.mask, _SIGMA_PX[-1])
    gx, gy = cv2.Sobel(mask, cv2.CV_32F, 1, 0, scale=1 / 8), cv2.Sobel(mask, cv2.CV_32F, 0, 1, scale=1 / 8)
    near = (np.hypot(gx, gy) > 0.05 * np.hypot(gx, gy).max()) & (silhouette.mask > 0)
    y, x = np.nonzero(near)
    gx, gy = gx[near], gy[near]
    ray = np.stack([(x - camera.K[0, 2]) / camera.K[0, 0], (y - camera.K[1, 2]) / camera.K[1, 1], np.ones(len(x))])
    points = ray / silhouette.inverse_depth[near]
    R = camera.camera_from_world.rotation.as_matrix()
    root = (R @ posed.t[0] + camera.camera_from_world.translation)[:, None]
    arms = points - root
    by_u = camera.K[0, 0] / points[2] * np.stack([np.ones(len(x)), np.zeros(len(x)), -ray[0]])  # (3, n)
    by_v = camera.K[1, 1] / points[2] * np.stack([np.zeros(len(x)), np.ones(len(x)), -ray[1]])
    normal = gx * by_u + gy * by_v  # change along the gradient by a translation in camera axes
    turning = np.cross(arms.T, normal.T).T
    C = np.concatenate([R.T @ normal, R.T @ turning])  # (6, n)
    dx, dy = x - silhouette.middle[0], y - silhouette.middle[1]
    return C, np.asarray(np.stack([gx, gy, gy * dx - gx * dy, gx * dx + gy * dy, -np.hypot(gx, gy)]), float)


def blur(plane: Array32, sigma: float) -> Array32:
    """Blur a plane (h, w), or (h, w, k), by a Gaussian [px]."""
    return np.asarray(cv2.GaussianBlur(plane, (0, 0), sigma), np.float32)


def _correlation(a: Array32, b: Array32) -> float:
    """Return the correlation of two planes; NaN where one is the same everywhere."""
    if not (np.ptp(a) and np.ptp(b)):
        return np.nan
    return float(np.corrcoef(a.ravel(), b.ravel())[0, 1])
