"""Which blobs are a wand's two markers: of two colours that are seen once each, or of one that is seen twice.

Two markers of one colour are told apart by epipolar geometry: of the two ways to pair those of two cameras, one fits.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, combinations_with_replacement

import numpy as np
from numpy.typing import NDArray

from airborne.calibration.initial.two_views import fit_epipolar_geometry
from airborne.calibration.sources.wand_blobs import Blobs
from airborne.types import Array

_SAME_COLOUR = 0.08  # difference in the shares of red and green within which blobs are of one colour
_MOST_COLOURS, _MOST_SAMPLES = 5, 3000  # colours that are tried, those of most blobs; blobs that are looked through
_FEWEST_FRAMES = 10  # in which two cameras both see both markers
_EPIPOLAR_LIMIT_SHARE = 0.003  # of an image's longer side: how far a marker may lie from its epipolar line
_MOST_GUESSES = 4  # pairs of colours that are matched between cameras, those seen together most often


def match_markers(blobs: Sequence[Sequence[Blobs]], sizes: Sequence[tuple[int, int]]) -> list[Array]:
    """Return guesses of the two markers' tracks (frames, 2, cameras, 2) [px], those of most agreement first.

    blobs: by camera, by frame. sizes: (width, height) of each camera's images [px]. NaN where a camera does not see
    both, or another one disagrees.
    """
    colours = _colours(blobs)
    guesses = [_gather(blobs, pair) for pair in combinations_with_replacement(colours, 2)]
    guesses = [px for px in guesses if _n_shared(px) >= _FEWEST_FRAMES]
    guesses = sorted(guesses, key=lambda px: -_n_shared(px))[:_MOST_GUESSES]
    matched = [_label(px, sizes) for px in guesses]
    return sorted((px for px in matched if _n_shared(px)), key=lambda px: -_n_shared(px))


def _colours(blobs: Sequence[Sequence[Blobs]]) -> list[Array]:
    """Return the colours of most blobs: the densest places, one after another."""
    every = [each.colour for own in blobs for each in own if len(each.colour)]
    colours = np.concatenate(every) if every else np.zeros((0, 3))
    colours = colours[:: max(1, len(colours) // _MOST_SAMPLES)]
    found = []
    while len(colours) >= _FEWEST_FRAMES and len(found) < _MOST_COLOURS:
        is_near = _is_like(colours[:, None], colours[None])
        densest = is_near[int(np.argmax(is_near.sum(axis=1)))]
        found.append(colours[densest].mean(axis=0))
        colours = colours[~_is_like(colours, found[-1]) & ~densest]
    return found


def _is_like(colours: Array, other: Array) -> NDArray[np.bool_]:
    return np.abs(colours - other).max(axis=-1) < _SAME_COLOUR


def _gather(blobs: Sequence[Sequence[Blobs]], pair: tuple[Array, Array]) -> Array:
    """Return where both markers are seen (frames, 2, cameras, 2) [px], of each colour as many as the wand has."""
    px = np.full((len(blobs[0]), 2, len(blobs), 2), np.nan)
    is_one = pair[0] is pair[1]
    for i, own in enumerate(blobs):
        for frame, each in enumerate(own):
            of_colour = [each.px[_is_like(each.colour, colour)] for colour in pair]
            if is_one and len(of_colour[0]) == 2:
                px[frame, :, i] = of_colour[0]
            elif not is_one and len(of_colour[0]) == len(of_colour[1]) == 1:
                px[frame, :, i] = np.concatenate(of_colour)
    return px


def _is_seen(px: Array) -> NDArray[np.bool_]:
    return np.isfinite(px[:, 0, :, 0])  # (frames, cameras)


def _n_shared(px: Array) -> int:
    """Return in how many frames two cameras or more see both markers."""
    return int((_is_seen(px).sum(axis=1) >= 2).sum())


def _label(px: Array, sizes: Sequence[tuple[int, int]]) -> Array:
    """Put the two markers of every frame in one order for all cameras, and leave out those that fit no other camera."""
    limits = [_EPIPOLAR_LIMIT_SHARE * max(size) for size in sizes]
    off = {(a, b): each for a, b, each in _pair_errors(px, limits)}
    matched = np.full(px.shape, np.nan)
    for frame, is_seen in enumerate(_is_seen(px)):
        seen = np.flatnonzero(is_seen).tolist()
        orders = [_order(frame, first, seen, off) for first in seen]
        best = max(orders, key=len, default={})
        for i, is_turned in best.items() if len(best) > 1 else ():
            matched[frame, :, i] = px[frame, ::-1, i] if is_turned else px[frame, :, i]
    return matched


def _pair_errors(px: Array, limits: Sequence[float]) -> Iterator[tuple[int, int, Array]]:
    """Yield for pairs of cameras how far off (frames, 2) the markers are as they stand, and with b's exchanged.

    1 is the limit. Of markers in no known order half of all correspondences are right, which a robust fit finds.
    """
    is_seen = _is_seen(px)
    for a, b in combinations(range(px.shape[2]), 2):
        rows = np.flatnonzero(is_seen[:, a] & is_seen[:, b])
        if len(rows) < _FEWEST_FRAMES:
            continue
        limit = max(limits[a], limits[b])
        straight, crossed = px[rows][:, :, b], px[rows][:, ::-1, b]
        of_a = px[rows][:, :, a]
        both = np.concatenate([of_a, of_a]).reshape(-1, 2), np.concatenate([straight, crossed]).reshape(-1, 2)
        geometry = fit_epipolar_geometry(*both, limit_px=limit)
        for _ in range(2):  # by all that are in order now
            if geometry is None:
                break
            errors = np.stack([_epipolar_px(geometry.F, of_a, other) for other in (straight, crossed)], axis=-1)
            other = np.where((errors[:, 1] < errors[:, 0])[:, None, None], crossed, straight)
            geometry = fit_epipolar_geometry(of_a.reshape(-1, 2), other.reshape(-1, 2), limit_px=limit)
        if geometry is not None:
            off = np.full((len(px), 2), np.inf)
            for k, other in enumerate((straight, crossed)):
                off[rows, k] = _epipolar_px(geometry.F, of_a, other) / limit
            yield a, b, off


def _epipolar_px(F: Array, px_a: Array, px_b: Array) -> Array:
    """Return the larger distance [px] of two markers (n, 2, 2) from their epipolar lines (Sampson's approximation)."""
    a, b = (np.concatenate([px, np.ones((*px.shape[:-1], 1))], axis=-1) for px in (px_a, px_b))
    line_b, line_a = a @ F.T, b @ F
    slope = np.sqrt((line_b[..., :2] ** 2).sum(axis=-1) + (line_a[..., :2] ** 2).sum(axis=-1))
    return (np.abs((b * line_b).sum(axis=-1)) / np.maximum(slope, 1e-12)).max(axis=-1)


def _order(frame: int, first: int, seen: Sequence[int], off: dict[tuple[int, int], Array]) -> dict[int, bool]:
    """Return which cameras agree with the first, each with whether its markers are exchanged."""
    turned = {first: False}
    for i in seen:
        errors = np.zeros(2)
        known = [(j, off[min(i, j), max(i, j)][frame]) for j in turned if (min(i, j), max(i, j)) in off]
        for j, each in known:
            errors = np.maximum(errors, each[::-1] if turned[j] else each)
        if i not in turned and known and errors.min() < 1:
            turned[i] = bool(errors[1] < errors[0])
    return turned
