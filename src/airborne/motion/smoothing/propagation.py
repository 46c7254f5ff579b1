"""Propagation of a tracker's errors through a linear smoother, from its exact coefficients.

How much of the stated variances is fast, and so smoothed away, the path itself shows: `smoothing.kalman`.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from airborne.motion.smoothing.kalman import PathErrors, error_correlations
from airborne.motion.smoothing.segments import MIN_FRAMES, SmoothedPaths, finite_rows
from airborne.types import Array

_BLOCK, _MARGIN = 200, 100  # rows at a time, and further rows on both sides
_NEGLIGIBLE_WEIGHT = 1e-4  # of the squared weights: rows of unknown noise below this are ignored


class Operator(Protocol):
    """A linear map: values (m, c) at known times (m,) to value, velocity, acceleration (3, n, c) at times (n,)."""

    def __call__(self, known_s: Array, values: Array, at_s: Array) -> Array: ...  # noqa: D102


def apply_operator(
    operator: Operator, time_s: Array, values: Array, covariance: Array, *, errors: PathErrors | None
) -> SmoothedPaths:
    """Apply an operator to the known rows of a stretch (n, k), with standard deviations from the variances."""
    is_known = finite_rows(values)
    smooth = operator(time_s[is_known], values[is_known], time_s)
    variance = np.diagonal(covariance, axis1=1, axis2=2)
    sd = np.empty_like(smooth)
    done: list[int] = []
    for k in range(values.shape[1]):
        same = next((j for j in done if np.array_equal(variance[:, j], variance[:, k], equal_nan=True)), None)
        sd[:, :, k] = (
            sd[:, :, same]
            if same is not None
            else _standard_deviations(operator, time_s, is_known, variance[:, k], errors=errors)
        )
        done.append(k)
    return SmoothedPaths(*smooth, *sd)


def _standard_deviations(
    operator: Operator, time_s: Array, is_known: NDArray[np.bool_], variance: Array, *, errors: PathErrors | None
) -> Array:
    """Return the sd (3, n) of one path; NaN where it depends on an unknown or infinite variance (n,)."""
    n = len(time_s)
    sd = np.full((3, n), np.nan)
    if errors is None or not np.isfinite(variance[is_known]).any():
        return sd
    known_rows = np.flatnonzero(is_known)
    for start in range(0, n, _BLOCK):
        stop = n if n - start < 2 * _BLOCK else start + _BLOCK
        first = known_rows[np.searchsorted(known_rows, max(start - _MARGIN, 0), side="right") - 1]
        last = known_rows[np.searchsorted(known_rows, min(stop + _MARGIN, n) - 1)]
        rows = slice(int(first), int(last) + 1)
        inner = slice(start - rows.start, stop - rows.start)
        sd[:, start:stop] = _block_sd(operator, time_s[rows], is_known[rows], variance[rows], errors=errors)[:, inner]
        if stop == n:
            break
    return sd


def _block_sd(
    operator: Operator, time_s: Array, is_known: NDArray[np.bool_], variance: Array, *, errors: PathErrors
) -> Array:
    known_s, variance = time_s[is_known], variance[is_known]
    if len(known_s) < MIN_FRAMES:
        return np.full((3, len(time_s)), np.nan)
    is_stated = np.isfinite(variance) & (variance >= 0)
    weight = operator(known_s, np.eye(len(known_s)), time_s)  # (3, n, known)
    scaled = weight * np.sqrt(np.where(is_stated, variance, 0.0))
    fast, slow = error_correlations(known_s, errors.white_share)
    of_fast = np.sum(scaled @ fast * scaled, axis=-1)
    at_row = np.interp(time_s, known_s[is_stated], variance[is_stated])
    of_slow = np.sum(weight @ slow * weight, axis=-1) * at_row  # its size does not jump from row to row
    squares = errors.fast_share * of_fast + (1 - errors.fast_share) * of_slow
    is_unknown = (weight[..., ~is_stated] ** 2).sum(axis=-1) > _NEGLIGIBLE_WEIGHT * (weight**2).sum(axis=-1)
    return np.where(is_unknown, np.nan, np.sqrt(np.maximum(squares, 0.0)))
