"""Common to all smoothers: the split into stretches that end at events and gaps, and the smoothed result.

Arrays in, arrays out. A smoother gets one stretch at a time, so nothing leaks across a take-off or landing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from airborne.types import Array

MIN_FRAMES = 5  # known frames of a stretch; shorter ones stay unknown
_SLACK = 0.5  # of a period, by which a gap may exceed the limit


@dataclass(frozen=True, slots=True, eq=False)
class SmoothedPaths:
    """Paths (n, k) with first and second derivatives and standard deviations; NaN where unknown.

    The standard deviations are those of the stated noise after smoothing; they exclude the bias of smoothing.
    """

    value: Array
    velocity: Array
    acceleration: Array
    value_sd: Array
    velocity_sd: Array
    acceleration_sd: Array

    @classmethod
    def unknown(cls, shape: tuple[int, ...]) -> SmoothedPaths:
        """Make paths of NaN."""
        return cls(*np.full((6, *shape), np.nan))


class Smoother(Protocol):
    """Smooths one stretch: increasing times (n,) [s], values (n, k), their covariances (n, k, k).

    Rows of NaN are to be filled; the first and last rows are known. An unknown covariance is NaN.
    """

    def __call__(self, time_s: Array, values: Array, covariance: Array) -> SmoothedPaths: ...  # noqa: D102


@dataclass(frozen=True, slots=True, eq=False)
class SmoothedSegments:
    """Smoothed stretches, reassembled."""

    paths: SmoothedPaths
    segment: NDArray[np.int64]  # (n,) number of the segment, from 0, by the boundaries
    is_filled: NDArray[np.bool_]  # (n,) rows that were not measured


def smooth_stretches(
    smooth: Smoother,
    time_s: Array,
    values: Array,
    covariance: Array,
    *,
    boundaries_s: Sequence[float] = (),
    fill_s: float = 0.0,
) -> SmoothedSegments:
    """Smooth values (n, k) with covariances (n, k, k) stretch by stretch.

    A stretch ends at each boundary (a frame at that very time belongs to the next) and at gaps longer than `fill_s`;
    shorter gaps are filled by the smoother. Frames before the first and after the last known one of a segment are
    never filled. Stretches of fewer than five known frames stay NaN.
    """
    segment = segment_numbers(time_s, boundaries_s)
    is_known = finite_rows(values)
    pieces = SmoothedSegments(SmoothedPaths.unknown(values.shape), segment, np.zeros(len(time_s), bool))
    for rows in stretches(time_s, is_known, segment, fill_s):
        stretch = smooth(time_s[rows], values[rows], covariance[rows])
        for field in fields(SmoothedPaths):
            getattr(pieces.paths, field.name)[rows] = getattr(stretch, field.name)
        pieces.is_filled[rows] = ~is_known[rows]
    return pieces


def segment_numbers(time_s: Array, boundaries_s: Sequence[float]) -> NDArray[np.int64]:
    """Return the number of each time's segment, from 0: (n,); at the very time of a boundary that of the next."""
    return np.searchsorted(np.sort(np.asarray(boundaries_s, float)), time_s, side="right")


def finite_rows(values: Array) -> NDArray[np.bool_]:
    """Return which rows of values (n, k) are finite: (n,)."""
    return np.asarray(np.isfinite(values).all(axis=1))


def stretches(time_s: Array, is_known: NDArray[np.bool_], segment: NDArray[np.int64], fill_s: float) -> Iterator[slice]:
    """Yield the rows of each stretch that is long enough, from its first known frame to its last."""
    known_rows = np.flatnonzero(is_known)
    if len(known_rows) < MIN_FRAMES:
        return
    period = float(np.median(np.diff(time_s)))
    gap = np.diff(time_s[known_rows]) - period
    cuts = np.flatnonzero((gap > fill_s + _SLACK * period) | (np.diff(segment[known_rows]) > 0)) + 1
    for rows in np.split(known_rows, cuts):
        if len(rows) >= MIN_FRAMES:
            yield slice(int(rows[0]), int(rows[-1]) + 1)
