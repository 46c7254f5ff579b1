"""The nuisance parameters of a run by least squares, with every moment's pose eliminated (Schur complement)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from airborne.types import Array

# sds of a view's offset that the same silhouette has at any one moment, at least: px, px, rad, log scale
_LEAST_NOISE = np.array([0.15, 0.15, np.radians(0.1), 0.002])
_STRAY = np.array([np.inf, np.inf, 0.15, 0.1])  # a view's turn and scale farther from its median are mistakes
_ROUNDS = 4  # of estimating the noise and the weights of views that do not fit
_CLIP = 3.0  # residuals beyond so many sds lose weight
N_BLOCKS = 4  # of moments one after the other: a limb that is wrongly placed stays so for some moments, rarely longer
_POSE_SD = np.array([0.5, 0.5, 0.5, 1.0, 1.0, 1.0])  # hold what no view shows [m, rad]


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """Offsets of the silhouettes at n moments in c views, and how they change by the poses and by the k parameters."""

    offset: Array  # (n, c, 4); 0 where not seen
    by_twist: Array  # (n, c, 4, 6) of the pose at that moment
    by_parameter: Array  # (n, c, 4, k)
    is_seen: NDArray[np.bool_]  # (n, c)
    edge: Array  # (n, c, 6, 6) information of the whole outline for the pose, as a tracker uses it
    edge_by_parameter: Array  # (n, c, 6, k)

    def select(self, chosen: NDArray[np.bool_]) -> Evidence:
        """Return some of the moments, chosen (n,)."""
        return Evidence(*(getattr(self, each.name)[chosen] for each in fields(self)))


@dataclass(frozen=True, slots=True, eq=False)
class NuisanceSolution:
    """Normal equations of the parameters, H theta = g, poses eliminated: theta by H; `total` is the misfit of zero."""

    H: Array  # (k, k)
    g: Array  # (k,)
    total: float
    without: Sequence[NuisanceSolution] = ()  # the same without each block of moments

    def posterior(self, prior: Array) -> tuple[Array, Array, float]:
        """Return mean (k,), covariance (k, k) and minus twice the log-posterior at the mean for a Gaussian prior.

        The prior (k, k) may be singular.
        """
        gain = np.linalg.solve(np.eye(len(self.g)) + prior @ self.H, prior)
        covariance = (gain + gain.T) / 2
        mean = covariance @ self.g
        return mean, covariance, float(self.total - self.g @ mean)

    def with_row(self, row: Array, value: float, sd: float) -> NuisanceSolution:
        """Add a linear measurement, row (k,) theta = value."""
        without = [each.with_row(row, value, sd) for each in self.without]
        row, value = row / sd, value / sd
        return NuisanceSolution(self.H + np.outer(row, row), self.g + value * row, self.total + value**2, without)

    def with_growth(self, column: int) -> NuisanceSolution:
        """Let a parameter grow evenly from block to block: a further one is by how much it does from middle to end."""
        k = len(self.g)
        maps = np.tile(np.eye(k + 1, k), (len(self.without), 1, 1))  # to k + 1 parameters, in each block
        maps[:, k, column] = np.linspace(-1, 1, len(maps))
        H, g, blocks = np.zeros((k + 1, k + 1)), np.zeros(k + 1), []
        H[:k, :k], g[:k] = self.H, self.g
        for to_grown, each in zip(maps, self.without, strict=True):
            own_H, own_g = self.H - each.H, self.g - each.g
            blocks.append((to_grown @ own_H @ to_grown.T, to_grown @ own_g))
            H, g = H + blocks[-1][0], g + blocks[-1][1]
            H[:k, :k], g[:k] = H[:k, :k] - own_H, g[:k] - own_g
        without = [
            NuisanceSolution(H - own_H, g - own_g, each.total)
            for (own_H, own_g), each in zip(blocks, self.without, strict=True)
        ]
        return NuisanceSolution(H, g, self.total, without)

    def jackknife(self, prior: Array) -> Array:
        """Return the covariance (k, k) of the mean by how it changes without each block of moments (jackknife).

        It holds what the posterior's does not, which takes the moments for independent: errors that last for some.
        """
        means = np.stack([each.posterior(prior)[0] for each in self.without])
        return (len(means) - 1) * np.cov(means.T, bias=True)


@dataclass(frozen=True, slots=True, eq=False)
class PoseErrors:
    """How far each moment's tracked pose is from the true one [m, rad]: by the silhouettes, and by the parameters."""

    seen: Array  # (n, 6) by the silhouettes if all parameters are zero
    seen_by_parameter: Array  # (n, 6, k)
    by_parameter: Array  # (n, 6, k) of a pose tracked by the whole outline
    noise: Array  # (n, 6, 6) covariance of what the silhouettes show

    def at(self, theta: Array) -> Array:
        """Return by how much the silhouettes show the poses off, given the parameters (k,): (n, 6)."""
        return self.seen + self.seen_by_parameter @ theta


def solve(evidence: Evidence, wide: Array) -> tuple[NuisanceSolution, Array]:
    """Accumulate the equations with the noise that the residuals show; return the weights (n, c, 4) too.

    wide (k, k): prior of the parameters while the noise is estimated.
    """
    is_seen = evidence.is_seen & ~_strays(evidence)
    weights = is_seen[..., None] / (3 * _LEAST_NOISE) ** 2
    solution, trust = _accumulate(evidence, weights), is_seen.astype(float)
    for _ in range(_ROUNDS):
        trust, weights = _weigh(evidence, weights, trust, theta=solution.posterior(wide)[0])
        solution = _accumulate(evidence, weights)
    return replace(solution, without=_without_blocks(evidence, weights)), weights


def _weigh(evidence: Evidence, weights: Array, trust: Array, *, theta: Array) -> tuple[Array, Array]:
    """Return how far each view is trusted at each moment (n, c), 0 where not seen, and its new weights (n, c, 4)."""
    is_seen = trust > 0
    errors = pose_errors(evidence, weights)
    residual = evidence.offset - np.einsum("ncak,k->nca", evidence.by_parameter, theta)
    residual -= np.einsum("ncai,ni->nca", evidence.by_twist, errors.at(theta))
    residual *= is_seen[..., None]
    leverage = np.einsum("ncai,nij,ncaj,nca->nca", evidence.by_twist, errors.noise, evidence.by_twist, weights)
    freedom = np.sum(trust[..., None] * (1 - leverage), axis=(0, 1))
    noise = np.sqrt(np.sum(trust[..., None] * residual**2, axis=(0, 1)) / np.maximum(freedom, 1.0))
    noise = np.maximum(noise, _LEAST_NOISE)
    away = np.sqrt(np.mean((residual / noise) ** 2, axis=-1))
    trust = is_seen * np.minimum(1, _CLIP / np.maximum(away, 1e-9)) ** 2
    return trust, trust[..., None] / noise**2


def _without_blocks(evidence: Evidence, weights: Array) -> list[NuisanceSolution]:
    """Accumulate the equations without each block of the moments that show something."""
    solutions = []
    for block in np.array_split(np.flatnonzero(weights.any(axis=(1, 2))), N_BLOCKS):
        kept = np.ones(len(weights), bool)
        kept[block] = False
        solutions.append(_accumulate(evidence.select(kept), weights[kept]))
    return solutions


def _strays(evidence: Evidence) -> NDArray[np.bool_]:
    """Return which offsets are mistakes, far from what their views have at other moments: (n, c)."""
    median = np.zeros(evidence.offset.shape[1:])
    for view, is_seen in enumerate(evidence.is_seen.T):
        if is_seen.any():
            median[view] = np.median(evidence.offset[is_seen, view], axis=0)
    return np.any(np.abs(evidence.offset - median) > _STRAY, axis=-1)


def pose_errors(evidence: Evidence, weights: Array) -> PoseErrors:
    """Return how far the tracked poses are off."""
    S, A = evidence.by_twist, _pose_information(evidence, weights)
    b = np.einsum("ncai,nca,nca->ni", S, weights, evidence.offset)
    C = np.einsum("ncai,nca,ncak->nik", S, weights, evidence.by_parameter)
    edge = evidence.edge.sum(axis=1)
    floor = 1e-4 * np.trace(edge, axis1=1, axis2=2)[:, None, None] * np.eye(6) / 6
    by_parameter = -np.linalg.solve(edge + floor, evidence.edge_by_parameter.sum(axis=1))
    inverse = np.asarray(np.linalg.inv(A), float)
    return PoseErrors((inverse @ b[..., None])[..., 0], -inverse @ C, by_parameter, inverse)


def _pose_information(evidence: Evidence, weights: Array) -> Array:
    S = evidence.by_twist
    return np.einsum("ncai,nca,ncaj->nij", S, weights, S) + np.diag(1 / _POSE_SD**2)


def _accumulate(evidence: Evidence, W: Array) -> NuisanceSolution:
    """Eliminate each moment's pose (a twist) from the least squares of the offsets."""
    S, D = evidence.by_twist, evidence.by_parameter
    A = _pose_information(evidence, W)
    C = np.einsum("ncai,nca,ncak->nik", S, W, D)
    b = np.einsum("ncai,nca,nca->ni", S, W, evidence.offset)
    AC, Ab = np.linalg.solve(A, C), np.linalg.solve(A, b[..., None])[..., 0]
    H = np.einsum("ncak,nca,ncal->kl", D, W, D) - np.einsum("nik,nil->kl", C, AC)
    g = np.einsum("ncak,nca,nca->k", D, W, evidence.offset) - np.einsum("nik,ni->k", C, Ab)
    total = float(np.sum(W * evidence.offset**2) - np.sum(b * Ab))
    return NuisanceSolution((H + H.T) / 2, g, total)
