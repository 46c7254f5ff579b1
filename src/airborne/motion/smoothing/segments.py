"""What every smoother shares: stretches that end at events and gaps, and what comes out of them.

Arrays in, arrays out. A smoother sees one stretch at a time, so nothing of one side of a take-off reaches the other.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

FEWEST = 5  # known frames of a stretch; shorter ones stay unknown
_SLACK = 0.5  # of a period, by which a gap may be longer than asked


@dataclass(frozen=True, slots=True, eq=False)
class Smoothed:
    """Paths (n, k) with two derivatives a second and their standard deviations; NaN where unknown.

    The deviations hold what the stated noise leaves after smoothing, not what smoothing takes off the motion itself.
    """

    value: Array
    velocity: Array
    acceleration: Array
    value_sd: Array
    velocity_sd: Array
    acceleration_sd: Array

    @classmethod
    def unknown(cls, shape: tuple[int, ...]) -> Smoothed:
        """Make paths of which nothing is known."""
        return cls(*np.full((6, *shape), np.nan))


class Smoother(Protocol):
    """Smooths one stretch: increasing times (n,) [s], values (n, k), their covariances (n, k, k).

    Rows of NaN are to be filled; the first and last rows are known. An unknown covariance is NaN.
    """

    def __call__(self, time_s: Array, values: Array, covariance: Array) -> Smoothed: ...  # noqa: D102


@dataclass(frozen=True, slots=True, eq=False)
class Pieces:
    """Smoothed stretches put together again."""

    smoothed: Smoothed
    segment: NDArray[np.int64]  # (n,) number of the segment, from 0, by the boundaries
    is_filled: NDArray[np.bool_]  # (n,) values that were not measured


def in_stretches(
    smooth: Smoother,
    time_s: Array,
    values: Array,
    covariance: Array,
    *,
    boundaries_s: Sequence[float] = (),
    fill_s: float = 0.0,
) -> Pieces:
    """Smooth values (n, k) with covariances (n, k, k) stretch by stretch.

    A stretch ends at each boundary (a frame at that very time belongs to what follows) and at gaps longer than
    `fill_s`; shorter ones are filled by the smoother. Frames before the first and after the last known one of a segment
    are never filled. What lies in stretches of fewer than five known frames stays NaN.
    """
    segment = np.searchsorted(np.sort(np.asarray(boundaries_s, float)), time_s, side="right")
    is_known = known_rows(values)
    pieces = Pieces(Smoothed.unknown(values.shape), segment, np.zeros(len(time_s), bool))
    for rows in stretches(time_s, is_known, segment, fill_s):
        found = smooth(time_s[rows], values[rows], covariance[rows])
        for field in fields(Smoothed):
            getattr(pieces.smoothed, field.name)[rows] = getattr(found, field.name)
        pieces.is_filled[rows] = ~is_known[rows]
    return pieces


def known_rows(values: Array) -> NDArray[np.bool_]:
    """Say which rows of values (n, k) are known: (n,)."""
    return np.asarray(np.isfinite(values).all(axis=1))


def stretches(time_s: Array, is_known: NDArray[np.bool_], segment: NDArray[np.int64], fill_s: float) -> Iterator[slice]:
    """Yield the rows of each stretch that is long enough, from its first known frame to its last."""
    known = np.flatnonzero(is_known)
    if len(known) < FEWEST:
        return
    period = float(np.median(np.diff(time_s)))
    gap = np.diff(time_s[known]) - period
    cuts = np.flatnonzero((gap > fill_s + _SLACK * period) | (np.diff(segment[known]) > 0)) + 1
    for rows in np.split(known, cuts):
        if len(rows) >= FEWEST:
            yield slice(int(rows[0]), int(rows[-1]) + 1)
