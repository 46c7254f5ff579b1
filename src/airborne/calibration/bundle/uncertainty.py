"""How well the cameras' numbers are known: covariances of the reduced equations, in a frame that stays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse import csr_array
from scipy.sparse.linalg import SuperLU

from airborne.calibration.bundle.equations import Jacobian, NormalEquations, gauge_directions
from airborne.calibration.bundle.loss import Loss, loss_constants
from airborne.calibration.bundle.problem import Problem, State
from airborne.types import Array

_MOST_ROWS_AT_ONCE = 200  # rows whose share is found together
_FEWEST_CLUSTERS = 8  # fewer say nothing about a spread


@dataclass(frozen=True, slots=True, eq=False)
class Uncertainty:
    """What the fit leaves open."""

    covariance: Array  # (camera columns, camera columns)
    is_gauge_free: bool

    @property
    def sd(self) -> Array:
        """Standard deviations of the camera columns."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def shift_sd_px(self, task: Problem, slopes: Jacobian) -> Array:
        """Return how far each camera's numbers leave a projected point open, in one direction: (cameras,) [px].

        RMS over the observations of the camera.
        """
        rows = slopes.by_camera[: 2 * len(task.px)]
        variance = np.asarray((rows @ self.covariance) * rows.toarray()).sum(axis=1) if rows.shape[1] else np.zeros(0)
        used = np.repeat(task.is_used, 2)
        camera = np.repeat(task.camera, 2)
        shifts = [variance[used & (camera == i)] if len(variance) else variance for i in range(len(task.is_fisheye))]
        return np.array([np.sqrt(max(shift.mean(), 0.0)) if len(shift) else 0.0 for shift in shifts])


def gauge_fixed_inverse(reduced: Array, frame: Array) -> Array:
    """Return the inverse of reduced camera equations where the rig as a whole does not move along `frame`.

    `(S + k F F^T)^-1 - F F^T / k` with orthonormal F, S F = 0; by Cholesky with the diagonal scaled to 1.
    """
    size = np.sqrt(np.maximum(np.diag(reduced), 1e-30))
    k = float(np.mean(np.diag(reduced))) if frame.shape[1] else 1.0
    if frame.shape[1]:
        k = float(np.mean(np.einsum("i,ik,ik->k", np.diag(reduced), frame, frame)))
    scaled = (reduced + k * frame @ frame.T) / size[:, None] / size
    scaled = (scaled + scaled.T) / 2
    try:
        inverse = cho_solve(cho_factor(scaled), np.eye(len(scaled)))
    except np.linalg.LinAlgError:
        inverse = np.linalg.pinv(scaled, hermitian=True)
    return inverse / size[:, None] / size - frame @ frame.T / k


def redundancies(task: Problem, state: State, normal: NormalEquations, slopes: Jacobian, *, weights: Array) -> Array:
    """Return by source how many more pixel coordinates are measured than they give numbers: (sources,).

    A number that several sources tell of, or a length or lag beside the pixels, is shared out by what each says of it.
    """
    n = 2 * len(task.px)
    source_of_row = np.concatenate([np.repeat(task.source, 2), task.length_source, task.lag_source])
    n_sources = int(source_of_row.max(initial=0)) + 1
    reduced, _, factors, back = normal.reduce(0.0)
    inverse = gauge_fixed_inverse(reduced, gauge_directions(task, state, normal, reduced)) if len(reduced) else reduced
    left = np.zeros(n_sources)
    told = weights[n:] * _leverages(slopes.by_other[n:], factors, back, inverse)
    for i in range(n_sources):
        rows, columns = source_of_row == i, task.source_of_column == i
        used = (rows[:n] & np.repeat(task.is_used, 2)).sum()
        own = slopes.by_camera[rows]
        share = (own.T @ (own * weights[rows][:, None])).toarray() - normal.coupling[:, columns] @ back[columns]
        left[i] = used - columns.sum() - np.sum(share * inverse) + told[rows[n:]].sum()
    return np.maximum(left, 1.0)


def _leverages(rows: csr_array, factors: SuperLU | None, back: Array, inverse: Array) -> Array:
    """Return `a N^-1 a^T` of rows a (k, others) that touch no camera: (k,)."""
    if factors is None or not len(back) or not rows.indptr[-1]:
        return np.zeros(len(rows.indptr) - 1)
    found = []
    for first in range(0, len(rows.indptr) - 1, _MOST_ROWS_AT_ONCE):
        some = rows[first : first + _MOST_ROWS_AT_ONCE]
        dense = some.toarray()
        through = np.asarray(some @ back)
        found.append(np.einsum("ko,ok->k", dense, factors.solve(dense.T)) + np.sum(through @ inverse * through, axis=1))
    return np.concatenate(found)


def estimate_uncertainty(
    task: Problem,
    state: State,
    normal: NormalEquations,
    slopes: Jacobian,
    *,
    weights: Array,
    residuals: Array,
    loss: Loss,
) -> Uncertainty:
    """Return the covariance of the cameras' numbers.

    The larger of two for each number: errors that are all independent, and errors that clusters have in common (the
    sandwich of the clusters' scores; Liang and Zeger 1986), which counts clusters instead of observations.
    """
    reduced, _, _, back = normal.reduce(0.0)
    if not len(reduced):
        return Uncertainty(np.zeros((0, 0)), False)
    frame = gauge_directions(task, state, normal, reduced)
    inverse = gauge_fixed_inverse(reduced, frame)
    covariance = loss_constants(loss).variance * inverse
    n_clusters = int(task.cluster.max(initial=-1)) + 1
    if n_clusters >= _FEWEST_CLUSTERS:
        n = 2 * len(task.px)
        effect = slopes.by_camera[:n].toarray() - np.asarray(slopes.by_other[:n] @ back)
        score = ((weights * residuals)[:n, None] * effect).reshape(-1, 2, effect.shape[1]).sum(axis=1)
        single = task.cluster < 0
        groups = np.where(single, n_clusters + np.cumsum(single) - 1, task.cluster)
        sums = np.zeros((int(groups.max()) + 1, effect.shape[1]))
        np.add.at(sums, groups, score)
        n_used = 2 * task.is_used.sum()
        few = n_clusters / (n_clusters - 1) * n_used / max(n_used - task.n_other_columns - len(reduced), 1)
        spread = loss_constants(loss).clustered * few * inverse @ (sums.T @ sums) @ inverse
        wider = np.sqrt(np.maximum(np.diag(spread) / np.maximum(np.diag(covariance), 1e-300), 1.0))
        covariance = wider[:, None] * covariance * wider
    return Uncertainty(covariance, bool(frame.shape[1]))
