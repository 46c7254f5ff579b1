"""Background models: the empty scene in each camera, learned from the pixels that the body does not cover."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.kernels import kernel
from airborne.types import Array32

START_SD = 6.0  # [grey levels] of a pixel that was observed once
TILE_PX = 128  # chosen: side of the tiles that a learned background shares with the one before
_MIN_RATE = 0.05  # least weight of a pixel's newest observation, so that slow changes of light are followed


class BackgroundPixels(NamedTuple):
    """What is known of the background of some pixels [sRGB grey levels]."""

    mean: Array32  # (h, w, 3)
    sd: Array32  # (h, w)
    n_observations: Array32  # (h, w)


_Tile = Array32  # (h, w, 5): a pixel's mean (3), sd, number of observations, in one array to be copied fast
_Slices = tuple[slice, slice]
_UNKNOWN: _Tile = np.zeros((TILE_PX, TILE_PX, 5), np.float32)
_UNKNOWN[..., 3] = START_SD


@dataclass(frozen=True, slots=True, eq=False)
class FirstImage:
    """A whole image that a background is learned from, tile by tile, each when it is first asked for."""

    rgb: NDArray[np.uint8]  # (h, w, 3)
    covered: NDArray[np.bool_]  # (h, w) where the body may be
    tiles: dict[tuple[int, int], _Tile] = field(default_factory=dict)

    def tile(self, at: tuple[int, int]) -> _Tile:
        """Return what the image says of a tile."""
        if at not in self.tiles:
            rows, columns = (slice(TILE_PX * k, TILE_PX * (k + 1)) for k in at)
            rgb, tile = self.rgb[rows, columns], _UNKNOWN.copy()
            update_background(rgb, self.covered[rows, columns], tile[: rgb.shape[0], : rgb.shape[1]])
            self.tiles[at] = tile
        return self.tiles[at]


@dataclass(frozen=True, slots=True, eq=False)
class BackgroundModel:
    """The background in one camera; a value, kept in tiles: one that has learned shares all other tiles with the old.

    A region is its first pixel (x, y) and its size (height, width).
    """

    tiles: Mapping[tuple[int, int], _Tile] = field(default_factory=dict)  # learned since, by row and column
    first: FirstImage | None = None  # that tells of all other tiles; None: nothing is known of them

    def crop(self, corner: tuple[int, int], size: tuple[int, int]) -> BackgroundPixels:
        """Copy what is known of a region."""
        known = np.empty((*size, 5), np.float32)
        for tile, in_region, in_tile in self.tiles_of(corner, size):
            known[in_region] = tile[in_tile]
        return BackgroundPixels(known[..., :3], known[..., 3], known[..., 4])

    def tiles_of(self, corner: tuple[int, int], size: tuple[int, int]) -> Iterator[tuple[_Tile, _Slices, _Slices]]:
        """Yield the tiles that a region touches, and what they share, in the region and in the tile."""
        for at, in_region, in_tile in _tiles_of(corner, size):
            yield self._tile(at), in_region, in_tile

    def learn(self, rgb: NDArray[np.uint8], covered: NDArray[np.bool_], corner: tuple[int, int]) -> BackgroundModel:
        """Learn from a region's image rgb (h, w, 3); covered (h, w) where the body may be."""
        learned = dict(self.tiles)
        for at, in_region, in_tile in _tiles_of(corner, covered.shape):
            learned[at] = self._tile(at).copy()
            update_background(rgb[in_region], covered[in_region], learned[at][in_tile])
        return BackgroundModel(learned, self.first)

    def _tile(self, at: tuple[int, int]) -> _Tile:
        if (tile := self.tiles.get(at)) is not None:
            return tile
        return _UNKNOWN if self.first is None else self.first.tile(at)


def _tiles_of(corner: tuple[int, int], size: tuple[int, int]) -> Iterator[tuple[tuple[int, int], _Slices, _Slices]]:
    """Return the tiles that a region touches: row and column, and what they share, in the region and in the tile."""
    (x0, y0), (height, width) = corner, size
    for row in range(y0 // TILE_PX, -(-(y0 + height) // TILE_PX)):
        v = TILE_PX * row
        top, bottom = max(y0, v), min(y0 + height, v + TILE_PX)
        for column in range(x0 // TILE_PX, -(-(x0 + width) // TILE_PX)):
            u = TILE_PX * column
            left, right = max(x0, u), min(x0 + width, u + TILE_PX)
            yield (
                (row, column),
                np.s_[top - y0 : bottom - y0, left - x0 : right - x0],
                np.s_[top - v : bottom - v, left - u : right - u],
            )


# one signature for whole images and for regions of them: rounding is the same whichever a process meets first
@kernel(signature="(u1[:,:,:], b1[:,:], f4[:,:,:])", fastmath=True)
def update_background(rgb, covered, known):
    """Learn from one image: rgb (h, w, 3) uint8, covered (h, w) bool where the body may be; known (h, w, 5) in place.

    A pixel's five numbers are its mean (3) and sd, in grey levels, and how often it was observed.
    """
    h, w, _ = rgb.shape
    for y in range(h):
        for x in range(w):
            if covered[y, x]:
                continue
            n = int(known[y, x, 4])
            if n == 0:
                for k in range(3):
                    known[y, x, k] = rgb[y, x, k]
            else:
                rate = max(np.float32(1.0) / (n + 1), np.float32(_MIN_RATE))
                d2 = np.float32(0)
                for k in range(3):
                    d = rgb[y, x, k] - known[y, x, k]
                    known[y, x, k] += rate * d
                    d2 += d * d
                variance = known[y, x, 3] * known[y, x, 3]
                known[y, x, 3] = np.sqrt(max(variance + rate * (d2 / 3 - variance), np.float32(4.0)))
            known[y, x, 4] = min(n + 1, 250)


@kernel(fastmath=True)
def certainty_of(sd, n_observations, out):
    """Fill out (h, w) with each pixel's certainty, (START_SD / sd)^2 up to 1; return whether all were observed."""
    h, w = sd.shape
    one, start_variance, n_unknown = np.float32(1), np.float32(START_SD**2), 0
    for y in range(h):
        for x in range(w):
            out[y, x] = min(one, start_variance / (sd[y, x] * sd[y, x]))
            n_unknown += n_observations[y, x] <= 0
    return n_unknown == 0


@kernel(fastmath=True)
def inpaint(mean, n_observations, out):
    """Copy mean (h, w, 3) to out and grow observed pixels into the others, ring by ring; False if none was observed."""
    h, w, _ = mean.shape
    done = np.zeros((h, w), np.uint8)
    queue = np.empty(h * w, np.int32)
    tail = 0
    for y in range(h):
        for x in range(w):
            done[y, x] = n_observations[y, x] > 0
            for k in range(3):
                out[y, x, k] = mean[y, x, k]
    for y in range(h):
        for x in range(w):
            if not done[y, x] and _count_done_neighbours(done, y, x) > 0:
                done[y, x] = 2
                queue[tail] = y * w + x
                tail += 1
    if tail == 0:
        return done[0, 0] > 0
    head = 0
    while head < tail:
        ring_end = tail
        for i in range(head, ring_end):
            y, x = queue[i] // w, queue[i] % w
            n, s0, s1, s2 = 0, np.float32(0), np.float32(0), np.float32(0)
            for dy in range(-1, 2):
                for dx in range(-1, 2):
                    yy, xx = y + dy, x + dx
                    if 0 <= yy < h and 0 <= xx < w and done[yy, xx] == 1:
                        n += 1
                        s0 += out[yy, xx, 0]
                        s1 += out[yy, xx, 1]
                        s2 += out[yy, xx, 2]
            out[y, x, 0], out[y, x, 1], out[y, x, 2] = s0 / n, s1 / n, s2 / n
        for i in range(head, ring_end):
            done[queue[i] // w, queue[i] % w] = 1
        for i in range(head, ring_end):
            y, x = queue[i] // w, queue[i] % w
            for dy in range(-1, 2):
                for dx in range(-1, 2):
                    yy, xx = y + dy, x + dx
                    if 0 <= yy < h and 0 <= xx < w and done[yy, xx] == 0:
                        done[yy, xx] = 2
                        queue[tail] = yy * w + xx
                        tail += 1
        head = ring_end
    return True


@kernel(is_inner=True)
def _count_done_neighbours(done, y, x):
    h, w = done.shape
    n = 0
    for dy in range(-1, 2):
        for dx in range(-1, 2):
            yy, xx = y + dy, x + dx
            if 0 <= yy < h and 0 <= xx < w and done[yy, xx] == 1:
                n += 1
    return n
