"""Covariances of the camera parameters from the reduced camera system, with the gauge fixed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse.linalg import SuperLU

from airborne.calibration.bundle.equations import Jacobian, NormalEquations, camera_equations, gauge_directions
from airborne.calibration.bundle.layout import Layout
from airborne.calibration.bundle.loss import Loss, loss_constants
from airborne.calibration.bundle.problem import Problem, State
from airborne.cameras.camera import Rig, correlation
from airborne.types import Array

_MOST_ROWS_AT_ONCE = 200  # rows whose leverage is computed together
_FEWEST_CLUSTERS = 8  # fewer do not estimate a covariance
_N_POSE_AND_FOCAL = 7  # the first of `lenses.CAMERA_PARAMETERS`: turn, place and focal length


@dataclass(frozen=True, slots=True, eq=False)
class Uncertainty:
    """The covariance of the camera parameters."""

    covariance: Array  # (camera columns, camera columns)
    is_gauge_free: bool

    @property
    def sd(self) -> Array:
        """Standard deviations of the camera columns."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def shift_sd_px(self, problem: Problem, jacobian: Jacobian) -> Array:
        """Return the standard deviation of projected points due to each camera's parameters: (cameras,) [px].

        Of one coordinate, RMS over the observations of the camera.
        """
        layout, c = problem.layout, len(self.covariance)
        covariance = np.zeros((c + 1, c + 1))  # the last row and column: -1, of what is fixed
        covariance[:c, :c] = self.covariance
        shifts = []
        for i, columns in enumerate(layout.cameras):
            rows = jacobian.by_camera[problem.is_used & (problem.camera == i)]
            variance = np.sum(rows @ covariance[np.ix_(columns, columns)] * rows, axis=-1)
            shifts.append(np.sqrt(max(variance.mean(), 0.0)) if variance.size else 0.0)
        return np.array(shifts)

    def camera_covariances(self, problem: Problem, jacobian: Jacobian, rig: Rig) -> list[Array | None]:
        """Return what `Camera.covariance` holds, by camera; None without observations.

        What the lens's other parameters leave open counts by how it moves the observations: as the turn, place and
        focal length that move them most alike, in the sense of least squares.
        """
        layout = problem.layout
        found: list[Array | None] = []
        for i, (camera, columns) in enumerate(zip(rig, layout.cameras, strict=True)):
            rows = jacobian.by_camera[problem.is_used & (problem.camera == i)][:, :, columns >= 0]
            if not rows.size:
                found.append(np.zeros((7, 7)) if len(self.covariance) and not (columns >= 0).any() else None)
                continue
            parameters, free = layout.parameters[columns >= 0], columns[columns >= 0]
            rows, kept = rows.reshape(-1, len(free)), np.flatnonzero(parameters < _N_POSE_AND_FOCAL)
            size = np.maximum(np.linalg.norm(rows[:, kept], axis=0), 1e-12)
            scaled = rows[:, kept] / size
            moves = np.zeros((7, len(free)))
            moves[parameters[kept]] = np.linalg.pinv(scaled.T @ scaled) @ (scaled.T @ rows) / size[:, None]
            moves[3:6] = camera.camera_from_world.rotation.as_matrix() @ moves[3:6]
            moves[6] /= camera.K[0, 0]
            found.append(_without_rounding(moves @ self.covariance[np.ix_(free, free)] @ moves.T))
        return found


def _without_rounding(covariance: Array) -> Array:
    """Return the nearest covariance (n, n): symmetric, and without variances below zero in any direction."""
    sd, correlations = correlation(covariance)
    values, vectors = np.linalg.eigh(correlations)
    return (vectors * np.maximum(values, 0.0)) @ vectors.T * sd[:, None] * sd


def gauge_fixed_inverse(reduced: Array, gauge: Array) -> Array:
    """Return the inverse of the reduced camera matrix (n, n) with no motion along the gauge directions (n, k).

    `Q (Q^T S Q)^-1 Q^T`, where the columns of Q complete the orthonormal gauge directions to a basis; by Cholesky with
    the diagonal scaled to 1.
    """
    basis = np.linalg.qr(gauge, mode="complete")[0][:, gauge.shape[1] :] if gauge.shape[1] else np.eye(len(reduced))
    inner = basis.T @ reduced @ basis
    size = np.sqrt(np.maximum(np.diag(inner), 1e-30))
    scaled = inner / size[:, None] / size
    scaled = (scaled + scaled.T) / 2
    try:
        inverse = cho_solve(cho_factor(scaled), np.eye(len(scaled)))
    except np.linalg.LinAlgError:
        inverse = np.linalg.pinv(scaled, hermitian=True)
    return basis @ (inverse / size[:, None] / size) @ basis.T


def redundancies(
    problem: Problem, state: State, normal: NormalEquations, jacobian: Jacobian, *, weights: Array
) -> Array:
    """Return each source's redundancy, its pixel coordinates minus the parameters that they determine: (sources,).

    A parameter that several sources, lengths or lags determine is shared out by their information.
    """
    n = 2 * len(problem.px)
    source_of_row = np.concatenate([np.repeat(problem.source, 2), problem.length_source, problem.lag_source])
    n_sources = int(source_of_row.max(initial=0)) + 1
    reduced, _, factors, back = normal.reduce(0.0)
    inverse = (
        gauge_fixed_inverse(reduced, gauge_directions(problem, state, normal, reduced)) if len(reduced) else reduced
    )
    redundancy = np.zeros(n_sources)
    leverage = weights[n:] * _leverages(problem.layout, jacobian, factors, back, inverse=inverse)
    for i in range(n_sources):
        rows, columns = source_of_row == i, problem.source_of_column == i
        n_used = (rows[:n] & np.repeat(problem.is_used, 2)).sum()
        share = camera_equations(problem.layout, jacobian, np.where(rows, weights, 0.0))
        share -= normal.coupling[:, columns] @ back[columns]
        redundancy[i] = n_used - columns.sum() - np.sum(share * inverse) + leverage[rows[n:]].sum()
    return np.maximum(redundancy, 1.0)


def _leverages(layout: Layout, jacobian: Jacobian, factors: SuperLU | None, back: Array, *, inverse: Array) -> Array:
    """Return `a N^-1 a^T` of the rows a of lengths and lags, which involve no camera: (k + l,)."""
    k, n_rows = len(layout.ends), len(layout.ends) + len(layout.lags)
    leverages = np.zeros(n_rows)
    if factors is None:
        return leverages
    for first in range(0, n_rows, _MOST_ROWS_AT_ONCE):
        rows = np.arange(first, min(first + _MOST_ROWS_AT_ONCE, n_rows))
        ends, late = rows[rows < k], rows[rows >= k]
        dense = np.zeros((len(rows), len(back) + 1))  # the last column: -1, of what is fixed
        np.add.at(dense, (ends[:, None] - first, layout.ends[ends]), jacobian.by_ends[ends])
        dense[late - first, layout.lags[late - k]] = 1.0
        dense = dense[:, :-1]
        through = dense @ back
        leverages[rows] = np.einsum("ko,ok->k", dense, factors.solve(dense.T)) + np.sum(
            through @ inverse * through, axis=1
        )
    return leverages


def estimate_uncertainty(
    problem: Problem,
    state: State,
    normal: NormalEquations,
    jacobian: Jacobian,
    *,
    weights: Array,
    residuals: Array,
    loss: Loss,
) -> Uncertainty:
    """Return the covariance of the camera parameters.

    The larger of two for each parameter: of independent errors, and of errors correlated within clusters (the sandwich
    of the clusters' scores; Liang and Zeger 1986), which counts clusters instead of observations.
    """
    reduced, _, _, back = normal.reduce(0.0)
    if not len(reduced):
        return Uncertainty(np.zeros((0, 0)), False)
    gauge = gauge_directions(problem, state, normal, reduced)
    inverse = gauge_fixed_inverse(reduced, gauge)
    covariance = loss_constants(loss).variance * inverse
    n_clusters = int(problem.cluster.max(initial=-1)) + 1
    if n_clusters >= _FEWEST_CLUSTERS:
        n = 2 * len(problem.px)
        score = _scores(problem, jacobian, (weights * residuals)[:n].reshape(-1, 2, 1), back)
        single = problem.cluster < 0
        groups = np.where(single, n_clusters + np.cumsum(single) - 1, problem.cluster)
        sums = np.zeros((int(groups.max()) + 1, len(reduced)))
        np.add.at(sums, groups, score)
        n_used = 2 * problem.is_used.sum()
        correction = n_clusters / (n_clusters - 1) * n_used / max(n_used - problem.n_other_columns - len(reduced), 1)
        sandwich = loss_constants(loss).clustered * correction * inverse @ (sums.T @ sums) @ inverse
        factor = np.sqrt(np.maximum(np.diag(sandwich) / np.maximum(np.diag(covariance), 1e-300), 1.0))
        covariance = factor[:, None] * covariance * factor
    return Uncertainty(covariance, bool(gauge.shape[1]))


def _scores(problem: Problem, jacobian: Jacobian, pulls: Array, back: Array) -> Array:
    """Return by how much each observation, with the others eliminated, pulls at the cameras: (n, camera columns).

    pulls (n, 2, 1): weighted residuals.
    """
    layout, n_columns = problem.layout, problem.n_camera_columns
    scores = np.zeros((len(pulls), n_columns + 1))  # the last column: -1, of what is fixed
    np.put_along_axis(scores, layout.cameras[problem.camera], np.sum(jacobian.by_camera * pulls, axis=1), axis=1)
    back, by_other = np.vstack([back, np.zeros(n_columns)]), np.sum(jacobian.by_other * pulls, axis=1)
    for k in range(by_other.shape[1]):
        scores[:, :-1] -= by_other[:, [k]] * back[layout.other[:, k]]
    return scores[:, :-1]
