"""Registration by light: the offset at which the body's sides, blurred into the empty scene, give the image.

What stands out from a scene reaches further out the brighter the body is against it, for a lens mixes both near the
outline: silhouettes lie towards the lamps, by 0.2 px at a blur of 0.8 px, which of a late camera is 1 ms. Here the
mixture itself is modelled, in linear light (Porter & Duff 1984): every side has one light, the body hides the scene.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.rendering.srgb import light_from_srgb
from airborne.tracking.self_check.offset_equations import light_equations, light_residuals, mixture_equations
from airborne.tracking.self_check.registration import (
    CONVERGED_PX,
    N_SIMILARITY,
    Silhouette,
    blur,
    sample_box,
    to_px,
    warp_plane,
)
from airborne.types import Array, Array32, Ints

_LIGHT = light_from_srgb(np.arange(256.0)).astype(np.float32)
_SIDE_SHARE = 0.02  # of the silhouette that a side covers at least to have a light of its own
_BLURS_PX = (0.5, 0.8, 1.2, 1.7)  # sds of the image's blur, of which the likeliest is taken
_TO_MEDIAN = 0.05  # pixels of the body's median light that are added to those of a side
# a residual of so many medians has a quarter of the weight: as exact as 98 % of the pixels would be by least squares,
# were residuals Gaussian; of six synthetic throws, camera times err by 0.10 ms, with 2.8 medians 0.16, with 7 0.10
_CLIP_MEDIANS = 4.0
_MOST_STEPS = 6  # at the likeliest blur
_LEAST_MIXED = 1 / 255  # of a share times the rest of the pixel, at the widest blur: less changes no grey level
_MARGIN_PX = 8  # about the silhouette
_MOST_PX, _MOST_TURN = 2.0, 0.05  # of one step: shift and width, turn and scale
_LEAST_SQUARE = 1e-12  # keeps quotients finite


def register_light(silhouette: Silhouette, offset: Array, rgb: NDArray[np.uint8], empty: NDArray[np.uint8]) -> Array:
    """Refine an offset (4,) of `register` by the light of a body in one piece.

    rgb (H, W, 3): the view's image; empty (h', w', 3): the scene without the body, in the silhouette's box.
    """
    x0, y0, x1, y1 = silhouette.box
    light = sample_box(silhouette, _LIGHT[rgb[y0:y1, x0:x1]])
    scene = sample_box(silhouette, _LIGHT[empty])
    offset = np.append(offset / to_px(silhouette), 0.0)  # the last: how much wider the outline is [px]
    window = _window(silhouette, offset)
    silhouette, light, scene = _crop(silhouette, window), light[window], scene[window]
    sides = _sides(silhouette)
    drawn = [warp_plane(silhouette, offset, side) for side in sides]
    near = _near_edges(drawn)
    light, scene = light[near], scene[near]
    inside = np.sum(drawn, axis=0)[near] > 0.5
    median = np.median(light[inside], axis=0)
    args = *near, light, scene
    squares = []
    for sigma in _BLURS_PX:
        shares = _blur_shares(silhouette, drawn, sigma)
        squares.append(light_residuals(shares, _light_of_sides(shares, *args, median), *args))
    clip2 = _CLIP_MEDIANS**2 * max(min(float(np.median(each)) for each in squares), _LEAST_SQUARE)
    sigma = _BLURS_PX[int(np.argmin([np.sum(each / (clip2 + each)) for each in squares]))]
    for _ in range(_MOST_STEPS):
        shares = _blur_shares(silhouette, [warp_plane(silhouette, offset, side) for side in sides], sigma)
        own = _light_of_sides(shares, *args, median)
        step = _step(*light_equations(shares, own, *args, silhouette.middle, offset, clip2))
        offset = offset + step
        if np.hypot(step[0], step[1]) < CONVERGED_PX:
            break
    return offset[:N_SIMILARITY] * to_px(silhouette)


def _window(silhouette: Silhouette, offset: Array) -> tuple[slice, slice]:
    """Return rows and columns around the silhouette, where it was drawn and at its offset."""
    both = np.maximum(silhouette.mask, warp_plane(silhouette, offset, silhouette.mask)) > 0
    x, y, width, height = cv2.boundingRect(both.astype(np.uint8))
    low, high = np.maximum([y - _MARGIN_PX, x - _MARGIN_PX], 0), (y + height + _MARGIN_PX, x + width + _MARGIN_PX)
    return slice(low[0], high[0]), slice(low[1], high[1])


def _crop(silhouette: Silhouette, window: tuple[slice, slice]) -> Silhouette:
    middle = silhouette.middle - [window[1].start, window[0].start]
    return replace(silhouette, mask=silhouette.mask[window], side=silhouette.side[window], middle=middle)


def _near_edges(drawn: list[Array32]) -> tuple[Ints, Ints]:
    """Return rows and columns (n,) of the pixels that the widest blur mixes of sides, or a side and the scene."""
    shares = [blur(side, _BLURS_PX[-1]) for side in drawn]
    mixed = np.max([share * (1 - share) for share in shares], axis=0)
    rows, columns = np.nonzero(mixed > _LEAST_MIXED)
    return rows, columns


def _sides(silhouette: Silhouette) -> list[Array32]:
    """Return the masks (h, w) of the sides that the silhouette shows; the last: small ones."""
    is_body = silhouette.side >= 0
    labels, counts = np.unique(silhouette.side[is_body], return_counts=True)
    sides = [silhouette.side == label for label in labels[counts >= _SIDE_SHARE * is_body.sum()]]
    rest = is_body & ~np.any(sides, axis=0)
    return [side.astype(np.float32) for side in (*sides, rest) if side.any()]


def _blur_shares(silhouette: Silhouette, drawn: list[Array32], sigma: float) -> Array32:
    """Return each drawn side's share of every pixel of a blurred image: (k, h, w)."""
    sx, sy = silhouette.to_view
    sigma_y = float(np.hypot(sigma, 0 if sy >= sx else np.sqrt(3) / 4 * sx / sy))  # rows of fields are interpolated
    return np.stack([np.asarray(cv2.GaussianBlur(side, (0, 0), sigma, sigmaY=sigma_y), np.float32) for side in drawn])


def _light_of_sides(
    shares: Array32, rows: Ints, columns: Ints, light: Array32, scene: Array32, median: Array32
) -> Array:
    """Return the sides' light (k, 3) that gives the n pixels best; `median` (3,) is that of the body."""
    A, B = mixture_equations(shares, rows, columns, light, scene)
    return np.linalg.solve(A + _TO_MEDIAN * np.eye(len(A)), B + _TO_MEDIAN * median)


def _step(H: Array, g: Array) -> Array:
    """Return a Gauss-Newton step of the offset (5,) by its normal equations."""
    step = np.linalg.solve(H + 1e-6 * np.diag(np.diag(H)) + 1e-9 * np.eye(len(H)), g)
    most = np.array([_MOST_PX, _MOST_PX, _MOST_TURN, _MOST_TURN, _MOST_PX])
    return np.asarray(np.clip(step, -most, most), float)
