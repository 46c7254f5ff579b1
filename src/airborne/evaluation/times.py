"""Times of a motion beside those of a reference: which go together, and whether the clocks are shifted."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from airborne.errors import ResultError
from airborne.types import Array

NEAR_MM = 100.0  # chosen: a reference that is further away, whatever is changed, is not explained by the change
ELSEWHERE_MM = 300.0  # chosen: mean distance of the paths of something else; no tracked person errs by a third of it
# chosen: share of the distance that a shift of the clock leaves; a constant error along the motion looks like one
CLEARLY_BETTER = 0.5
_SAME_TIME_S = 1e-6  # where neither table has two times, so that no period is known
_SAME_SHARE = 0.1  # of the shorter period: times further apart do not match
_FARTHEST_SHIFT = 10  # chosen: periods by which the clocks are shifted relative to each other
_MOST_FRAMES = 0.9  # chosen: shifts that leave fewer of the frames are ignored
_FEW_TIMES = 3  # chosen: matches at least that speak for milliseconds, and more than twice those in seconds


def best_time_shift(
    time_s: Array, unshifted_mm: float, error_at: Callable[[float], tuple[float, int]], clearly_better: float
) -> tuple[float, float]:
    """Shift a reference's clock by whole periods: return the best shift [s] and its error [mm].

    `error_at` returns the error [mm] with a shift [s] added to its times, and how many values are compared then. The
    best is 0 unless another leaves less than a share, `clearly_better`, of the error, and less than `NEAR_MM`.
    """
    if len(time_s) < 2 or math.isnan(unshifted_mm):
        return 0.0, unshifted_mm
    period, best = float(np.median(np.diff(time_s))), (0.0, unshifted_mm)
    shifted = {step: error_at(step * period) for step in range(-_FARTHEST_SHIFT, _FARTHEST_SHIFT + 1)}
    for step, (error_mm, n) in shifted.items():
        is_near = error_mm < min(best[1], clearly_better * unshifted_mm, NEAR_MM)
        if is_near and n >= _MOST_FRAMES * shifted[0][1]:
            best = step * period, error_mm
    return best


def question_shift(shift_s: float, reference: str, then: str) -> str:
    """Ask in one line whether the clocks are shifted; `then` says what would be with a shift [s]."""
    added = f"with {1e3 * shift_s:+.1f} ms added to the {reference}'s times"
    return f"{added}, {then}: do both clocks start at the same frame?"


def match_times(time_s: Array, true_time_s: Array) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
    """Match times: rows of the motion, rows of the truth nearest in time, and their time offsets [s].

    Raises ResultError where hardly any match, and many would if the truth's were milliseconds.
    """
    matched = nearest_times(time_s, true_time_s)
    n = len(matched[0])
    if 2 * n < len(time_s) and len(nearest_times(time_s, true_time_s / 1000)[0]) > max(_FEW_TIMES - 1, 2 * n):
        raise ResultError(
            f"the reference's times are {span(true_time_s)}, the run's {span(time_s)}: are they in milliseconds? "
            "time_s holds seconds; divide it by 1000"
        )
    return matched


def nearest_times(time_s: Array, true_time_s: Array) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
    """Match times as `match_times` does, whatever they are."""
    periods = [float(np.median(np.diff(t))) for t in (time_s, true_time_s) if len(t) > 1]
    reach = _SAME_SHARE * min(periods) if periods else _SAME_TIME_S
    rows = np.searchsorted((true_time_s[1:] + true_time_s[:-1]) / 2, time_s)
    offset = np.abs(time_s - true_time_s[rows])
    frames = np.flatnonzero(offset < reach)
    return frames, rows[frames], offset[frames]


def span(time_s: Array) -> str:
    """Format the range of times."""
    return f"{time_s[0]:.3f} to {time_s[-1]:.3f} s" if len(time_s) else "empty"
