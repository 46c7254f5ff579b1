"""Gauss-Newton on evidence maps: a jumper moves until nothing more is gained at its outlines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from airborne.body.jumper import BALL_HEIGHT_M, CAPSULES, KINDS, LIMITS_RAD, N_DOF
from airborne.tracking.blocker.equations import N_CAPSULES, N_POINTS, gathered
from airborne.tracking.blocker.views import Seen, workspace

Array = NDArray[np.floating]

NATS_PER_M2 = 240.0  # neighbouring pixels err together: what an area on the body is worth for each nat of theirs
SHAPE_SD_M = 0.050  # how far a capsule's outline may lie beside the player's
SLOPE = 0.25  # share of its contrast by which evidence falls across an outline in a pixel of the maps
_LIMIT_SD_RAD = 0.05  # how firmly joints keep within their limits
_FLOOR_SD_M = 0.01  # and feet above the floor
_SETTLED_NATS = 0.1
_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 0.1, 0.03, 2.0  # of a first step; steps shorter than the last change nothing
_ROBUST = 4.0  # squared sds at which an anchor's pull is halved
_BALLS = np.array([6, 7])  # rows of the points
# how people hold themselves, weakly: upright, legs under the hips, both bent alike
_HABIT_SD = np.array([0.2, 0.5, 0.3, 0.15] + [0.25, 0.3, 0.4] * 2 + [0.5, 0.6])
_HABITS = np.zeros((len(_HABIT_SD), N_DOF))
_HABITS[np.arange(10), [4, 5, 6, 7, 9, 10, 12, 14, 15, 17]] = 1  # side and forward lean, bends, hip y and z, ankle
_HABITS[10, [8, 13]] = _HABITS[11, [11, 16]] = 1, -1  # hip and knee flexion, left less right
_HABIT_INFORMATION = _HABITS.T @ (_HABITS / _HABIT_SD[:, None] ** 2)
_REST = np.zeros(N_DOF)
_REST[5] = 0.25


@dataclass(frozen=True, slots=True, eq=False)
class Prior:
    """What is known before looking: a Gaussian over the first numbers of the state, and anchors of points."""

    mean: Array  # (n_free,)
    information: Array  # (n_free, n_free), the inverse of its covariance
    anchors: Array | None = None  # (9, 3) [m]; NaN where there is none
    anchor_sd_m: Array | None = None  # (9,) [m]


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Where a jumper was found."""

    state: Array  # (35,)
    information: Array  # (n_free, n_free) of pictures and prior together
    by_shape: Array  # (n_free, n_free) covariance from outlines that are not the player's
    points: Array  # (9, 3) [m]
    by_state: Array  # (27, n_free) how the points move with the state
    nats: float  # evidence, worth of a pixel taken in
    total: float  # nats and the prior's
    owned: Array  # (v, 10, 2, 2) evidence and area [px of the maps] of each capsule's two kinds


def fit(state: Array, prior: Prior, found: Seen, others: tuple[Array, Array], *, most_steps: int = 10) -> Fit:
    """Move the first len(prior.mean) numbers of a state to the nearest maximum of evidence and prior."""
    best = _evaluated(state, prior, found, others)
    damping = _DAMPING
    for _ in range(most_steps):
        A, b = best[1], best[2]
        step = np.linalg.solve(A + damping * np.diag(np.diag(A)), b)
        moved = best[0].state.copy()
        moved[: len(step)] += step
        tried = _evaluated(moved, prior, found, others)
        gain = tried[0].total - best[0].total
        if gain > 0:
            best, damping = tried, max(damping / 4, _LEAST_DAMPING)
        else:
            damping = max(damping * 4, 0.25)
        if 0 < gain < _SETTLED_NATS or damping > _MOST_DAMPING:
            break
    inverse = np.linalg.inv(best[0].information)
    return replace(best[0], by_shape=inverse @ best[0].by_shape @ inverse)


def scored(state: Array, found: Seen, others: tuple[Array, Array]) -> float:
    """Return the evidence of a state [nat], without any prior."""
    work, owned = workspace(found, len(others[0]))
    nothing = np.empty((N_POINTS, 3)), np.empty((27, 0)), np.empty(0), np.empty((0, 0)), np.empty((0, 0))
    total = gathered(state, 0, found.cameras, _kinds(others), found.maps, others, work, owned, nothing)
    return NATS_PER_M2 / found.scale.px_per_m**2 * total


def _kinds(others: tuple[Array, Array]) -> NDArray[np.int64]:
    return np.concatenate([CAPSULES[:, :2], np.full((len(others[0]), 2), len(KINDS))])


def _evaluated(state: Array, prior: Prior, found: Seen, others: tuple[Array, Array]) -> tuple[Fit, Array, Array]:
    n = len(prior.mean)
    work, owned = workspace(found, len(others[0]))
    points, by_state, gradient = np.empty((N_POINTS, 3)), np.empty((27, n)), np.empty(n)
    curvature, spread = np.empty((2, n, n))
    equations = points, by_state, gradient, curvature, spread
    worth = NATS_PER_M2 / found.scale.px_per_m**2
    total = gathered(state, n, found.cameras, _kinds(others), found.maps, others, work, owned, equations)
    away = state[:n] - prior.mean
    from_rest = _REST - state[:N_DOF]
    cost = 0.5 * float(away @ prior.information @ away + from_rest @ _HABIT_INFORMATION @ from_rest)
    steepness = worth * SLOPE
    A = steepness * curvature + prior.information
    b = worth * gradient - prior.information @ away
    A[:N_DOF, :N_DOF] += _HABIT_INFORMATION
    b[:N_DOF] += _HABIT_INFORMATION @ from_rest
    for rows, targets, weights, each in _rules(state, points, by_state, prior):
        A += rows.T @ (weights[:, None] * rows)
        b += rows.T @ (weights * targets)
        cost += each
    nats = worth * total
    fitted = Fit(
        state, A, (SHAPE_SD_M * steepness) ** 2 * spread, points, by_state, nats, nats - cost, owned[:, :N_CAPSULES]
    )
    return fitted, A, b


def _rules(state: Array, points: Array, by_state: Array, prior: Prior) -> Sequence[tuple[Array, Array, Array, float]]:
    """Return rows (k, n), how far to go (k,), weights (k,) and cost of: joint limits, the floor, anchors."""
    n = by_state.shape[1]
    rules = []
    beyond = np.clip(state[:N_DOF], *LIMITS_RAD.T) - state[:N_DOF]
    if (out := np.flatnonzero(beyond)).size:
        rules.append(_rule(np.eye(N_DOF, n)[out], beyond[out], np.full(len(out), _LIMIT_SD_RAD)))
    sunk = BALL_HEIGHT_M - points[_BALLS, 2]
    if (low := np.flatnonzero(sunk > 0)).size:
        rules.append(_rule(by_state[3 * _BALLS[low] + 2], sunk[low], np.full(len(low), _FLOOR_SD_M)))
    if prior.anchors is not None and prior.anchor_sd_m is not None:
        known = np.flatnonzero(np.isfinite(prior.anchors).all(axis=1))
        away = (prior.anchors - points)[known]
        squared = np.sum(away**2, axis=1) / prior.anchor_sd_m[known] ** 2 / 3
        weights = 1 / (prior.anchor_sd_m[known] ** 2 * (1 + squared / _ROBUST))
        rows = by_state.reshape(N_POINTS, 3, n)[known].reshape(-1, n)
        cost = float(np.sum(1.5 * _ROBUST * np.log1p(squared / _ROBUST)))
        rules.append((rows, away.ravel(), np.repeat(weights, 3), cost))
    return rules


def _rule(rows: Array, targets: Array, sd: Array) -> tuple[Array, Array, Array, float]:
    return rows, targets, 1 / sd**2, 0.5 * float(np.sum((targets / sd) ** 2))
