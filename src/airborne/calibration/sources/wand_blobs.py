"""Round blobs that move: brighter, or more colourful, than what is behind them. Candidates for a wand's markers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.types import Array, Image

_LIFT = 40  # grey levels by which a blob is brighter, or more colourful, than its background
_SMALLEST_PX, _LARGEST_SHARE = 8, 0.01  # area of a blob [px], and as a share of the image's
_LEAST_FILL = 0.85  # area over that of the ellipse with the same second moments
_LEAST_ROUND = 0.4  # shorter over longer axis of that ellipse; a blurred marker is drawn out
_MOST_BLOBS = 40  # of an image, the roundest; more are noise


@dataclass(frozen=True, slots=True, eq=False)
class Blobs:
    """The blobs of one image."""

    px: Array  # (n, 2) centres [px]
    colour: Array  # (n, 3) shares of red and green in the light, and 1 if it is colourful, 0 if it is white


NO_BLOBS = Blobs(np.zeros((0, 2)), np.zeros((0, 3)))


def background_of(images: Sequence[Image]) -> NDArray[np.uint8]:
    """Return whiteness and colourfulness (h, w, 2) where nothing moves: the medians of images (h, w, 3) sRGB."""
    maps = np.stack([_maps(rgb) for rgb in images])
    return np.partition(maps, len(maps) // 2, axis=0)[len(maps) // 2]


def find_blobs(rgb: Image, background: NDArray[np.uint8]) -> Blobs:
    """Find the blobs of an image (h, w, 3) sRGB before its background."""
    lifts = np.asarray(cv2.subtract(_maps(rgb), background), np.uint8)
    found = [each for i in (0, 1) for each in _blobs_of(rgb, lifts[..., i], is_colourful=bool(i))]
    if not found:
        return NO_BLOBS
    best = sorted(found, key=lambda each: -each[0])[:_MOST_BLOBS]
    return Blobs(np.array([px for _, px, _ in best]), np.array([colour for _, _, colour in best]))


def _maps(rgb: Image) -> NDArray[np.uint8]:
    """Return how white and how colourful each pixel is: the least of its three values, and the most above it."""
    red, green, blue = cv2.split(rgb)
    least = cv2.min(cv2.min(red, green), blue)
    most = cv2.max(cv2.max(red, green), blue)
    return np.stack([least, cv2.subtract(most, least)], axis=-1).astype(np.uint8, copy=False)


def _blobs_of(rgb: Image, lift: NDArray[np.uint8], *, is_colourful: bool) -> list[tuple[float, Array, Array]]:
    """Return the fill, the centre [px] and the colour of each round blob in a map of lifts."""
    n, labels, stats, _ = cv2.connectedComponentsWithStats((lift > _LIFT).astype(np.uint8))
    largest = _LARGEST_SHARE * lift.size
    found = []
    for i in range(1, n):
        x, y, width, height, area = stats[i].tolist()
        if not _SMALLEST_PX <= area <= largest:
            continue
        part = np.s_[y : y + height, x : x + width]
        own = np.where(labels[part] == i, lift[part], 0).astype(float)
        core = own > own.max() / 2  # without what is dimmer beside it, such as a hand
        area, (v, u) = np.count_nonzero(core), np.nonzero(core)
        if area < _SMALLEST_PX:
            continue
        variances = np.linalg.eigvalsh(np.cov(u, v) + np.eye(2) / 12)  # that of a pixel's own area
        fill = area / (4 * np.pi * np.sqrt(variances[0] * variances[1]))
        if fill < _LEAST_FILL or variances[0] < _LEAST_ROUND**2 * variances[1]:
            continue
        rim_v, rim_u = np.nonzero(cv2.dilate(core.astype(np.uint8), np.ones((3, 3), np.uint8)))
        weights = lift[part][rim_v, rim_u]
        centre = np.array([x, y]) + np.average(np.stack([rim_u, rim_v], axis=1), axis=0, weights=weights)
        light = rgb[part][v, u].sum(axis=0, dtype=float)
        found.append((float(fill), centre, np.array([*light[:2] / max(light.sum(), 1.0), float(is_colourful)])))
    return found
