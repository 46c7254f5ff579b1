"""Noise through a linear smoother: the standard deviations that the stated noise leaves, to the last coefficient.

Half of each variance is white and half fades over 0.1 s, as `motion.contact.OF_ANYTHING` has it: trackers err
alike in neighbouring frames, so that smoothing gains less than it would with white noise.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from airborne.motion.free_fall import OF_ANYTHING
from airborne.motion.smoothing.segments import FEWEST, Smoothed, known_rows

Array = NDArray[np.floating]

_BLOCK, _MARGIN = 200, 100  # rows at a time, and rows on both sides that still count
_NO_WEIGHT = 1e-4  # of the squared weights: rows of unknown noise that matter less are left out


class Operator(Protocol):
    """A linear map: values (m, c) at known times (m,) to value, velocity, acceleration (3, n, c) at times (n,)."""

    def __call__(self, known_s: Array, values: Array, at_s: Array) -> Array: ...  # noqa: D102


def applied(operator: Operator, time_s: Array, values: Array, covariance: Array) -> Smoothed:
    """Apply an operator to the known rows of a stretch (n, k), with the deviations that follow from the variances."""
    is_known = known_rows(values)
    found = operator(time_s[is_known], values[is_known], time_s)
    variance = np.diagonal(covariance, axis1=1, axis2=2)
    sd = np.empty_like(found)
    done: list[int] = []
    for k in range(values.shape[1]):
        same = next((j for j in done if np.array_equal(variance[:, j], variance[:, k], equal_nan=True)), None)
        sd[:, :, k] = _deviations(operator, time_s, is_known, variance[:, k]) if same is None else sd[:, :, same]
        done.append(k)
    return Smoothed(*found, *sd)


def _deviations(operator: Operator, time_s: Array, is_known: NDArray[np.bool_], variance: Array) -> Array:
    """Return the deviations (3, n) of one path; NaN where they rest on an unknown or infinite variance (n,)."""
    n = len(time_s)
    sd = np.full((3, n), np.nan)
    if not np.isfinite(variance[is_known]).any():
        return sd
    known = np.flatnonzero(is_known)
    for start in range(0, n, _BLOCK):
        stop = n if n - start < 2 * _BLOCK else start + _BLOCK
        first = known[np.searchsorted(known, max(start - _MARGIN, 0), side="right") - 1]
        last = known[np.searchsorted(known, min(stop + _MARGIN, n) - 1)]
        rows = slice(int(first), int(last) + 1)
        inner = slice(start - rows.start, stop - rows.start)
        sd[:, start:stop] = _block(operator, time_s[rows], is_known[rows], variance[rows])[:, inner]
        if stop == n:
            break
    return sd


def _block(operator: Operator, time_s: Array, is_known: NDArray[np.bool_], variance: Array) -> Array:
    known_s, variance = time_s[is_known], variance[is_known]
    if len(known_s) < FEWEST:
        return np.full((3, len(time_s)), np.nan)
    is_sound = np.isfinite(variance) & (variance >= 0)
    weight = operator(known_s, np.eye(len(known_s)), time_s)  # (3, n, known)
    scaled = weight * np.sqrt(np.where(is_sound, variance, 0.0))
    white = OF_ANYTHING.white_share * (scaled**2).sum(axis=-1)
    fading = (1 - OF_ANYTHING.white_share) * ((scaled @ _fading_root(known_s)) ** 2).sum(axis=-1)
    unsound = (weight[..., ~is_sound] ** 2).sum(axis=-1) > _NO_WEIGHT * (weight**2).sum(axis=-1)
    return np.where(unsound, np.nan, np.sqrt(white + fading))


def _fading_root(time_s: Array) -> Array:
    """Return L with L L' = exp(-|t - t'| / 0.1 s): the Cholesky root of a process of first order, in closed form."""
    apart = time_s[:, None] - time_s
    step = np.exp(-np.diff(time_s) / OF_ANYTHING.fading_s)
    fresh = np.concatenate([[1.0], np.sqrt(1 - step**2)])
    return np.where(apart >= 0, np.exp(-np.maximum(apart, 0.0) / OF_ANYTHING.fading_s), 0.0) * fresh
